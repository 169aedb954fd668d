"""Two consoles of equal priority and one robot: turns by the scheduler's rule, or the robot for the asking."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from consoles_at_work import WAIT_S, consoles_at_work
from running_mission import RunningMission, mission_up

from backbone.component.messages import AskStory, Story
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from resource_pool.arc_client import Suspended
from ui_console.model.consent import Sought
from ui_console.model.driving import DriveWish
from ui_console.model.events import ConsentHeard, GivenBack, Granted

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

SLICE_S = 5.0
SHORT_SLICE_S = 1.0


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


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
