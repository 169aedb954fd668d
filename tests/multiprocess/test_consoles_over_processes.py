"""Consoles over real processes: stops, and two of equal priority with one robot.

What the wheels do is read off the poses of the simulated world. Equals have turns by the scheduler's rule, or the robot
for the asking.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from consoles_at_work import WAIT_S, Console, consoles_at_work
from running_mission import BIN, RunningMission, mission_up

from backbone.bus.interface import Bus
from backbone.component.messages import AskStory, Story
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.wire import Envelope
from resource_pool.arc_client import DEFAULT_DRIVE_USAGE, StopState, Suspended, ask_stop, watch_stops
from resource_pool.drivers.world_messages import RadioPacket
from resource_pool.localization import AskPose, Pose
from scout_model.radio_link import DrivePacket, decode
from ui_console.model.consent import Sought
from ui_console.model.driving import KEYS_LET_GO_S, DriveWish
from ui_console.model.events import ConsentHeard, GivenBack, Granted
from ui_console.session.teleoperation import Teleoperation

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

TURN = DriveWish(3.0, -3.0)  # on the spot, so that no wall is in the way
REPEAT_S = 0.05
LAST_DRIVES = round(0.5 / DEFAULT_DRIVE_USAGE.period_s)  # the bound is half a second, however slow the machine
NETWORK_ID = 3  # of scout3
STILL_RAD = 0.02  # while it stands it may rock a little
LOOKED_S = 0.8
ROBOTS = 3
SLICE_S, SHORT_SLICE_S = 5.0, 1.0


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


async def turns(bus: Bus) -> None:
    """Return when the robot turns."""
    async with asyncio.timeout(WAIT_S):
        while await turned_rad(bus, LOOKED_S) <= 5 * STILL_RAD:
            pass


async def stands(bus: Bus) -> None:
    """Return when the robot stands."""
    async with asyncio.timeout(WAIT_S):
        while await turned_rad(bus, LOOKED_S) >= STILL_RAD:
            pass


class Air:
    """Counts the packets that turn the robot's wheels."""

    def __init__(self, bus: Bus) -> None:
        self.drives = 0
        bus.subscribe("resource_pool/world", Conversation.COMMAND, RadioPacket, self._heard)

    def _heard(self, heard: Envelope[Any]) -> None:
        if heard.body.network_id == NETWORK_ID:
            self.drives += isinstance(decode(heard.body.payload), DrivePacket)


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
        air = Air(bus)
        component(anna).take()
        await anna.hears(0, Granted)
        key = asyncio.create_task(hold(component(anna)))
        await turns(bus)
        assert await component(ben).stop_robot("scout3", "a child")
        before = air.drives
        await stands(bus)
        assert 0 < before <= air.drives <= before + LAST_DRIVES
        number = (await ask_stop(bus, "scout3")).number
        assert await component(ben).stop_robot("scout3"), "stopped twice it is still stopped"
        assert not await component(ben).lift_stop("scout3", number), "that was the stop before"
        assert await component(ben).lift_stop("scout3", number + 1)
        assert await turned_rad(bus, LOOKED_S) < STILL_RAD, "the key is still held"
        await let_go(key)
        key = asyncio.create_task(hold(component(anna)))
        await turns(bus)
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


async def test_who_holds_a_robot_lets_an_equal_who_asks_have_it_before_the_slice_is_over(
    mission: RunningMission,
) -> None:
    async with mission.bus("ui_console/onlooker") as bus:
        acts: list[OperatorActed] = []
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda heard: acts.append(heard.body))
        people = [("anna", 100), ("ben", 100)]
        async with consoles_at_work(mission, bus, "scout3", people, minimum_runtime_s=60.0) as (anna, ben):
            assert anna.component is not None
            assert ben.component is not None
            await anna.take_and_drive(DriveWish(4.0, 4.0))
            mark = len(ben.events)
            ben.component.take()
            ben.component.begin_ask_consent("mine is stuck")
            sought = await anna.hears(0, Sought)
            assert (sought.user, sought.why) == ("ben", "mine is stuck")
            anna.component.decide(False, "nearly done")
            refused = await ben.hears(mark, ConsentHeard)
            assert (refused.is_given, refused.user, refused.reason) == (False, "anna", "nearly done")
            assert anna.component.is_held

            mark, anna_mark = len(ben.events), len(anna.events)
            ben.component.begin_ask_consent()
            await anna.hears(anna_mark, Sought)
            decided_s = anna.clock.now_s()
            anna.component.decide(True)
            granted = await ben.hears(mark, Granted)
            assert (await ben.hears(mark, ConsentHeard)).is_given
            assert (await anna.hears(anna_mark, GivenBack)).reason == "ben may have it"
            assert not anna.since(anna_mark, Suspended)
            assert await ben.component.do(DriveWish(-4.0, -4.0))
            print(f"granted {1e3 * (granted.at_s - decided_s):.0f} ms after the yes")
            assert granted.at_s - decided_s < SLICE_S, "long before the slice of 60 s is over"
            story = await bus.ask("ui_console/ben", AskStory("scout3"), Story, within_s=2)
    told = [event.what for event in story.events]
    assert "anna keeps it from ben: nearly done" in told
    consents = [(act.user, act.action) for act in acts if "consent" in act.action or act.action == "decline"]
    assert consents == [
        ("ben", OperatorAction.ASK_CONSENT),
        ("anna", OperatorAction.DECLINE),
        ("ben", OperatorAction.ASK_CONSENT),
        ("anna", OperatorAction.CONSENT),
    ]


async def test_equals_who_ask_for_nothing_but_the_robot_take_turns(mission: RunningMission) -> None:
    async with mission.bus("ui_console/onlooker") as bus:
        people = [("cleo", 100), ("dan", 100)]
        async with consoles_at_work(mission, bus, "scout3", people, minimum_runtime_s=SHORT_SLICE_S) as (cleo, dan):
            await cleo.take_and_drive(DriveWish(4.0, 4.0))
            assert dan.component is not None
            dan.component.take()
            mark = len(cleo.events)
            await dan.hears(0, Granted)
            lost = await cleo.hears(mark, Suspended)
            assert lost.by == "dan-drive"
            again = await cleo.hears(mark, Granted)
            assert again.again
            told = await bus.ask("resource_pool/scout3", AskStory(), Story, within_s=2)
    of_dan = {event.what.partition(" ")[0]: event.at_s for event in told.events if event.subject == "dan-drive"}
    assert SHORT_SLICE_S <= of_dan["disconnected:"] - of_dan["connected"] < WAIT_S, told  # by the robot's own clock
