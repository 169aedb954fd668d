"""A unit whose source is late or silent says that once, and its end."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from sample_modules import Number
from units_on_the_bus import ARRANGEMENTS, NUMBERS, TESTER, orders, play

from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus
from backbone.component.messages import (
    DEADLINES_MISSED,
    AskStatistics,
    LogLevel,
    Statistics,
    StoryEvent,
)
from backbone.deadlines import FIRST_S, Deadlines
from backbone.keys import Conversation
from backbone.quality import OutputQuality
from mission_control.modules.arrangement import arranged
from mission_control.modules.unit_component import UnitComponent
from mission_control.modules.unit_deadlines import LEAST_PAUSE_S


@pytest.mark.parametrize("own_thread", [False, True])
def test_a_missed_deadline_is_told_once_and_so_is_its_end(local_mission: Any, beside: Any, own_thread: bool) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        told: list[str] = []
        bus.subscribe(
            "mission_control/*",
            Conversation.LOG,
            StoryEvent,
            lambda one: told.append(f"{one.body.level} {one.body.what}"),
        )

        async def numbers(count: int, each_s: float) -> None:
            for value in range(count):
                bus.publish(TESTER, Conversation.EVENTS, Number(float(value)))
                await VirtualClock().sleep_s(each_s)

        await numbers(50, 0.2)
        assert told == [], "in time"
        await VirtualClock().sleep_s(30.0)
        late = f"no number from {TESTER}"
        assert told == [f"{LogLevel.WARNING} no value from {TESTER} within 0.25 s"]
        assert started["first"].feedback.startswith(late)
        await numbers(30, 0.2)
        assert [one.split(" ", 1)[1] for one in told[1:]] == ["comes again, 29.950 s late"]
        assert late not in started["first"].feedback
        values = (await bus.ask("mission_control/first", AskStatistics(), Statistics, within_s=1.0)).values
        assert values[f"{DEADLINES_MISSED}{TESTER}/events"] == 1

    deadline = {"number": OutputQuality(deadline_s=0.25).quality}
    play(local_mission, beside, arranged(orders(ARRANGEMENTS[1], own_thread), NUMBERS, deadline), scene)


def test_a_late_source_costs_little_until_it_speaks_again(
    local_mission: Any, beside: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    look, looks = Deadlines.newly_missed, itertools.count(1)

    def seldom(deadlines: Deadlines, now_s: float) -> list[str]:
        assert next(looks) < 70.0 / LEAST_PAUSE_S
        return look(deadlines, now_s)

    monkeypatch.setattr(Deadlines, "newly_missed", seldom)

    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        told: list[str] = []
        bus.subscribe("mission_control/first", Conversation.LOG, StoryEvent, lambda one: told.append(one.body.what))
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        await VirtualClock().sleep_s(60.0)
        bus.publish(TESTER, Conversation.EVENTS, Number(2.0))
        await VirtualClock().sleep_s(1.0)
        assert told == [f"no value from {TESTER} within 1e-09 s"]

    deadline = {"number": OutputQuality(deadline_s=1e-9).quality}
    play(local_mission, beside, arranged(orders(ARRANGEMENTS[1]), NUMBERS, deadline), scene)


def test_a_source_that_is_late_again_and_again_is_told_once_with_the_count_at_its_end(
    local_mission: Any, beside: Any
) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        told: list[str] = []
        bus.subscribe("mission_control/first", Conversation.LOG, StoryEvent, lambda one: told.append(one.body.what))

        async def numbers(count: int, each_s: float) -> None:
            for value in range(count):
                bus.publish(TESTER, Conversation.EVENTS, Number(float(value)))
                await VirtualClock().sleep_s(each_s)

        late = f"no value from {TESTER} within 0.25 s"
        await numbers(31, 0.35)
        assert told == [late]
        await numbers(50, 0.2)
        assert told == [late, "comes in time again; it was late 31 times, the last time by 0.100 s"]
        await numbers(2, 1.0)
        assert told[2:] == [late], "it is another trouble"

    deadline = {"number": OutputQuality(deadline_s=0.25).quality}
    play(local_mission, beside, arranged(orders(ARRANGEMENTS[1]), NUMBERS, deadline), scene)


def test_a_source_that_never_speaks_is_told_when_a_mission_could_be_up(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        told: list[StoryEvent] = []
        bus.subscribe("mission_control/rest", Conversation.LOG, StoryEvent, lambda one: told.append(one.body))
        await VirtualClock().sleep_s(FIRST_S - 0.5)
        assert told == []
        await VirtualClock().sleep_s(60.0)
        assert [one.what for one in told] == ["no value from mission_control/first/twice within 0.25 s"]

    deadline = {"twice": OutputQuality(deadline_s=0.25).quality}
    play(local_mission, beside, arranged(orders(ARRANGEMENTS[1]), NUMBERS, deadline), scene)
