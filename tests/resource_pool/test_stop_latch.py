"""Laws of stops, lifts and what commanders know of them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.arc_client import EmergencyStopped, Stopper, StopState
from resource_pool.stop_knowledge import StopKnowledge
from resource_pool.stop_latch import MOST_AUTHORS, StopLatch
from resource_pool.stop_messages import GivenBeforeStop, OtherStop


@given(st.lists(st.tuples(st.sampled_from(["stop", "lift"]), st.integers(0, 4)), max_size=30))
def test_a_robot_moves_only_if_its_last_stop_was_lifted_by_its_number(steps: list[tuple[str, int]]) -> None:
    latch, stopped, number = StopLatch("scout1"), False, 0
    for now_s, (step, given_number) in enumerate(steps):
        if step == "stop":
            assert latch.stop("anna", "why", float(now_s)) is not stopped
            number += 1
            stopped = True
        elif given_number != number:
            with pytest.raises(OtherStop):
                latch.lift(given_number, "user", float(now_s))
        else:
            assert latch.lift(given_number, "user", float(now_s)) is stopped
            stopped = False
        assert (latch.state.is_stopped, latch.state.number) == (stopped, number)
        if stopped:
            with pytest.raises(EmergencyStopped):
                latch.require_moving(number)
        else:
            latch.require_moving(number)
            with pytest.raises(GivenBeforeStop):
                latch.require_moving(number + 1 if number == 0 else number - 1)


def test_all_who_stop_a_robot_are_named_once_until_it_may_move_again() -> None:
    latch = StopLatch("scout1")
    latch.stop("anna", "", 1.0, "ui_console/a")
    for who in ("ben", "anna", "ben"):
        latch.stop(who, "", 2.0, f"ui_console/{who[0]}")
    assert (latch.state.by, latch.state.also) == ("anna", [Stopper("ben", "ui_console/b")])
    latch.lift(latch.state.number, "ben", 3.0)
    latch.stop("cleo", "", 4.0)
    assert (latch.state.by, latch.state.also) == ("cleo", [])


def test_an_operator_who_stops_a_robot_after_forty_others_is_an_author_too() -> None:
    latch = StopLatch("scout1")
    for number in range(41):
        assert latch.stop(f"operator{number}", "", 1.0, f"ui_console/console-{number}")
    assert latch.state.also[-1] == Stopper("operator40", "ui_console/console-40")


def test_a_person_who_stops_a_robot_by_ever_new_consoles_leaves_room_for_another_author() -> None:
    latch = StopLatch("scout1")
    for number in range(MOST_AUTHORS + 9):
        assert latch.stop("anna", "", 1.0, f"ui_console/console-{number}")
    assert latch.stop("ben", "", 2.0, "ui_console/b")
    assert len(latch.state.also) == MOST_AUTHORS
    assert latch.state.also[-2:] == [
        Stopper("anna", f"ui_console/console-{MOST_AUTHORS + 8}"),
        Stopper("ben", "ui_console/b"),
    ]


def test_an_rc_on_another_host_knows_every_author_of_the_stop_that_it_resumes() -> None:
    latch, elsewhere = StopLatch("scout1"), StopLatch("scout1")
    latch.stop("anna", "fire", 1.0, "ui_console/a")
    latch.stop("ben", "", 2.0, "ui_console/b")
    last = latch.last()
    assert last.standing is not None
    assert last.standing.by == "anna, ben"
    assert elsewhere.resume(last)
    assert elsewhere.state == latch.state


@given(st.lists(st.sampled_from(["stop", "lift", "move to a", "move to b", "move to c"]), max_size=30))
def test_on_whichever_host_its_rc_starts_a_robot_is_stopped_or_free_as_it_was(happens: list[str]) -> None:
    """Each host has a file of its own, which knows nothing of stops and lifts elsewhere."""
    one, moved = StopLatch("scout1"), StopLatch("scout1")
    files: dict[str, StopState] = {}
    host = "a"
    for happened in happens:
        if happened == "stop":
            assert one.stop("anna", "fire", 1.0) == moved.stop("anna", "fire", 1.0)
        elif happened == "lift":
            assert one.lift(one.state.number, "anna", 2.0) == moved.lift(moved.state.number, "anna", 2.0)
        else:
            files[host], last, host = moved.state, moved.last(), happened
            moved = StopLatch("scout1", files.get(host))
            moved.resume(last)
        assert moved.last() == one.last()


def test_a_lift_of_what_was_seen_before_somebody_else_stopped_too_lifts_nothing() -> None:
    """A press of stop is always confirmed, also for a stopped robot: only an operator who saw that can free it."""
    latch = StopLatch("scout1")
    latch.stop("anna", "", 1.0)
    seen = latch.state.number
    latch.stop("ben", "", 2.0)
    with pytest.raises(OtherStop):
        latch.lift(seen, "anna", 3.0)
    assert latch.state.is_stopped


@given(st.lists(st.tuples(st.integers(1, 5), st.booleans()), max_size=20))
def test_commands_carry_the_number_of_the_newest_stop_only_once_it_is_known_to_be_lifted(
    heard: list[tuple[int, bool]],
) -> None:
    known = StopKnowledge()
    for number, is_stopped in heard:
        known.heard(StopState("scout1", is_stopped, number, "anna", "", 0.0))
    newest = max((number for number, _ in heard), default=0)
    is_lifted = (newest, False) in heard or not heard
    assert (known.number("scout1") == newest) is is_lifted
    assert known.number("scout2") == 0


def test_a_lift_is_news_and_told_again_it_is_none() -> None:
    known, lifted = StopKnowledge(), StopState("scout1", False, 1, "anna", "", 2.0)
    stopped = StopState("scout1", True, 1, "anna", "", 1.0)
    told = [known.heard(one) for one in (stopped, stopped, lifted, lifted, stopped)]
    assert told == [True, False, True, False, False]


def test_the_first_to_stop_is_the_one_who_is_named() -> None:
    latch = StopLatch("scout1")
    latch.stop("anna", "child in the room", 1.0)
    latch.stop("ben", "me too", 2.0)
    assert (latch.state.by, latch.state.reason, latch.state.at_s) == ("anna", "child in the room", 1.0)
