"""Laws of the dead man: no key, no command; every drive ends in a halt. No wheel exceeds its share of the speed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.messages import COMMAND_TIMEOUT_S
from resource_pool.rcs.scout import MOST_M_S, MOST_TURN_RAD_S
from scout_model.dimensions import WHEEL_SPEED_LIMIT_RAD_S
from scout_model.scout import wheels_rad_s
from ui_console.model.arc_abilities import Reach
from ui_console.model.driving import (
    COMMAND_LASTS_S,
    FIRST_HOLD_S,
    REPEAT_EVERY_S,
    SPEED,
    SPEED_LEAST,
    SPEED_MOST,
    DeadMan,
    DriveSpan,
    GiveWish,
    HaltWish,
    MoveWish,
    faster,
    move_by_stick,
)

FORWARD = MoveWish(0.1, 0.0)
REACH = Reach(MOST_M_S, MOST_TURN_RAD_S)
TICK_S = 0.01


def commands(presses_s: list[float], until_s: float, stops_s: tuple[float, ...] = ()) -> list[tuple[float, object]]:
    hand, sent = DeadMan(), []
    pending, stops = sorted(presses_s), sorted(stops_s)
    for tick in range(int(until_s / TICK_S)):
        now_s = tick * TICK_S
        while pending and pending[0] <= now_s:
            hand.press(FORWARD, now_s)
            pending.pop(0)
        while stops and stops[0] <= now_s:
            hand.stop()
            stops.pop(0)
        if (command := hand.due(now_s)) is not None:
            sent.append((now_s, command))
    return sent


def test_without_a_key_nothing_is_sent() -> None:
    assert commands([], 5.0) == []


def test_one_press_drives_half_a_second_at_ten_hertz_then_halts() -> None:
    sent = commands([1.0], 5.0)
    assert [command for _at_s, command in sent] == [FORWARD] * 5 + [HaltWish()]
    assert sent[0][0] == 1.0
    assert abs(sent[-1][0] - (1.0 + FIRST_HOLD_S)) < 2 * TICK_S


def test_a_held_key_drives_without_a_gap_and_stops_soon_after_it_is_let_go() -> None:
    repeats = [1.0] + [1.5 - TICK_S + 0.04 * n for n in range(50)]
    sent = commands(repeats, 6.0)
    assert [command for _at_s, command in sent].count(HaltWish()) == 1
    assert sent[-1][0] - repeats[-1] < 0.2


def test_the_stop_key_halts_at_once_and_also_when_nothing_is_held() -> None:
    assert commands([1.0], 3.0, stops_s=(1.2,))[-1] == (1.2, HaltWish())
    assert commands([], 3.0, stops_s=(1.0,)) == [(1.0, HaltWish())]


def test_another_direction_takes_over_at_once() -> None:
    hand = DeadMan()
    hand.press(FORWARD, 0.0)
    assert hand.due(0.0) == FORWARD
    left = MoveWish(0.0, 1.0)
    hand.press(left, 0.02)
    assert hand.due(0.02) == left


@given(st.lists(st.floats(0.0, 8.0), max_size=40), st.lists(st.floats(0.0, 8.0), max_size=3))
def test_a_drive_is_only_sent_within_the_hold_of_a_press_and_always_followed_by_a_halt(
    presses: list[float], stops: list[float]
) -> None:
    sent = commands(presses, 10.0, tuple(stops))
    for at_s, command in sent:
        if isinstance(command, MoveWish):
            assert any(press - TICK_S <= at_s <= press + FIRST_HOLD_S + 2 * TICK_S for press in presses)
    if any(isinstance(command, MoveWish) for _at_s, command in sent):
        assert sent[-1][1] == HaltWish()


@given(st.lists(st.floats(0.0, 8.0), max_size=40))
def test_what_will_be_due_is_due_when_it_was_said_to_be(presses: list[float]) -> None:
    hand = DeadMan()
    for press in sorted(presses):
        hand.press(FORWARD, press)
        hand.due(press)
        next_s = hand.next_s
        assert next_s is not None
        assert press < next_s <= press + REPEAT_EVERY_S + 1e-9


def test_pressed_again_right_after_a_stop_it_drives_and_waits_for_the_next_repeat() -> None:
    hand = DeadMan()
    hand.press(FORWARD, 1.0)
    assert hand.due(1.0) == FORWARD
    hand.stop()
    hand.press(FORWARD, 1.1)
    assert hand.due(1.1) == FORWARD
    assert hand.next_s is not None
    assert hand.next_s > 1.1
    assert hand.due(1.1 + FIRST_HOLD_S) == HaltWish()


@given(st.lists(st.sampled_from([FORWARD, HaltWish(), GiveWish("jump"), None])))
def test_the_begin_and_the_end_of_a_drive_take_turns(applied: list[MoveWish | HaltWish | GiveWish | None]) -> None:
    span, told = DriveSpan(), []
    for at_s, command in enumerate(applied):
        if command is not None and span.begins(command, at_s):
            assert isinstance(command, MoveWish)
            told.append("begin")
        if command is None or isinstance(command, HaltWish):
            took_s = span.ends(at_s)
            if took_s is not None:
                assert took_s >= 0
                told.append("end")
    assert told == (["begin", "end"] * len(told))[: len(told)]


@pytest.mark.parametrize(("heard_s", "took_s"), [(12.3, 2.3), (72.0, 2.5)])
def test_a_drive_whose_end_is_heard_late_ended_when_the_robot_halted_by_itself(heard_s: float, took_s: float) -> None:
    span = DriveSpan()
    for tick in range(21):
        span.begins(FORWARD, 10.0 + tick * REPEAT_EVERY_S)
    assert span.ends(heard_s) == pytest.approx(took_s)


def test_a_robot_halts_by_itself_when_the_drive_counts_as_over() -> None:
    assert COMMAND_LASTS_S == COMMAND_TIMEOUT_S


_shares = st.floats(0.05, 1.0)
_at = st.floats(-1.5, 1.5)


@given(_at, _at, _shares, st.builds(Reach, st.floats(0.0, 10.0), st.floats(0.0, 20.0)))
def test_the_shares_of_forward_speed_and_turn_rate_are_together_at_most_the_speed(
    forward: float, right: float, speed: float, reach: Reach
) -> None:
    move = move_by_stick(forward, right, speed, reach)
    shares = (abs(move.forward_m_s) / (reach.forward_m_s or 1.0), abs(move.turn_rad_s) / (reach.turn_rad_s or 1.0))
    assert sum(shares) <= speed + 1e-9
    mirrored = move_by_stick(forward, -right, speed, reach)
    assert (mirrored.forward_m_s, mirrored.turn_rad_s) == pytest.approx((move.forward_m_s, -move.turn_rad_s))


@given(_at, _at, _shares)
def test_no_wheel_of_a_scout_turns_faster_than_the_speed_and_a_full_stick_uses_all_of_it(
    forward: float, right: float, speed: float
) -> None:
    move = move_by_stick(forward, right, speed, REACH)
    wheels = [abs(one) for one in wheels_rad_s(move.forward_m_s, move.turn_rad_s)]
    assert max(wheels) <= speed * WHEEL_SPEED_LIMIT_RAD_S + 1e-9
    if abs(forward) >= 1.0:
        assert max(wheels) == pytest.approx(speed * WHEEL_SPEED_LIMIT_RAD_S)


@pytest.mark.parametrize(
    ("forward", "right", "wheels"),
    [(1, 0, (4, 4)), (-2, 0, (-4, -4)), (0, 1, (2, -2)), (0, 0, (0, 0)), (1, 1, (4, 4 / 3))],
)
def test_a_stick_turns_a_scout_on_the_spot_or_bends_its_way(
    forward: float, right: float, wheels: tuple[float, float]
) -> None:
    move = move_by_stick(forward, right, 4.0 / WHEEL_SPEED_LIMIT_RAD_S, REACH)
    assert wheels_rad_s(move.forward_m_s, move.turn_rad_s) == pytest.approx(wheels)


def test_the_usual_speed_of_a_scout_is_a_walk() -> None:
    assert pytest.approx(4.375) == SPEED * WHEEL_SPEED_LIMIT_RAD_S
    assert pytest.approx(0.0875) == SPEED * MOST_M_S


@given(st.lists(st.integers(-3, 3), max_size=30))
def test_the_speed_stays_within_its_bounds_and_on_its_steps(steps: list[int]) -> None:
    speed = SPEED
    for step in steps:
        speed = faster(speed, step)
        assert SPEED_LEAST <= speed <= SPEED_MOST
        assert 20 * speed == pytest.approx(round(20 * speed))
