"""Clocks show the mission's time once the link is back, whichever machine slept."""

from __future__ import annotations

import pytest

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import AskTime, MissionTime
from backbone.component.mission_time import INEXACT_S, MissionStart, ask_time

BEFORE_S = 600.0
REAL_S = 0.5  # of the machine, between two readings of its clock on a busy processor
ORIGIN_S = 77.0  # of the first host, at mission time 0


def shown_after(ahead_s: float, rate: float, origins: tuple[float, float] = (0.0, 0.0)) -> tuple[bool, float]:
    """Return what a clock shows when the link is back in the tenth minute, and whether its mission counts as over.

    Args:
        ahead_s: By how much the mission is ahead of the clock.
        origins: What the nameserver says of its start, at the first link and at the second.
    """

    async def scene() -> tuple[bool, float]:
        network, clock, start = LocalNetwork("night"), MissionClock.started_now(rate), MissionStart()
        told = [MissionTime(0.0, rate, 0.0, origins[0])]

        async def answer(_asked: object) -> MissionTime:
            return told[-1]

        LocalBus(network, NAMESERVER, VirtualClock()).serve(NAMESERVER, AskTime, answer)
        bus = LocalBus(network, "ui_console/c", VirtualClock())
        start.follow(await ask_time(bus, clock), clock)
        clock.set_to(BEFORE_S)
        told.append(MissionTime(clock.now_s() + ahead_s, rate, 0.0, origins[1]))
        heard = await ask_time(bus, clock)
        is_over = start.is_over(heard)
        if not is_over:
            start.follow(heard, clock)
        return is_over, clock.now_s()

    return run_virtual(scene())


@pytest.mark.parametrize("rate", [1.0, 4.0])
@pytest.mark.parametrize("slept_s", [2 * INEXACT_S, 3600.0])
def test_after_a_sleep_the_clock_shows_the_mission_s_time(slept_s: float, rate: float) -> None:
    is_over, shown_s = shown_after(slept_s * rate, rate)
    assert not is_over
    assert shown_s == pytest.approx(BEFORE_S + slept_s * rate, abs=REAL_S * rate)


@pytest.mark.parametrize("rate", [1.0, 4.0])
def test_after_a_sleep_of_the_first_host_the_clock_shows_the_mission_s_time_too(rate: float) -> None:
    is_over, shown_s = shown_after(-500.0, rate, (ORIGIN_S, ORIGIN_S))
    assert not is_over
    assert shown_s == pytest.approx(BEFORE_S - 500.0, abs=REAL_S * rate)


def test_a_clock_that_is_right_is_not_set_by_one_slow_answer() -> None:
    is_over, shown_s = shown_after(0.8 * INEXACT_S, 1.0)
    assert not is_over
    assert shown_s == pytest.approx(BEFORE_S, abs=REAL_S)


@pytest.mark.parametrize(
    ("ahead_s", "origins"), [(-500.0, (0.0, 0.0)), (-500.0, (ORIGIN_S, 99.0)), (500.0, (ORIGIN_S, 99.0))]
)
def test_the_time_of_a_later_mission_is_not_taken_over(ahead_s: float, origins: tuple[float, float]) -> None:
    is_over, shown_s = shown_after(ahead_s, 1.0, origins)
    assert is_over
    assert shown_s == pytest.approx(BEFORE_S, abs=REAL_S)
