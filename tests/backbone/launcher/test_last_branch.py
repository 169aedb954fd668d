"""The last branch of a mission: what an order to end does with it, and how its end is noticed."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import AskStory, LogLevel, Story, StoryEvent
from backbone.component_database.messages import ComponentType
from backbone.keys import Conversation
from backbone.launcher.last_branch import LastBranch, LastStage, ends_before, how_it_finished
from backbone.launcher.last_run import run_last
from backbone.mission.behavior_nodes import BehaviorNode
from backbone.mission.behavior_orders import last_order
from backbone.mission.model import LastBranchDescription, MissionDescription
from backbone.naming import Subsystem
from backbone.placer.messages import NoHost
from backbone.wire import Envelope

HOME = LastBranchDescription(behavior=BehaviorNode(type="patrol", name="home", priority=1), within_s=60.0)
AT = "mission_control/home"
STEPS = st.lists(st.sampled_from(["order", "now", "began", "finished", "time", "refused"]), max_size=12)


def finished_event(status: str = "success", where: str = AT) -> StoryEvent:
    return StoryEvent(1.0, where, f"finished: {status}", "home", "", LogLevel.NOTICE)


def test_behaviors_end_before_it_and_what_it_sees_with_does_not() -> None:
    kinds = {"patrol": Subsystem.MISSION_CONTROL, "execution_unit": Subsystem.MISSION_CONTROL}
    kinds["scout"] = Subsystem.RESOURCE_POOL
    assert ends_before([ComponentType(name, "x:Y", of) for name, of in kinds.items()]) == {"patrol"}


def test_a_mission_without_one_goes_down_at_once_and_has_nothing_to_tell() -> None:
    last = LastBranch(None)
    assert last.ordered(1.0, is_up=True)
    assert (last.name, last.doing, last.told) == ("", "", "")


def test_the_first_order_runs_it_and_its_end_is_told_with_its_time() -> None:
    last = LastBranch(HOME)
    assert not last.ordered(10.0, is_up=True)
    assert last.doing == "last branch home runs, for at most 60 s; a second order ends it at once"
    assert last.began(12.0) == 72.0
    last.finished("succeeded", 20.3)
    assert last.told == "last branch home: succeeded after 8.3 s"
    assert last.ordered(20.4, is_up=True)
    assert last.told == "last branch home: succeeded after 8.3 s"


@pytest.mark.parametrize("is_begun", [False, True])
def test_a_second_order_ends_it_at_once_also_while_the_others_are_being_stopped(is_begun: bool) -> None:
    last = LastBranch(HOME)
    assert not last.ordered(10.0, is_up=True)
    if is_begun:
        last.began(11.0)
    assert last.ordered(14.0, is_up=True)
    assert last.told == f"last branch home: ended by a second order after {3.0 if is_begun else 4.0} s"


def test_an_order_may_do_without_it_and_a_mission_that_is_coming_up_does() -> None:
    skipped, early = LastBranch(HOME), LastBranch(HOME)
    assert skipped.ordered(1.0, is_up=True, at_once=True)
    assert early.ordered(1.0, is_up=False)
    assert (skipped.told, early.told) == (
        "last branch home: skipped, as ordered",
        "last branch home: skipped, because the mission was not up",
    )


@given(STEPS, st.booleans())
def test_it_runs_at_most_once_and_its_first_end_stands(steps: list[str], is_up: bool) -> None:
    last, runs, told = LastBranch(HOME), 0, ""
    for number, step in enumerate(steps):
        was, now_s = last.stage, float(number)
        match step:
            case "order" | "now":
                goes_down = last.ordered(now_s, is_up=is_up, at_once=step == "now")
                assert goes_down is (last.stage is LastStage.OVER)
                runs += not goes_down
            case "began":
                assert last.began(now_s) <= now_s + HOME.within_s
            case "finished" | "time":
                last.finished(step, now_s)
            case _:
                last.not_started("no host")
        assert last.stage.value >= was.value
        assert bool(last.told) is (last.stage is LastStage.OVER)
        assert told in ("", last.told)
        told = last.told
    assert runs <= (1 if is_up else 0)


def test_only_its_own_story_tells_that_it_has_finished() -> None:
    assert how_it_finished([finished_event("success", "mission_control/other")], "home") == ""
    assert how_it_finished([finished_event("running")], "home") == ""
    assert how_it_finished([finished_event("failure")], "home") == "failed"


def test_its_root_is_told_that_it_is_the_last() -> None:
    mission = MissionDescription(
        name="m",
        priority=7,
        hosts=(),
        core=(),
        types=(),
        resources=(),
        components=(),
        behaviors=(),
        source="m.xml",
        last=HOME,
    )
    order = last_order(mission)
    assert order is not None
    assert order.parameters["is_last"] is True
    assert order.parameters["path"] == [["m", 7], ["home", 1]]
    assert last_order(msgspec.structs.replace(mission, last=None)) is None


async def stays() -> str:
    await asyncio.Event().wait()
    raise AssertionError


async def is_stopped(clock: VirtualClock) -> str:
    await clock.sleep_s(2.0)
    return "by anna"


async def has_no_host() -> str:
    raise NoHost("home: no host is there")


def run(
    keeping: Coroutine[Any, Any, str] | None = None,
    finishes_at_s: float | None = None,
    *,
    says_so: bool = True,
    until_s: float = 60.0,
) -> tuple[str, float]:
    """Return how a last branch ended that finishes at this time, and when it was over."""

    async def main() -> tuple[str, float]:
        clock, network = VirtualClock(), LocalNetwork()
        launcher, behavior = network.join("backbone/launcher", clock), network.join(AT, clock)
        events: list[StoryEvent] = []

        async def answer(_asked: Envelope[AskStory]) -> Story:
            return Story(events)

        async def live() -> None:
            await clock.sleep_s(1.0)
            behavior.serve(AT, AskStory, answer)
            if finishes_at_s is not None:
                await clock.sleep_until_s(finishes_at_s)
                events.append(finished_event())
                if says_so:
                    behavior.publish(AT, Conversation.LOG, events[-1])

        living = asyncio.create_task(live())
        last = LastBranch(HOME)
        last.ordered(0.0, is_up=True)
        last.began(0.0)
        kept = is_stopped(clock) if keeping is None and finishes_at_s is None else keeping or stays()
        await run_last(last, launcher, clock, AT, kept, until_s)
        over_s = clock.now_s()
        living.cancel()
        await asyncio.wait({living})
        for bus in (launcher, behavior):
            await bus.close()
        return last.how, over_s

    return run_virtual(main())


def test_its_end_is_noticed_as_soon_as_it_is_published() -> None:
    assert run(finishes_at_s=8.3) == ("succeeded after 8.3 s", pytest.approx(8.3, abs=0.05))


def test_an_end_whose_news_is_lost_is_noticed_within_moments() -> None:
    how, over_s = run(finishes_at_s=8.3, says_so=False)
    assert how.startswith("succeeded")
    assert over_s < 9.5


def test_it_holds_the_end_of_the_mission_up_for_its_own_time_only() -> None:
    assert run(stays(), until_s=60.0) == ("was not done: its time is over after 60.0 s", pytest.approx(60.0))


def test_a_branch_that_no_host_can_run_holds_nothing_up() -> None:
    how, over_s = run(has_no_host())
    assert how == "could not be started: home: no host is there"
    assert over_s < 0.1


def test_a_branch_that_an_operator_stops_is_over() -> None:
    assert run() == ("stopped: by anna after 2.0 s", pytest.approx(2.0))
