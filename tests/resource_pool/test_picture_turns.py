"""Which pictures of a camera have their turn."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from resource_pool.drivers.picture_turns import EARLY_S, PictureTurns

RATE_HZ = 15.0
ANY_TIME = st.floats(-1e9, 1e9)


def test_pictures_at_twice_the_rate_have_every_second_turn() -> None:
    turns = PictureTurns()

    assert [turns.take(frame / (2 * RATE_HZ), RATE_HZ) for frame in range(6)] == [True, False] * 3


@given(st.lists(ANY_TIME, max_size=20))
def test_pictures_come_at_their_rate_again_after_any_times(before: list[float]) -> None:
    turns = PictureTurns()
    for at_s in before:
        turns.take(at_s, RATE_HZ)

    begins_s = min(before, default=0.0) - 1.0
    taken = [at_s for frame in range(60) if turns.take(at_s := begins_s + frame / 30, RATE_HZ)]

    assert taken[0] == begins_s
    assert len(taken) in (30, 31), "for 2 s of 30 pictures a second"


@given(st.lists(st.floats(0, 10), min_size=2, max_size=40).map(sorted))
def test_while_times_do_not_decrease_two_pictures_are_a_pause_apart_on_average(times: list[float]) -> None:
    turns = PictureTurns()
    taken = [at_s for at_s in times if turns.take(at_s, RATE_HZ)]

    assert len(taken) <= 1 + (times[-1] - times[0] + EARLY_S) * RATE_HZ
