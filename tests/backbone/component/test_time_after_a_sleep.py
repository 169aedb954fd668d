"""A machine that slept shows the mission's time again once its link is back."""

from __future__ import annotations

import pytest

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import AskTime, MissionTime
from backbone.component.mission_time import INEXACT_S, was_started_again

BEFORE_S = 600.0
REAL_S = 0.5  # of the machine, between two readings of its clock on a busy processor


def shown_after(slept_s: float, rate: float) -> tuple[bool, float]:
    """Return whether the mission counts as a later one, and the clock's time after a sleep in the tenth minute."""

    async def scene() -> tuple[bool, float]:
        network, clock = LocalNetwork("night"), MissionClock.started_now(rate)
        clock.set_to(BEFORE_S)

        async def answer(_asked: object) -> MissionTime:
            return MissionTime(clock.now_s() + slept_s * rate, rate)

        LocalBus(network, NAMESERVER, VirtualClock()).serve(NAMESERVER, AskTime, answer)
        was_again = await was_started_again(LocalBus(network, "ui_console/c", VirtualClock()), clock)
        return was_again, clock.now_s()

    return run_virtual(scene())


@pytest.mark.parametrize("rate", [1.0, 4.0])
@pytest.mark.parametrize("slept_s", [2 * INEXACT_S, 3600.0])
def test_after_a_sleep_the_clock_shows_the_mission_s_time(slept_s: float, rate: float) -> None:
    was_again, shown_s = shown_after(slept_s, rate)
    assert not was_again
    assert shown_s == pytest.approx(BEFORE_S + slept_s * rate, abs=REAL_S * rate)


def test_a_clock_that_is_right_is_not_set_by_one_slow_answer() -> None:
    was_again, shown_s = shown_after(0.8 * INEXACT_S, 1.0)
    assert not was_again
    assert shown_s == pytest.approx(BEFORE_S, abs=REAL_S)


def test_the_time_of_a_later_mission_is_not_taken_over() -> None:
    was_again, shown_s = shown_after(-500.0, 1.0)
    assert was_again
    assert shown_s == pytest.approx(BEFORE_S, abs=REAL_S)
