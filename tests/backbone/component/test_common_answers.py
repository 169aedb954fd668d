"""What every component answers, on the local bus, in virtual time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from component_stage import TOWER, WALKER, Gait, Poke, Poked, Stage, TooSteep, Walker, launch, live

from backbone.bus.clock import VirtualClock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import (
    AskParameters,
    AskState,
    AskStatistics,
    AskStory,
    ComponentState,
    LifeState,
    Parameters,
    SetParameter,
    Statistics,
    Story,
    StoryEvent,
    WrongParameter,
)
from backbone.keys import Conversation
from backbone.ranges import MOST_ENTRIES
from backbone.wire import WIRE_VERSION, Envelope, Reader, write

# Questions everybody answers


def test_state_says_who_and_how_it_is() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.report("climbs")
        state = await stage.ask(AskState(), ComponentState)
        assert (state.address, state.type, state.host, state.requester) == (WALKER, "walker", "here", TOWER)
        assert (state.state, state.since_s, state.feedback) == (LifeState.READY, 0.0, "climbs")
        await stage.clock.sleep_s(0.1)
        assert stage.states[-1] == state
        count = len(stage.states)
        stage.walker.report("climbs")
        stage.walker.changed()  # as after news that its state does not show
        await stage.clock.sleep_s(0.1)
        assert len(stage.states) == count, "no news was published"
        stage.walker.end("enough")
        await life

    live(law())


def test_several_reports_within_a_moment_are_published_once_with_the_last() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        count = len(stage.states)
        for feedback in ("climbs", "slips", "stands"):
            stage.walker.report(feedback)
            await stage.clock.sleep_s(0.001)
        await stage.clock.sleep_s(0.1)
        assert [state.feedback for state in stage.states[count:]] == ["stands"]
        stage.walker.end("enough")
        await life

    live(law())


def test_a_state_that_was_only_answered_is_corrected_by_the_next_publication() -> None:
    """Found by a simulated night: a new nameserver was told of an absence that was over before it was published."""

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        published = len(stage.states)
        stage.walker.report("stumbles")
        assert (await stage.ask(AskState(), ComponentState)).feedback == "stumbles"
        stage.walker.report("")
        await stage.clock.sleep_s(0.1)
        assert [state.feedback for state in stage.states[published:]] == [""]
        stage.walker.end("enough")
        await life

    live(law())


def test_statistics_join_the_bus_and_the_component() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.ask(Poke("x"), Poked)
        values = (await stage.ask(AskStatistics(), Statistics)).values
        assert values["pokes"] == 1.0
        assert values["bus_answered"] == 2.0
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.parametrize(
    ("odd", "legal"),
    [
        ({"queue_s": math.nan}, {}),
        ({"queue_s": -math.inf, "load": 0.5}, {"load": 0.5}),
        ({"frames": 10**30}, {}),
        ({"mode": "fast", "is_on": True, "none": None, "list": [1]}, {}),
        ({5: 1.0, "n" * 256: 1.0}, {}),
        ({'a "name"\n': 1.0}, {'a "name"\n': 1.0}),
        ({"share": np.float32(0.5), "frames": np.int64(7)}, {"share": 0.5, "frames": 7.0}),
    ],
)
def test_a_statistic_that_no_message_can_hold_does_not_hide_the_others(
    odd: dict[Any, Any], legal: dict[str, float]
) -> None:
    async def law() -> None:
        stage = Stage()
        logged: list[StoryEvent] = []
        stage.tower.subscribe(WALKER, Conversation.LOG, StoryEvent, lambda e: logged.append(e.body))
        life = await stage.begin()
        stage.walker.odd = odd
        for _again in range(2):
            told = await stage.ask(AskStatistics(), Statistics)
            values = Reader(Statistics).read(write(Envelope(WIRE_VERSION, WALKER, 1, 0.0, "", told))).body.values
            assert {"pokes", "bus_answered"} <= values.keys()
            assert {name: value for name, value in values.items() if name in odd} == legal
        await stage.clock.sleep_s(0.1)
        assert len(logged) == (len(legal) < len(odd)), "it is logged once"
        assert all(repr(next(iter(odd))) in event.what for event in logged)
        stage.walker.end("enough")
        await life

    live(law())


def test_a_bug_in_statistics_is_logged_once_and_ends_nothing() -> None:
    async def law() -> None:
        stage = Stage(stumble="statistics")
        logged: list[str] = []
        stage.tower.subscribe(WALKER, Conversation.LOG, StoryEvent, lambda event: logged.append(event.body.what))
        life = await stage.begin()
        for _again in range(2):
            values = (await stage.ask(AskStatistics(), Statistics)).values
            assert "bus_answered" in values
        await stage.clock.sleep_s(0.1)
        [event] = logged
        assert event.startswith("its own statistics are missing: KeyError: 'statistics' (")
        stage.walker.end("enough")
        await life

    live(law())


def test_more_statistics_than_a_message_holds_are_cut() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        stage.walker.odd = {f"n{number}": 1.0 for number in range(MOST_ENTRIES + 1)}
        values = (await stage.ask(AskStatistics(), Statistics)).values
        assert len(values) == MOST_ENTRIES
        assert {"bus_answered", "pokes", "n0"} <= values.keys()
        stage.walker.end("enough")
        await life

    live(law())


def test_a_parameter_is_set_told_and_noted() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        values = (await stage.ask(SetParameter("step_s", 0.25, "ann"), Parameters)).values
        assert values == {"step_s": 0.25, "slope": 0.0, "name": "trot"}
        assert (await stage.ask(AskParameters(), Parameters)).values == values
        assert stage.walker.diary[-1] == "step 0.25 s"
        (event,) = stage.walker.story.of("step_s")
        assert event.what == "ann set step_s from 0.5 to 0.25"
        assert event.cause.startswith(f"{TOWER}#")
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("speed", 1, "no parameter 'speed'; it has: name, slope, step_s"),
        ("step_s", "fast", "Expected `float`, got `str`"),
        ("step_s", -1.0, "> 0"),
        ("step_s", None, "got `null`"),
        ("name", 7, "Expected `str`, got `int`"),
    ],
)
def test_a_parameter_that_does_not_fit_is_refused_with_the_reason(name: str, value: Any, complaint: str) -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(WrongParameter) as refused:
            await stage.ask(SetParameter(name, value), Parameters)
        assert complaint in refused.value.detail
        assert "'scout-backbone set NAME' lists" in refused.value.remedy
        assert stage.walker.parameters == Gait()
        stage.walker.end("enough")
        await life

    live(law())


def test_a_parameter_the_component_refuses_is_not_kept() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(TooSteep):
            await stage.ask(SetParameter("slope", 2.0), Parameters)
        assert stage.walker.parameters == Gait()
        assert stage.walker.story.of("slope") == []
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.parametrize("parameters", [{"speed": 1}, {"step_s": "fast"}, {"step_s": 0.0}])
def test_launch_parameters_that_do_not_fit_are_refused_before_it_lives(parameters: dict[str, Any]) -> None:
    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        with pytest.raises(WrongParameter, match=f"{WALKER.partition('/')[2]}: "):
            Walker(launch(parameters=parameters), network.join(WALKER, clock), clock)

    live(law())


# Story


def test_the_story_names_the_causes_also_of_what_tasks_did() -> None:
    async def law() -> None:
        stage = Stage()
        logged: list[Any] = []
        stage.tower.subscribe(WALKER, Conversation.LOG, StoryEvent, lambda e: logged.append(e.body))
        life = await stage.begin()
        await stage.ask(Poke("chain"), Poked)
        await stage.clock.sleep_s(0.1)
        story = await stage.ask(AskStory("way"), Story)
        (event,) = story.events
        assert (event.what, event.where, event.cause) == ("was walked", WALKER, f"{TOWER}#1")
        assert logged == [event]
        stage.walker.end("enough")
        await life

    live(law())


def test_a_story_tells_of_whole_names_only() -> None:
    async def law() -> None:
        stage = Stage()
        book = stage.walker.story
        for what in ("connected scout1", "connected scout10", "lost my-scout1", "took resource_pool/scout1, at last"):
            book.note("radio", what)
        book.note("scout1", "moved")
        assert [event.what for event in book.of("scout1")] == [
            "connected scout1",
            "took resource_pool/scout1, at last",
            "moved",
        ]
        assert len(book.of()) == 5
        assert [event.what for event in book.of("resource_pool/scout1")] == ["took resource_pool/scout1, at last"]

    live(law())


def test_a_story_keeps_the_newest() -> None:
    async def law() -> None:
        book = Stage().walker.story
        for number in range(1000):
            book.note("x", str(number))
        kept = [event.what for event in book.of()]
        assert kept == [str(number) for number in range(1000 - len(kept), 1000)]
        assert len(kept) == 512

    live(law())
