"""Screen of ``scout-console look``: one debug view of one behavior, live."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from ui_console.terminal.ending import EndingApp
from ui_console.terminal.widgets import Video

REDRAW_EVERY_S = 0.1  # chosen: as often as a behavior shows a view


class LookApp(EndingApp):
    """The newest picture, and a line above it.

    Args:
        newest: Returns the newest picture, as ``video.shrink`` takes it, or None.
        line: Returns the present line.
        has_pixels: True if the terminal shows real pixels.
    """

    TITLE = "scout-console"
    ENABLE_COMMAND_PALETTE = False
    CSS = "#line { height: 1; background: $panel; color: $text; }  #video { height: 1fr; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("q,escape,ctrl+c", "quit", "leave", priority=True)]

    def __init__(
        self, newest: Callable[[], NDArray[np.uint8] | None], line: Callable[[], str], *, has_pixels: bool = False
    ) -> None:
        super().__init__()
        self._newest, self._line, self._has_pixels = newest, line, has_pixels

    def compose(self) -> ComposeResult:
        """Lay out: the line, the picture below."""
        yield Static(id="line", markup=False)
        yield Video(self._newest, has_pixels=self._has_pixels)

    def on_mount(self) -> None:
        """Begin to redraw."""
        self.call_after_refresh(self.redraw)
        self.set_interval(REDRAW_EVERY_S, self.redraw)

    def redraw(self) -> None:
        """Show the newest picture and line."""
        self.query_one("#line", Static).update(self._line(), layout=False)
        self.query_one(Video).look()
