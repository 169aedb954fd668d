"""The page of a mission that is up, served by the real command."""

from __future__ import annotations

import asyncio
import contextlib
import re
import subprocess
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from running_mission import BIN, RunningMission

from backbone.bus.interface import Bus
from resource_pool.localization import AskPose, Pose

HELD_WITHIN_S = 30.0
Hand = Callable[[], Awaitable[None]]


@dataclass
class Served:
    """A mission with its web console.

    Attributes:
        mission: The mission.
        port: Where the page is served.
        token: What opens it.
        process: The server's.
    """

    mission: RunningMission
    port: int
    token: str
    process: subprocess.Popen[str]


@contextlib.contextmanager
def serving(mission: RunningMission, port: int = 0) -> Iterator[Served]:
    """Serve the mission's console until the block ends."""
    said = Path(mission.environment["XDG_RUNTIME_DIR"]) / f"serve-{port}.log"
    with said.open("w") as errors:
        process = subprocess.Popen(
            [str(BIN / "scout-console"), "serve", "--port", str(port), "--mission", mission.name],
            env=mission.environment,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#token=(\S+)\n", line)
        assert found is not None, f"{line!r}\n{said.read_text()}"
        yield Served(mission, int(found[1]), found[2], process)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(10)
        assert process.stdout is not None
        process.stdout.close()


async def truth(bus: Bus, robot: str) -> Pose:
    """Return where the robot stands, as the simulated world has it."""
    return await bus.ask("resource_pool/world", AskPose(robot), Pose, within_s=5.0)


async def hold_until(page: Any, press: Hand, let_go: Hand, is_so: Callable[[], Awaitable[bool]], what: str) -> None:
    """Press a control and hold it until this is so, and further.

    A page that heard nothing for most of a second lets go of what is held, and asks to press anew. On a busy machine
    that happens, and a person then presses anew.
    """
    await press()

    async def is_so_by_now() -> bool:
        if await is_so():
            return True
        if await page.locator("#let-go").is_visible():
            await let_go()
            await press()
        return False

    await wait_until(is_so_by_now, what, HELD_WITHIN_S)


async def wait_until(is_so: Callable[[], Awaitable[bool]], what: str, within_s: float) -> None:
    """Return when this is so; what another process does gives no event here."""
    try:
        async with asyncio.timeout(within_s):
            while not await is_so():  # noqa: ASYNC110
                await asyncio.sleep(0.2)
    except TimeoutError:
        pytest.fail(f"never: {what}")
