"""A script moves nothing after a stop or a lift before it halted."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from held_robot import HeldRobot

from backbone.bus.clock import VirtualClock, run_virtual
from resource_pool.commands import Drive as ArcDrive
from resource_pool.commands import Halt as ArcHalt
from ui_console.session.scripted import ScriptDriver

Scene = Callable[[HeldRobot], Awaitable[None]]


@pytest.fixture
def scripted(local_mission: Any) -> Callable[[Scene], None]:
    """Like ``stage``, with a console that the scene starts."""

    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                on = HeldRobot(placer, is_scripted=True)
                try:
                    await scene(on)
                finally:
                    await on.rc.close()
                    await placer.close()

        run_virtual(main())

    return run


async def play(on: HeldRobot, lines: list[tuple[float, str | None]]) -> tuple[int, list[str]]:
    """Write these lines into the script's pipe, each after its pause; return how it ended and the words it said."""
    said: list[bytes] = []
    driver = ScriptDriver(said.append)
    on.make_console(show=driver.show, work=driver.drive)
    living = asyncio.create_task(on.console.run())
    for pause_s, line in lines:
        await on.clock.sleep_s(pause_s)
        driver.feed(line)
    await living
    return driver.exit_code(on.console), [json.loads(line)["event"] for line in said]


def test_a_script_drives_on_after_a_lift_only_when_it_halted_first(scripted: Callable[[Scene], None]) -> None:
    async def scene(on: HeldRobot) -> None:
        drive = '{"at_s":%s,"left_rad_s":4,"right_rad_s":4}'
        playing = asyncio.create_task(
            play(
                on, [(0.0, drive % 0), (3.0, drive % 3), (1.0, '{"at_s":4,"halt":true}'), (1.0, drive % 5), (1.0, None)]
            )
        )
        await on.held()
        await on.clock.sleep_s(1.0)
        assert on.drives()
        on.stop()
        await on.clock.sleep_s(0.5)
        on.lift()
        on.arc.commands.clear()
        await on.clock.sleep_s(2.0)
        assert not on.drives(), "neither the line that was repeated nor the next one"
        arc = on.arc
        code, words = await playing
        drives = [at_s for at_s, _epoch, command in arc.commands if isinstance(command, ArcDrive)]
        halts = [at_s for at_s, _epoch, command in arc.commands if isinstance(command, ArcHalt)]
        assert drives
        assert min(drives) > max(halts)
        assert (code, "stop" in words) == (5, True)

    scripted(scene)


def test_a_script_stops_robots_before_its_grant_and_at_once(scripted: Callable[[Scene], None]) -> None:
    async def scene(on: HeldRobot) -> None:
        playing = asyncio.create_task(
            play(
                on,
                [(0.5, '{"stop_robot":"scout1","reason":"a child"}'), (2.0, '{"at_s":0,"release":true}'), (0.0, None)],
            )
        )
        await on.clock.sleep_s(0.6)
        state = on.latch.state
        assert (state.is_stopped, state.by, state.reason) == (True, "anna", "a child")
        await on.held()
        await playing

    scripted(scene)


def test_a_script_moves_nothing_after_a_stop_of_its_own_robot_that_is_not_answered(
    scripted: Callable[[Scene], None],
) -> None:
    async def scene(on: HeldRobot) -> None:
        drive, stop = '{"at_s":0,"left_rad_s":4,"right_rad_s":4}', '{"stop_robot":"scout1"}'
        playing = asyncio.create_task(play(on, [(0.0, drive), (2.0, stop), (6.0, None)]))
        await on.held()
        await on.clock.sleep_s(1.0)
        assert on.drives()
        away = on.placer.network.servers.pop("resource_pool/scout1")
        await on.clock.sleep_s(1.2)
        on.arc.commands.clear()
        await on.clock.sleep_s(2.0)
        assert not on.drives()
        on.placer.network.servers["resource_pool/scout1"] = away
        await on.clock.sleep_s(1.0)
        assert on.latch.state.is_stopped
        code, _ = await playing
        assert code == 5

    scripted(scene)
