"""``scout-console look``: a behavior's debug views, listed, live in the terminal, as JSON lines or in a file."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from backbone.bus.interface import Bus, Clock
from backbone.command_line.connection import connected
from backbone.command_line.listening import watching_end
from backbone.command_line.unusable_file import FileUnusable
from backbone.command_line.where import Where
from backbone.debug_views import UnknownView, ViewEntry, ViewKind, ViewPicture, ViewValue
from backbone.errors import LinkError, Refusal
from backbone.launcher.endings import ExitCode, say, show
from backbone.naming import component_of, did_you_mean
from backbone.printable_text import printable_lines
from ui_console.model.debug_views import shown_text, view_rows
from ui_console.session.joining import end_server_on_signals, line_writer
from ui_console.session.looking import find_behavior, keep_looking, pixels_of, views_of
from ui_console.terminal.look_app import LookApp
from ui_console.terminal.pixels import can_show_pixels, png


class NothingShown(Refusal):
    """The behavior showed no picture of the view in the given time."""

    code = "views.nothing_shown"
    remedy = "It shows one when it is at work; 'scout-backbone why BEHAVIOR' says what it waits for."


class NoPicture(Refusal):
    """A value cannot be saved as a picture."""

    code = "usage.no_picture"
    remedy = "Save a view that is a picture; print values with --json."


class NoTerminal(Refusal):
    """A picture can be shown live in a terminal only."""

    code = "usage.no_terminal"
    remedy = "Without a terminal use --save FILE.png or --json."


@dataclass(frozen=True)
class LookOptions:
    """Options for showing a view.

    Attributes:
        as_json: JSON lines instead of a screen.
        save: File for one picture; None: none.
        for_s: Machine seconds after which the command ends; 0: it ends at Ctrl-C, or with its mission.
    """

    as_json: bool = False
    save: Path | None = None
    for_s: float = 0.0


async def look_into(where: Where, name: str, view: str, options: LookOptions) -> int:
    """List the views of a behavior, or show one of them; return the command's exit code.

    Args:
        name: Of the behavior.
        view: Of the view; empty: list them.
        options: How it is shown.

    Raises:
        Refusal: There is no such behavior or view, the view is not a picture, or the file cannot be written.
        LinkError: The behavior did not answer.
    """
    async with connected(where) as (bus, clock):
        behavior = await find_behavior(bus, name)
        entries = (await views_of(bus, behavior)).views
        if not view:
            show([json.dumps(listed_json(name, entries))] if options.as_json else listed_lines(name, entries))
            return ExitCode.DONE
        meant = next((entry for entry in entries if entry.view == view), None)
        if meant is None:
            names = [entry.view for entry in entries]
            raise UnknownView(
                f"{name} has no view {view!r}{did_you_mean(view, names)}; it has: {', '.join(names) or 'none yet'}"
            )
        looked = _Looked(bus, clock, behavior, meant)
        with watching_end(bus, clock, looked.mission_ended):
            code = await _shown(looked, options)
        if looked.farewell:
            say(looked.farewell)
        return code


async def _shown(looked: _Looked, options: LookOptions) -> ExitCode:
    if options.save is not None:
        return await _save(looked, options.save, options.for_s)
    if options.as_json or looked.entry.kind is ViewKind.VALUE:
        async with line_writer() as write:
            return await looked.until_end(_printer(write, as_json=options.as_json), options.for_s)
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise NoTerminal(f"the picture {looked.entry.view} needs a terminal")
    return await _live(looked, options.for_s)


def listed_lines(name: str, entries: list[ViewEntry]) -> list[str]:
    """Return the views for people, one line each: name, and newest value or ``(picture)``.

    Example:
        >>> listed_lines("w", [ViewEntry("threshold", ViewKind.VALUE, 28.0), ViewEntry("changed", ViewKind.PICTURE)])
        ['threshold  28', 'changed    (picture)']
    """
    if not entries:
        return [f"{name} has shown no view yet; it shows some when it is at work"]
    width = max(len(entry.view) for entry in entries)
    return [f"{row.view:<{width}}  {'(picture)' if row.is_picture else row.text}" for row in view_rows(entries)]


def listed_json(name: str, entries: list[ViewEntry]) -> dict[str, object]:
    """Return the views for programs: ``behavior``, and ``views`` with ``view``, ``kind`` and a value's ``value``."""
    views: list[dict[str, object]] = [
        {"view": entry.view, "kind": str(entry.kind)} | ({"value": entry.value} if entry.kind is ViewKind.VALUE else {})
        for entry in entries
    ]
    return {"behavior": name, "views": views}


def shown_json(shown: ViewPicture | ViewValue) -> dict[str, object]:
    """Return a shown value or picture for programs; of a picture, everything except the pixels."""
    about: dict[str, object] = {"view": shown.view, "at_s": round(shown.at_s, 3)}
    if isinstance(shown, ViewValue):
        return about | {"value": shown.value}
    return about | {"width_px": shown.width_px, "height_px": shown.height_px, "is_color": shown.is_color}


@dataclass
class _Looked:
    """A view while it is watched.

    Attributes:
        ended: Set when the command must end.
        farewell: Line to print at the end; empty: none.
    """

    bus: Bus
    clock: Clock
    behavior: str
    entry: ViewEntry
    ended: asyncio.Event = field(default_factory=asyncio.Event)
    farewell: str = ""

    def mission_ended(self, line: str) -> None:
        """End, because the mission has ended."""
        self.farewell = line
        self.ended.set()

    async def until_end(
        self,
        show_it: Callable[[ViewPicture | ViewValue], None],
        for_s: float,
        trouble: Callable[[Refusal | LinkError], None] = lambda error: say(str(error)),
    ) -> ExitCode:
        """Watch until ``ended``, a signal, or the end of the time; return the exit code."""
        interrupted = end_server_on_signals(lambda _signal: self.ended.set())
        work = keep_looking(self.bus, self.clock, self.behavior, self.entry.view, show_it, trouble=trouble)
        looking = asyncio.create_task(work, name="look")
        ending = asyncio.create_task(self.ended.wait(), name="end of the look")
        try:
            await asyncio.wait({looking, ending}, timeout=for_s or None, return_when=asyncio.FIRST_COMPLETED)
            if looking.done():
                looking.result()
        finally:
            looking.cancel()
            ending.cancel()
            await asyncio.wait({looking, ending})
        return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


def _printer(write: Callable[[bytes], None], *, as_json: bool) -> Callable[[ViewPicture | ViewValue], None]:
    """Return a function that prints values: all values as JSON, but for people only changed values."""
    before: list[object] = []

    def print_it(shown: ViewPicture | ViewValue) -> None:
        if as_json:
            write(json.dumps(shown_json(shown)).encode())
        elif isinstance(shown, ViewValue) and before != [shown.value]:
            before[:] = [shown.value]
            write(printable_lines(f"{shown.at_s:9.2f} s  {shown_text(shown.value)}", most=sys.maxsize).encode())

    return print_it


async def _save(looked: _Looked, file: Path, for_s: float) -> ExitCode:
    if looked.entry.kind is not ViewKind.PICTURE:
        raise NoPicture(f"{looked.entry.view} is a value, no picture")
    found: list[ViewPicture] = []

    def saw(shown: ViewPicture | ViewValue) -> None:
        if isinstance(shown, ViewPicture):
            found.append(shown)
            looked.ended.set()

    ended = await looked.until_end(saw, for_s)
    if not found:
        if ended is ExitCode.INTERRUPTED:
            return ended
        when = f"before {looked.farewell}" if looked.farewell else f"within {for_s:g} s"
        raise NothingShown(f"no picture of {looked.entry.view} came {when}")
    try:
        await asyncio.to_thread(file.write_bytes, png(pixels_of(found[0])))
    except OSError as error:
        raise FileUnusable(f"{file} cannot be written: {error.strerror or error}") from error
    say(f"{file}: {looked.entry.view} at {found[0].at_s:.2f} s")
    return ExitCode.DONE


async def _live(looked: _Looked, for_s: float) -> ExitCode:
    newest: list[ViewPicture] = []
    unpacked: list[tuple[ViewPicture, NDArray[np.uint8]]] = []
    remark: list[str] = []
    title = f"{component_of(looked.behavior)}: {looked.entry.view}"

    def saw(shown: ViewPicture | ViewValue) -> None:
        if isinstance(shown, ViewPicture):
            newest[:], remark[:] = [shown], []

    def picture() -> NDArray[np.uint8] | None:
        if newest and not (unpacked and unpacked[0][0] is newest[0]):
            unpacked[:] = [(newest[0], pixels_of(newest[0]))]
        return unpacked[0][1] if unpacked else None

    def line() -> str:
        age = f"{max(0.0, looked.clock.now_s() - newest[0].at_s):.1f} s old" if newest else "no picture yet"
        return "  ".join([title, age, *remark, "(q leaves)"])

    screen = LookApp(picture, line, has_pixels=can_show_pixels(os.environ))
    showing = asyncio.create_task(screen.run_async(), name="screen")
    showing.add_done_callback(lambda _done: looked.ended.set())
    try:
        return await looked.until_end(saw, for_s, lambda error: remark.__setitem__(slice(None), [str(error)]))
    finally:
        screen.exit()
        await asyncio.wait({showing})
        showing.result()
