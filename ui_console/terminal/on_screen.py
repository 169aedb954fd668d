"""Consoles with a screen in a terminal: one drives, the other watches."""

from __future__ import annotations

from dataclasses import dataclass

from backbone.command_line.where import Where
from backbone.component.component import NoParameters
from backbone.launcher.endings import ExitCode
from ui_console.model.profile import Profile
from ui_console.session.gamepad import find_gamepad
from ui_console.session.joining import end_on_signals, join
from ui_console.session.observer import Observer
from ui_console.session.teleoperation import Teleoperation
from ui_console.terminal.session import TerminalSession


@dataclass(frozen=True)
class Looks:
    """Appearance of a console with a screen, and its person.

    Attributes:
        profile: The screen.
        user: The person at it.
        sees: True: this machine receives pictures.
        is_bare: True: the screen begins with the picture alone.
        has_gamepad: True: this machine's gamepad also drives.
    """

    profile: Profile
    user: str
    sees: bool
    is_bare: bool
    has_gamepad: bool


async def drive_by_hand(where: Where, wished: dict[str, object], looks: Looks) -> int:
    """Drive a robot by keys; return the command's exit code.

    Args:
        wished: Parameters of ``Teleoperation``.
        looks: Appearance of the screen.

    Raises:
        Refusal: The claim was refused, and no other claim followed.
    """
    pad = find_gamepad() if looks.has_gamepad else None
    joining = await join(where, wished)
    launch = joining.launch
    session = TerminalSession(
        launch.name,
        launch.mission,
        looks.user,
        profile=looks.profile,
        is_bare=looks.is_bare,
        sees=looks.sees,
        gamepad=pad,
    )
    see = session.see if looks.sees else None
    console = Teleoperation(
        launch,
        await joining.open_bus(),
        joining.clock,
        show=session.show,
        see=see,
        keeps_arc=True,
        user=looks.user,
    )
    interrupted = end_on_signals(console)
    ended = await session.run(console)
    if console.refusal is not None and console.given_back is None:
        raise console.refusal
    return ExitCode.INTERRUPTED if interrupted() else ended


async def watch_on_screen(where: Where, user: str) -> int:
    """Show the mission until a key or a signal ends it; return the command's exit code."""
    joining = await join(where)
    launch = joining.launch
    session = TerminalSession(launch.name, launch.mission, user, sees=False)
    console: Observer[NoParameters] = Observer(
        launch, await joining.open_bus(), joining.clock, show=session.show, user=user
    )
    interrupted = end_on_signals(console)
    ended = await session.run(console)
    return ExitCode.INTERRUPTED if interrupted() else ended
