"""Draws the pictures of the documentation from a running mission: ``.venv/bin/python docs/pictures/make.py``.

What is shown is what a terminal of 120 columns shows. It takes about a minute: the target has to pass.
"""

from __future__ import annotations

import asyncio
import io
import os
import subprocess
import sys
import tempfile
from collections import deque
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from textual.pilot import Pilot

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.component import NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.picture.look import look
from backbone.picture.screen import live_screen
from mission_control.messages import MotionSeen
from ui_console.model.events import ConsoleEvent, Granted
from ui_console.session.observer import Observer
from ui_console.session.teleoperation import Teleoperation
from ui_console.terminal.session import TerminalSession

HERE = Path(__file__).parent
MISSION_XML = HERE.parents[1] / "mission.xml"
COLUMNS, LINES = 120, 34
MOTION_WITHIN_S, GRANT_WITHIN_S = 90.0, 30.0
PICTURE_STANDS_S, KEY_EVERY_S, KEYS = 2.0, 0.1, 8
TURNS_PASS_S = 25.0


async def main() -> None:
    """Write ``up.svg``, ``attach.svg`` and ``monitor.svg`` beside this file."""
    found = run_files.find(None)
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)

    async def join(address: str) -> ZenohBus:
        return await ZenohBus.open_when_up(found.mission, address, clock, client_config(found.endpoint))

    bus = await join("ui_console/painter")
    try:
        (HERE / "up.svg").write_text(await _picture_of_up(bus, clock))
    finally:
        await bus.close()

    launch = Launch(
        found.mission,
        Subsystem.UI_CONSOLE,
        "console-1",
        "console",
        "ui_console.session.teleoperation:Teleoperation",
        found.host,
        found.endpoint,
        found.clock_origin_monotonic_s,
        found.clock_rate,
        {"robot": "scout3", "kind": "capture", "priority": 100},
    )
    session = TerminalSession(launch.name, found.mission, "anna")
    granted = asyncio.Event()

    def show(event: ConsoleEvent) -> None:
        session.show(event)
        if isinstance(event, Granted):
            granted.set()

    async def drive(pilot: Pilot[Any]) -> None:
        async with asyncio.timeout(GRANT_WITHIN_S):
            await granted.wait()
        await asyncio.sleep(PICTURE_STANDS_S)
        await pilot.press("K")
        for _key in range(KEYS):
            await pilot.press("left")
            await asyncio.sleep(KEY_EVERY_S)
        (HERE / "attach.svg").write_text(pilot.app.export_screenshot(title="scout-console attach scout3"))
        await pilot.press("q")

    console = Teleoperation(launch, await join(launch.address), clock, show=show, see=session.see, user="anna")
    await session.run(console, pilot=drive, size=(COLUMNS, LINES))

    launch = msgspec.structs.replace(launch, name="console-2", parameters={})
    watching = TerminalSession(launch.name, found.mission, "ben", sees=False)

    async def look_on(pilot: Pilot[Any]) -> None:
        await asyncio.sleep(TURNS_PASS_S)
        await pilot.press("K")
        (HERE / "monitor.svg").write_text(pilot.app.export_screenshot(title="scout-console monitor"))
        await pilot.press("q")

    observer: Observer[NoParameters] = Observer(
        launch, await join(launch.address), clock, show=watching.show, user="ben"
    )
    await watching.run(observer, pilot=look_on, size=(COLUMNS, LINES))


async def _picture_of_up(bus: ZenohBus, clock: MissionClock) -> str:
    """Return the live picture as of shortly after the first motion event."""
    events: deque[StoryEvent] = deque(maxlen=12)
    moved = asyncio.Event()
    bus.subscribe("*/*", Conversation.LOG, StoryEvent, lambda heard: events.append(heard.body))
    bus.subscribe("mission_control/*", Conversation.EVENTS, MotionSeen, lambda _heard: moved.set())
    async with asyncio.timeout(MOTION_WITHIN_S):
        await moved.wait()
    await asyncio.sleep(PICTURE_STANDS_S)
    paper = Console(record=True, width=COLUMNS, file=io.StringIO())
    paper.print(live_screen(await look(bus, clock.now_s()), events, LINES))
    return paper.export_svg(title="scout-backbone up mission.xml")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="scout-pictures-") as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        command = [sys.executable, "-m", "backbone.command_line.cli"]
        subprocess.run([*command, "up", str(MISSION_XML), "--detach"], check=True)  # noqa: S603
        try:
            asyncio.run(main())
        finally:
            subprocess.run([*command, "down"], check=True)  # noqa: S603
