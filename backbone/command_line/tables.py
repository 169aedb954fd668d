"""Tables of the command line."""

from __future__ import annotations

import signal
from collections.abc import AsyncIterator

from rich.console import Console, RenderableType
from rich.live import Live

from backbone.command_line.standard_streams import can_redraw
from backbone.command_line.status import EVERY_S
from backbone.operating_system.ending_signals import interruptible
from backbone.picture.mission import MissionPicture
from backbone.picture.screen import live_screen, screen, summary

REDRAW_EVERY_S = 0.5  # chosen: people see slices of seconds


class MissionTables:
    """A mission's tables.

    Args:
        width: Of tables; None: as the terminal.
    """

    def __init__(self, width: int | None) -> None:
        self._console = console_of_width(width)
        self.every_s = REDRAW_EVERY_S if can_redraw() else EVERY_S

    def show(self, picture: MissionPicture) -> None:
        """Print one; if it is longer than the terminal, its first lines also at the end, where a person sees them."""
        console = self._console
        print_on(console, screen(picture))
        if console.is_terminal and len(picture.components) > console.height:
            print_on(console, summary(picture))

    async def keep_showing(self, pictures: AsyncIterator[MissionPicture]) -> None:
        """Show each in the place of the one before, or below it in a file or pipe, until there are no more."""
        console = self._console
        if not can_redraw():
            async for picture in pictures:
                self.show(picture)
            return
        with Live(console=console, auto_refresh=False, screen=True, vertical_overflow="crop") as live:
            async for picture in pictures:
                live.update(live_screen(picture, None, console.height), refresh=True)


def print_on(console: Console, shown: RenderableType) -> None:
    """Print a table or a text; Ctrl-C ends the printing even if no reader takes it."""
    with interruptible([signal.SIGINT]):
        console.print(shown)


def console_of_width(width: int | None) -> Console:
    """Return a console for tables; None: as wide as the terminal."""
    # The text of a cell came over the bus, so square brackets in it are text and no markup.
    return Console(width=width, markup=False, emoji=False, highlight=False)
