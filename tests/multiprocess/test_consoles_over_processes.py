"""Stops over real processes: what the wheels do is read off the poses of the simulated world."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from contextlib import suppress

import pytest
from consoles_at_work import WAIT_S, Console, consoles_at_work
from running_mission import BIN, RunningMission, mission_up

from backbone.bus.interface import Bus
from resource_pool.arc_client import StopState, ask_stop, watch_stops
from resource_pool.localization import AskPose, Pose
from ui_console.model.consent import Sought
from ui_console.model.driving import KEYS_LET_GO_S, DriveWish
from ui_console.model.events import Granted
from ui_console.session.teleoperation import Teleoperation

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

TURN = DriveWish(3.0, -3.0)  # on the spot, so that no wall is in the way
REPEAT_S = 0.05
STANDS_WITHIN_S = 0.5  # the bound
STILL_RAD = 0.02  # while it stands it may rock a little
LOOKED_S = 0.8
ROBOTS = 3


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


async def turned_rad(bus: Bus, seconds: float) -> float:
    """Return how far the robot turned within so long."""
    before = await bus.ask("resource_pool/world", AskPose("scout3"), Pose, within_s=2.0)
    await asyncio.sleep(seconds)
    after = await bus.ask("resource_pool/world", AskPose("scout3"), Pose, within_s=2.0)
    return abs(math.remainder(after.heading_rad - before.heading_rad, math.tau))


async def hold(console: Teleoperation) -> None:
    """Hold a key down until cancelled."""
    while True:
        console.hold(TURN)
        await asyncio.sleep(REPEAT_S)


async def let_go(key: asyncio.Task[None]) -> None:
    key.cancel()
    with suppress(asyncio.CancelledError):
        await key
    await asyncio.sleep(KEYS_LET_GO_S + 2 * REPEAT_S)


def component(console: Console) -> Teleoperation:
    assert console.component is not None
    return console.component


@pytest.mark.thorough
async def test_a_held_key_moves_nothing_after_stop_and_lift_until_it_is_pressed_anew(mission: RunningMission) -> None:
    async with (
        mission.bus("ui_console/onlooker") as bus,
        consoles_at_work(mission, bus, "scout3", [("anna", 100), ("ben", 90)]) as (anna, ben),
    ):
        component(anna).take()
        await anna.hears(0, Granted)
        key = asyncio.create_task(hold(component(anna)))
        await asyncio.sleep(0.5)
        assert await turned_rad(bus, LOOKED_S) > 5 * STILL_RAD
        assert await component(ben).stop_robot("scout3", "a child")
        await asyncio.sleep(STANDS_WITHIN_S)
        assert await turned_rad(bus, LOOKED_S) < STILL_RAD
        number = (await ask_stop(bus, "scout3")).number
        assert await component(ben).stop_robot("scout3"), "stopped twice it is still stopped"
        assert not await component(ben).lift_stop("scout3", number), "that was the stop before"
        assert await component(ben).lift_stop("scout3", number + 1)
        assert await turned_rad(bus, LOOKED_S) < STILL_RAD, "the key is still held"
        await let_go(key)
        key = asyncio.create_task(hold(component(anna)))
        await asyncio.sleep(0.3)
        assert await turned_rad(bus, LOOKED_S) > 5 * STILL_RAD
        await let_go(key)


async def test_who_stopped_a_robot_is_asked_by_who_wants_it_to_move_and_not_once_gone(mission: RunningMission) -> None:
    async with (
        mission.bus("ui_console/onlooker") as bus,
        consoles_at_work(mission, bus, "scout3", [("ben", 90)]) as (ben,),
    ):
        async with consoles_at_work(mission, bus, "scout3", [("anna", 100)]) as (anna,):
            assert await component(anna).stop_robot("scout3")
            number = (await ask_stop(bus, "scout3")).number
            lifting = asyncio.create_task(component(ben).lift_stop("scout3", number))
            sought = await anna.hears(0, Sought)
            assert (sought.user, sought.topic) == ("ben", "lift")
            component(anna).decide(False)
            assert not await lifting
            assert (await ask_stop(bus, "scout3")).is_stopped
        assert await component(ben).lift_stop("scout3", number)
        assert not (await ask_stop(bus, "scout3")).is_stopped


async def test_a_script_on_a_pipe_stops_all_robots_before_it_is_granted_anything(mission: RunningMission) -> None:
    async with mission.bus("ui_console/onlooker") as bus:
        heard: dict[str, StopState] = {}
        stopped = asyncio.Event()

        def hear(state: StopState) -> None:
            heard[state.rc] = state
            if len(heard) == ROBOTS:
                stopped.set()

        watch_stops(bus, hear)
        script = await asyncio.create_subprocess_exec(
            str(BIN / "scout-console"),
            *["attach", "scout3", "--json", "--user", "cleo", "--priority", "1", "--mission", mission.name],
            env=mission.environment,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
        )
        assert script.stdin is not None
        script.stdin.write(b'{"stop_all": true, "reason": "smoke"}\n')
        await script.stdin.drain()
        async with asyncio.timeout(WAIT_S):
            await stopped.wait()
        stops = list(heard.values())
        assert {(stop.is_stopped, stop.by, stop.reason) for stop in stops} == {(True, "cleo", "smoke")}
        script.stdin.write(b'{"at_s": 0, "release": true}\n')
        script.stdin.close()
        async with asyncio.timeout(WAIT_S):
            out, _ = await script.communicate()
        assert json.loads(out.splitlines()[-1])["event"] == "released"
        async with consoles_at_work(mission, bus, "scout3", [("ben", 90)]) as (ben,):
            for stop in stops:
                assert await component(ben).lift_stop(stop.rc, stop.number), "the script has left"
