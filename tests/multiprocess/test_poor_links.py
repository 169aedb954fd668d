"""Poor links of the test's network are as poor as they say; the other components notice nothing of them."""

from __future__ import annotations

import contextlib
import json
import random
import time
from pathlib import Path

import pytest
from bus_roles import playing, said_by
from namespaces import hosts_on_a_switch
from poor_link import PoorDirection, Weather

LEASE_S = 2.0
BACK_WITHIN_S = 15.0
PICTURES_FOR_S = 15.0  # with batches of 64 KiB, the link was lost every 2 s to 3 s
POOR_FOR_S = 12.0  # three attempts to connect again, each of which the hub gives up after 2 s


def carried(weather: Weather, frames: int, *, each_s: float, size: int = 100) -> list[tuple[float, float]]:
    """Return when each frame that arrives was sent, and when it arrived."""
    direction, came, sent = PoorDirection(random.Random(1), weather), list[tuple[float, float]](), 0
    for tick in range(100_000):
        now_s = tick / 1000
        while sent < frames and sent * each_s <= now_s:
            direction.send(sent.to_bytes(2) + bytes(size - 2), now_s)
            sent += 1
        came += [(int.from_bytes(frame[:2]) * each_s, now_s) for frame in direction.arrived(now_s)]
        if sent == frames and direction.is_empty:
            break
    return came


@pytest.mark.parametrize("loss", [0.0, 0.05, 0.2, 0.5, 1.0])
def test_a_lossy_link_loses_its_share_and_keeps_the_order(loss: float) -> None:
    came = carried(Weather(loss=loss), 2000, each_s=0.001)
    assert len(came) == pytest.approx(2000 * (1 - loss), abs=100)
    assert came == sorted(came)


def test_a_slow_link_delays_each_frame() -> None:
    came = carried(Weather(delay_s=0.2), 100, each_s=0.01)
    assert all(arrived_s - sent_s == pytest.approx(0.2, abs=0.003) for sent_s, arrived_s in came)


def test_a_narrow_link_passes_its_bits_in_a_second_and_loses_what_would_wait_too_long() -> None:
    came = carried(Weather(rate_bit_s=256e3, queue_s=0.5), 1000, each_s=0.001, size=1000)
    span_s = came[-1][1] - came[0][1]
    assert 8000 * len(came) / span_s == pytest.approx(256e3, rel=0.05)
    assert max(arrived_s - sent_s for sent_s, arrived_s in came) < 0.6
    assert len(came) < 100


def test_a_link_that_stalls_delivers_all_afterwards() -> None:
    came = carried(Weather(stall_each_s=10.0, stall_s=3.0), 1000, each_s=0.02)
    assert len(came) == 1000
    assert not any(0.01 < arrived_s % 10.0 < 2.99 for _, arrived_s in came)


@pytest.mark.processes
@pytest.mark.timeout(120)
@pytest.mark.thorough
@pytest.mark.parametrize("weather", [Weather(delay_s=1.0), Weather(loss=0.5)], ids=["slow", "lossy"])
def test_a_poor_link_stops_no_one_else_and_makes_no_one_deaf(tmp_path: Path, weather: Weather) -> None:
    with contextlib.ExitStack() as stack:
        hosts = stack.enter_context(hosts_on_a_switch(tmp_path, "base", "far", poor=["far"]))
        base, far, endpoint = hosts["base"], hosts["far"], f"tcp/{hosts['base'].address}:7447"
        for role, host in (("hub", base), ("crowd", far)):
            stack.enter_context(playing(role, host, endpoint))
        asker = stack.enter_context(playing("asker", base, endpoint))
        far.change_weather(weather)
        time.sleep(POOR_FOR_S)
        far.change_weather(Weather())
        print(BACK_WITHIN_S, file=asker.stdin, flush=True)
        meanwhile = json.loads(said_by(asker))
        assert meanwhile["unanswered"] == 0, meanwhile
        assert meanwhile["asked"] > 10 * (POOR_FOR_S - LEASE_S), meanwhile
        assert json.loads(said_by(asker)) == {"deaf": []}


@pytest.mark.processes
@pytest.mark.timeout(120)
@pytest.mark.thorough
def test_a_process_that_gets_more_pictures_than_its_link_passes_keeps_the_link(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        hosts = stack.enter_context(hosts_on_a_switch(tmp_path, "base", "far", poor=["far"]))
        base, far, endpoint = hosts["base"], hosts["far"], f"tcp/{hosts['base'].address}:7447"
        stack.enter_context(playing("hub", base, endpoint))
        watcher = stack.enter_context(playing("watcher", far, endpoint))
        far.change_weather(Weather(rate_bit_s=256e3))
        stack.enter_context(playing("cameras", base, endpoint))
        time.sleep(PICTURES_FOR_S)
        print(file=watcher.stdin, flush=True)
        count = json.loads(said_by(watcher))
        assert count["asked"] > 1, count
        assert count["unanswered"] == 0, count
        assert count.get("cut", 0) == 0, count
        assert count["pictures"] > 0, count
