"""Dialogs for debug views: pick a view of a behavior, and watch it live."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping

import numpy as np
from numpy.typing import NDArray
from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Static

from backbone.debug_views import ViewPicture, Views, ViewValue
from backbone.errors import LinkError, Refusal
from backbone.naming import component_of
from backbone.printable_text import printable_lines
from ui_console.model.debug_views import ViewRow, shown_text, view_rows
from ui_console.session.looking import pixels_of
from ui_console.terminal.dialogs import ChoiceDialog, Dialog, DialogChoice
from ui_console.terminal.widgets import Video

Show = Callable[[ViewPicture | ViewValue], None]
Trouble = Callable[[Refusal | LinkError], None]
KeepLooking = Callable[[Show, Trouble], Coroutine[object, None, None]]


def views_dialog(views: Mapping[str, Views]) -> ChoiceDialog[tuple[str, str]]:
    """Return the dialog that answers with the address of a behavior and the name of one of its views.

    Args:
        views: Views of each behavior, by address.
    """
    width = max((len(component_of(address)) for address, found in views.items() if found.views), default=0)
    choices = [_view_choice(at, row, width) for at, found in views.items() for row in view_rows(found.views)]
    return ChoiceDialog("what the behaviors see (enter shows it)", choices)


def _view_choice(address: str, row: ViewRow, width: int) -> DialogChoice[tuple[str, str]]:
    text = "" if row.is_picture else f"  {printable_lines(row.text)}"
    line = Text.assemble(f"{component_of(address):<{width}}  ", (row.view, "bold"), text)
    return DialogChoice(line, lambda _values: (address, row.view))


class ViewDialog(Dialog[None]):
    """A live view; after the dialog is closed, the behavior stops publishing it.

    Args:
        title: Its behavior and name.
        keep_looking: Calls its arguments with each picture or value, and with each trouble, until cancelled.
        has_pixels: True if the terminal shows real pixels, and no other picture is on the screen.
    """

    def __init__(self, title: str, keep_looking: KeepLooking, *, has_pixels: bool = False) -> None:
        super().__init__()
        self._title, self._keep_looking, self._has_pixels = title, keep_looking, has_pixels
        self._picture: NDArray[np.uint8] | None = None
        self._line = "nothing was shown yet"

    def compose(self) -> ComposeResult:
        """Lay out: the picture, and a line below it."""
        with Vertical() as box:
            box.border_title = Text(f"{self._title} (escape leaves)")
            yield Video(lambda: self._picture, has_pixels=self._has_pixels)
            yield Static(id="view-line", markup=False)

    def on_mount(self) -> None:
        """Begin to look."""
        self._look()

    def on_resize(self) -> None:
        """Fit the picture into the available space."""
        self.call_after_refresh(self._redraw)

    @work
    async def _look(self) -> None:
        try:
            await self._keep_looking(self._saw, self._in_trouble)
        except (Refusal, LinkError) as error:
            self._in_trouble(error)

    def _saw(self, shown: ViewPicture | ViewValue) -> None:
        if isinstance(shown, ViewPicture):
            self._picture, self._line = pixels_of(shown), f"at {shown.at_s:.1f} s"
        else:
            self._line = f"{printable_lines(shown_text(shown.value))}  at {shown.at_s:.1f} s"
        self.call_after_refresh(self._redraw)

    def _in_trouble(self, error: Refusal | LinkError) -> None:
        self._line = printable_lines(str(error))
        self.call_after_refresh(self._redraw)

    def _redraw(self) -> None:
        if self.is_active:
            self.query_one(Video).look()
            self.query_one("#view-line", Static).update(self._line)
