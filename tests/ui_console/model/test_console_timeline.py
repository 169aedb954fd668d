"""Who had which resource: turns follow from schedules, and those of one-holder resources never overlap."""

from __future__ import annotations

from itertools import pairwise

from console_scenes import SCHEDULE, rc, request
from hypothesis import given
from hypothesis import strategies as st

from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import Schedule
from ui_console.model.timeline import HISTORY_S, Certainty, SliceView, Timeline


def schedule(at_s: float, holder: tuple[str, int, float] | None, *, sharable: bool = False) -> Schedule:
    holders = [Holder(holder[0], holder[1], holder[2], at_s + 2.0)] if holder else []
    return Schedule(at_s, [rc("scout1", "scout", holders, sharable=sharable)], [], [])


def turns(timeline: Timeline, now_s: float) -> list[SliceView]:
    [row] = timeline.view(now_s, 1e6, 30.0).rows
    return row.slices


def test_past_turns_the_present_one_and_those_to_come_are_told_apart() -> None:
    timeline = Timeline()
    timeline.heard(schedule(3.0, ("early", 5, 1.0)))
    timeline.heard(SCHEDULE)
    view = timeline.view(9.0, 60.0, 30.0)
    row = next(row for row in view.rows if row.rc == "scout1")
    assert [(one.who, one.from_s, one.to_s, one.certainty) for one in row.slices] == [
        ("early", 1.0, 5.0, Certainty.PAST),
        ("watch1", 5.0, 10.0, Certainty.NOW),
        ("console-1", 12.0, 17.0, Certainty.NEXT),
    ]
    assert [one.is_console for one in row.slices] == [False, False, True]


@given(
    st.lists(
        st.tuples(st.floats(0.0, 3.0), st.one_of(st.none(), st.tuples(st.sampled_from("abc"), st.floats(-5.0, 1.0)))),
        min_size=1,
        max_size=40,
    )
)
def test_turns_of_a_resource_with_one_holder_never_overlap_and_none_that_was_seen_is_missing(
    steps: list[tuple[float, tuple[str, float] | None]],
) -> None:
    timeline, at_s, epoch, seen = Timeline(), 10.0, 0, set()
    for pause_s, holder in steps:
        at_s += pause_s
        if holder is not None:
            epoch += 1
            seen.add((holder[0], epoch))
        timeline.heard(schedule(at_s, (holder[0], epoch, at_s + holder[1]) if holder else None))
    shown = turns(timeline, at_s)
    assert {(one.arc, one.epoch) for one in shown} == seen
    assert all(one.from_s <= one.to_s for one in shown)
    assert all(one.to_s <= other.from_s for one, other in pairwise(shown))
    assert sum(one.certainty is Certainty.NOW for one in shown) == (steps[-1][1] is not None)


def test_a_schedule_older_than_the_last_changes_nothing() -> None:
    timeline = Timeline()
    timeline.heard(schedule(5.0, ("a", 1, 4.0)))
    timeline.heard(schedule(3.0, None))
    assert [one.certainty for one in turns(timeline, 5.0)] == [Certainty.NOW]


def test_what_is_long_past_is_forgotten() -> None:
    timeline = Timeline()
    timeline.heard(schedule(5.0, ("a", 1, 4.0)))
    timeline.heard(schedule(6.0, None))
    assert len(turns(timeline, 6.0)) == 1
    timeline.heard(schedule(7.0 + HISTORY_S, None))
    assert turns(timeline, 7.0 + HISTORY_S) == []


def test_a_turn_told_for_the_second_time_is_the_same_with_another_end() -> None:
    timeline = Timeline()
    running = request("a", "mission_control/x", RequestState.RUNNING, until_s=9.0)
    for until_s in (9.0, 14.0):
        one = rc("scout1", "scout", [Holder("a", 1, 4.0, 6.0)])
        timeline.heard(Schedule(5.0, [type(one)(*(getattr(one, f) for f in one.__struct_fields__[:8]), [until_s], [])],
                                [running], []))  # fmt: skip
    [turn] = turns(timeline, 6.0)
    assert (turn.from_s, turn.to_s, turn.who) == (4.0, 14.0, "x")
