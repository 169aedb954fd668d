"""The RC manager's loop on the local bus: grants in turns, reasons, shares and the trace."""

from __future__ import annotations

import asyncio
import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rc_manager_at_work import HARDWARE, a_pool, request

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.rc_manager.messages import (
    RENEW_EVERY_S,
    AskSchedule,
    AskUtilization,
    AskWhy,
    Done,
    RcState,
    SetPriority,
    Withdraw,
)
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.requests import (
    CapacityExceeded,
    RcUse,
    RequestState,
    UnknownRc,
    Usage,
)
from backbone.scheduling.views import Schedule, Utilization, Why


def test_two_equals_share_a_frequency_five_seconds_each(pool: Any) -> None:
    """RAM 2002: two Scouts, one video frequency, 5 s each, round robin."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            first = await one.ask_for(request("one", "left", "video", "radio"))
            second = await two.ask_for(request("two", "right", "video", "radio"))
            assert first.state is RequestState.CONNECTING
            assert (second.state, second.blockers) == (RequestState.WAITING, ["one"])
            await here.clock.sleep_until_s(26.0)
            opens = sorted((at, arc.name) for arc in (one, two) for what, _, at in arc.log if what == "open")
            assert [name for _, name in opens] == ["one", "two"] * 2 + ["one"]
            gaps = [later - earlier for (earlier, _), (later, _) in pairwise(opens)]
            assert all(5.3 - 1e-6 <= gap <= 5.4 for gap in gaps), gaps
            assert next(by for what, by, _ in one.log if what == "slice") == "two"

    run_virtual(main())


def test_the_utilization_of_each_rc_and_the_shares_before_and_after_a_re_planning_can_be_asked(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await here.clock.sleep_s(10.0 - here.clock.now_s())
            await behavior.ask_for(request("behavior", "left", "radio"))
            await here.clock.sleep_s(10.0)
            await console.ask_for(request("console", "left", "radio", priority=100))
            await here.clock.sleep_s(20.0)
            answer = await console.bus.ask(RC_MANAGER, AskUtilization(periods=True), Utilization, within_s=1)
            found = {one.rc: one for one in answer.rcs}
            assert found["left"].minute == pytest.approx(30 / 40, abs=0.01)
            assert found["radio"].ten_minutes == pytest.approx(30 / 40 * 0.04, abs=0.001)
            assert found["right"].minute == 0.0
            before, after = found["left"].periods[-2:]
            assert (before.because, before.shares) == ("behavior asks", {"behavior": pytest.approx(1.0, abs=0.01)})
            assert (after.because, after.shares["console"]) == ("console asks", pytest.approx(1.0, abs=0.01))
            briefly = await console.bus.ask(RC_MANAGER, AskUtilization(), Utilization, within_s=1)
            assert all(one.periods == [] for one in briefly.rcs)

    run_virtual(main())


def test_a_console_of_higher_priority_overrides_at_once_and_the_behavior_comes_back(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await behavior.ask_for(request("behavior", "left", "radio"))
            await here.clock.sleep_s(1.0)
            asked_s = here.clock.now_s()
            await console.ask_for(request("console", "left", "radio", priority=100))
            await here.clock.sleep_s(0.05)
            assert console.is_open
            assert not behavior.is_open
            assert console.granted_s - asked_s < 0.05
            assert behavior.log[-1][:2] == ("higher", "console")
            await console.bus.ask(RC_MANAGER, Withdraw("console", "self"), Done, within_s=1)
            await here.clock.sleep_s(0.05)
            assert behavior.is_open

    run_virtual(main())


def test_the_story_of_a_resource_and_of_a_behavior_begins_with_words_for_people(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()) as manager:
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            told = {name: [event.what for event in manager.story.of(name)] for name in ("left", "radio", "local")}
            assert "rc: its ARCs hold it in turn" in told["left"]
            assert "rc: its ARCs share 100% of its time" in told["radio"]
            assert "node: its priority among its siblings is 10" in told["local"]

    run_virtual(main())


def test_impossible_requests_are_refused_with_their_numbers(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            with pytest.raises(UnknownRc):
                await one.ask_for(request("one", "nothing"))
            greedy = msgspec.structs.replace(
                request("one", "left"), alternatives=[{"radio": RcUse([Usage(0.01, 0.02)])}]
            )
            with pytest.raises(CapacityExceeded) as refused:
                await one.ask_for(greedy)
            assert refused.value.facts["demanded"] == pytest.approx(2.0)
            found = await one.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
            assert found.requests == []

    run_virtual(main())


def test_why_names_the_blocker_and_a_changed_priority_plans_anew(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio", minimum_runtime_s=60.0))
            await two.ask_for(request("two", "left", "radio"))
            await here.clock.sleep_s(1.0)
            why = await two.bus.ask(RC_MANAGER, AskWhy("two"), Why, within_s=1)
            assert (why.state, why.blockers) == ("waiting", ["one"])
            await two.bus.ask(RC_MANAGER, SetPriority("owner-two", 5), Done, within_s=1)
            await here.clock.sleep_s(0.1)
            assert two.is_open

    run_virtual(main())


@pytest.mark.parametrize(("arcs", "most"), [(2, 160), (40, 40)])
def test_the_more_arcs_there_are_the_longer_a_schedule_for_people_waits(pool: Any, arcs: int, most: int) -> None:
    async def main() -> tuple[list[Schedule], Schedule]:
        async with pool() as here, here.beside(here.manager()):
            heard: list[Schedule] = []
            for number in range(arcs):
                arc = await here.arc(f"arc{number}")
                await arc.ask_for(request(arc.name, "left"))
            await here.clock.sleep_s(1.0)
            ear = here.network.join("ui_console/ear", here.clock)
            ear.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, lambda heard_of: heard.append(heard_of.body))
            for change in range(160):
                await ear.ask(RC_MANAGER, SetPriority("owner-arc0", change % 7 + 1), Done, within_s=1)
                await here.clock.sleep_s(0.02)
            await here.clock.sleep_s(0.5)
            newest = await ear.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
            await ear.close()
            return heard, newest

    heard, newest = run_virtual(main())
    assert most / 2 <= len(heard) <= most + 5
    assert [one.priority for one in heard[-1].requests] == [one.priority for one in newest.requests]


def test_every_decision_is_in_the_trace(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here:
            async with here.beside(here.manager()):
                one = await here.arc("one")
                await one.ask_for(request("one", "left", "radio"))
                await here.clock.sleep_s(1.0)
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    assert [line["ev"] for line in lines if line.get("arc") == "one"] == ["request", "connect", "grant"]
    assert lines[0]["ev"] == "meta"
    assert {line["id"] for line in lines if line["ev"] == "rc"} == {resource.name for resource in HARDWARE}
    assert lines[-1]["ev"] == "end"


@pytest.mark.parametrize("trace", ["/dev/full", "/dev/null/trace.jsonl"])
def test_a_trace_that_cannot_be_written_is_told_and_grants_go_on(local_mission: Any, beside: Any, trace: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, Path(trace)) as here, here.beside(here.manager()) as manager:
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            assert "1 of 1 ARCs run; the trace of the schedule stopped: " in manager.feedback
            told = [event.what for event in manager.story.of("rc_manager")]
            assert sum("the trace of the schedule stopped" in what for what in told) == 1

    run_virtual(main())


def test_a_schedule_that_nobody_hears_is_not_worked_out_and_a_new_listener_soon_has_one(
    pool: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    worked_out_s: list[float] = []
    schedule = Answers.schedule

    def counted(answers: Answers, now_s: float) -> Schedule:
        worked_out_s.append(now_s)
        return schedule(answers, now_s)

    monkeypatch.setattr(Answers, "schedule", counted)

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()) as manager:
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(5.0)
            assert worked_out_s == []
            assert manager.feedback == "1 of 1 ARCs run"
            heard: list[Schedule] = []
            listener = here.network.join("ui_console/listener", here.clock)
            listener.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, lambda said: heard.append(said.body))
            await here.clock.sleep_s(RENEW_EVERY_S + 0.1)
            assert [view.arc for view in heard[0].requests] == ["one"]

    run_virtual(main())


def test_two_arcs_of_a_radio_connect_in_the_order_of_their_epochs_even_if_one_is_being_asked(pool: Any) -> None:
    """It beat before its request came, so the RC manager is asking it for its request."""

    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            late, other = await here.arc("late"), await here.arc("other")
            await here.clock.sleep_s(0.5)
            late.hangs = True
            await here.clock.sleep_s(0.3)
            late.hangs = False
            await asyncio.gather(
                late.ask_for(request("late", "left", "radio")), other.ask_for(request("other", "right", "radio"))
            )
            await here.clock.sleep_s(0.5)
            assert (late.is_open, other.is_open) == (True, True)
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    assert not [line for line in lines if line["ev"] in ("rc_state", "revoke")]


def test_a_restarted_rc_manager_frees_the_other_rcs_of_arcs_whose_radio_does_not_obey(pool: Any) -> None:
    """The radio keeps the hold of a dead ARC, so nobody can hold it rightly, and it counts as down."""

    async def main() -> Path:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "radio"))
                await here.clock.sleep_s(1.0)
                assert one.is_open
            radio = here.rcs["radio"]
            radio.holders["ghost"], radio.does_not_obey = radio.last_epoch, True
            async with here.beside(here.manager()):
                await two.ask_for(request("two", "left"))
                await here.clock.sleep_s(0.5)
                assert (one.is_open, two.is_open) == (False, True)
                radio.does_not_obey = False
                state = RcState(radio.name, radio.launch.type, True, 1.0, [], radio.last_epoch, 0, 0)
                radio.bus.publish(radio.address, Conversation.TELEMETRY, state)  # as an RC does that is missing
                await here.clock.sleep_s(7.0)
                assert one.is_open
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    assert not [line for line in lines if line.get("id") == "left" and line.get("state") == "down"]
