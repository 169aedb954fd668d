"""The rehearsal plays everybody around a schedule manager; the timetable reads what came of it."""

from __future__ import annotations

from random import Random

import pytest
from random_missions import random_mission
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.scheduling.events import ConnectArc, Departed, Event, Idled, Instruction, RcKnown, RevokeArc, Wanted
from backbone.scheduling.rehearsal import Rehearsal, Timetable


def rehearse(*events: Event, until_s: float = 60.0, grace_s: float = 0.0, pause_s: float = 0.0) -> Timetable:
    deciding = manager(grace_s=grace_s)
    rehearsal = Rehearsal(
        deciding, opening_lines=deciding.opening_lines(), pause_s=lambda deadline_s: min(pause_s, deadline_s)
    )
    for event in events:
        rehearsal.tell(event)
    rehearsal.run(until_s)
    return Timetable(rehearsal.trace, rehearsal.now_s)


def test_two_scouts_on_one_frequency_take_turns() -> None:
    """RAM 2002: two Scouts, one video frequency, 5 s each."""
    seen = rehearse(unit("video"), ask("left", "video"), ask("right", "video"))
    assert [run.arc for run in seen.runs] == ["left", "right"] * 6 + ["left"]
    assert [run.granted_s for run in seen.runs[:-1]] == [5.0] * 12
    assert seen.utilization() == {"video": 1.0}
    assert seen.mean_parallel() == 1.0


def test_settling_release_and_pause_are_lost_time() -> None:
    seen = rehearse(
        unit("video", connect_s=0.3, disconnect_s=0.2),
        ask("left", "video"),
        ask("right", "video"),
        until_s=11.4,
        grace_s=0.5,
        pause_s=0.4,
    )
    left, right = seen.runs
    assert (left.connect_s, left.grant_s, left.revoke_s) == pytest.approx((0.0, 0.3, 5.3))
    assert left.free_s == pytest.approx(5.9)
    assert (right.connect_s, right.grant_s) == pytest.approx((5.9, 6.2))
    assert (left.why, left.by) == ("slice", "right")
    assert seen.utilization()["video"] == pytest.approx((5.0 + 5.0) / 11.4)


def test_a_shared_radio_is_used_by_streams() -> None:
    seen = rehearse(sharable("radio"), ask("a", {"radio": load(0.25)}), ask("b", {"radio": load(0.5)}), until_s=10.0)
    assert seen.utilization() == {"radio": pytest.approx(0.75)}
    assert seen.mean_parallel() == 2.0


def test_an_rc_that_nobody_uses_has_a_utilization_of_zero() -> None:
    assert rehearse(unit("idle"), unit("busy"), ask("a", "busy")).utilization() == {"idle": 0.0, "busy": 1.0}


def test_the_worst_wait_counts_a_wait_that_goes_on() -> None:
    seen = rehearse(unit("video"), ask("high", "video", priority=2), ask("low", "video", priority=1), until_s=20.0)
    assert seen.worst_wait_s("low") == 20.0
    assert seen.worst_wait_s("high") == 0.0


def test_who_wants_no_time_does_not_wait() -> None:
    deciding = manager()
    rehearsal = Rehearsal(deciding)
    for event in (unit("video"), ask("left", "video"), ask("right", "video", idle=True)):
        rehearsal.tell(event)
    rehearsal.at(7.0, Wanted("right"))
    rehearsal.at(9.0, Idled("right"))
    rehearsal.at(11.0, Departed("left"))
    rehearsal.run(12.0)
    seen = Timetable(rehearsal.trace, rehearsal.now_s)
    assert seen.worst_wait_s("right") == 0.0
    assert [(run.arc, run.grant_s, run.revoke_s) for run in seen.runs] == [
        ("left", 0.0, 7.0),
        ("right", 7.0, 9.0),
        ("left", 9.0, 11.0),
    ]
    assert not rehearsal.connected


def test_a_connection_that_was_broken_off_never_opens() -> None:
    deciding = manager()
    rehearsal = Rehearsal(deciding)
    for event in (unit("video", connect_s=2.0), ask("low", "video", priority=1)):
        rehearsal.tell(event)
    rehearsal.at(1.0, ask("high", "video", priority=2))
    rehearsal.run(4.0)
    seen = Timetable(rehearsal.trace, rehearsal.now_s)
    assert [(run.arc, run.grant_s) for run in seen.runs] == [("low", None), ("high", 3.0)]
    assert seen.runs[0].granted_s == 0.0


class NeverAtRest:
    """Revokes the ARC that it has just connected, again and again."""

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        return [ConnectArc("a", {}, 0.0, now_s, {}), RevokeArc("a", {}, "slice", "b", 0.0, -1.0)]


def test_a_schedule_that_never_leaves_an_instant_ends_the_rehearsal() -> None:
    rehearsal = Rehearsal(NeverAtRest())
    rehearsal.at(3.0, Wanted("a"))
    with pytest.raises(AssertionError, match=r"a is connected 1000 times at 3\.0"):
        rehearsal.run(60.0)


@pytest.mark.parametrize("seed", range(40))
def test_a_rehearsal_tells_what_the_test_bench_tells(seed: int) -> None:
    """Both play the same parts; without faults and pauses the traces are the same line by line."""
    bench, happens = random_mission(Random(seed), faults=False)
    rcs: tuple[RcKnown, ...] = bench.rcs
    deciding, other = manager(), manager()
    played, rehearsal = Bench(other, *rcs), Rehearsal(deciding, opening_lines=deciding.opening_lines())
    for rc in rcs:
        rehearsal.tell(rc)
    for time_s, event in happens:
        played.at(time_s, event)
        rehearsal.at(time_s, event)
    played.run(60.0)
    rehearsal.run(60.0)
    assert [dict(line) for line in rehearsal.trace] == played.trace
