"""Laws of the time of a recording: it passes while it is played, stays within the recording, and wakes who waits."""

from __future__ import annotations

import asyncio
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.recording.playback import FASTEST, SLOWEST, NoSuchTime, Playback

BEGIN_S, END_S = 10.0, 20.0
acts = st.lists(
    st.tuples(
        st.sampled_from(["play", "pause", "go_to", "wait"]),
        st.floats(SLOWEST, 20.0, allow_nan=False),
    ),
    max_size=20,
)


@given(acts=acts)
def test_time_passes_only_while_it_is_played_and_stays_within_the_recording(acts: list[tuple[str, float]]) -> None:
    async def scene() -> None:
        machine = VirtualClock()
        playback = Playback(machine, BEGIN_S, END_S)
        for act, number in acts:
            before_s = playback.now_s()
            match act:
                case "play":
                    playback.play(number)
                case "pause":
                    playback.pause()
                case "go_to":
                    was_playing = playback.is_playing
                    playback.go_to(number)
                    assert playback.now_s() == min(END_S, max(BEGIN_S, number))
                    assert playback.is_playing == (was_playing and playback.now_s() < END_S)
                case "wait":
                    speed = playback.rate if playback.is_playing else 0.0
                    await machine.sleep_s(number)
                    assert playback.now_s() == pytest.approx(min(END_S, before_s + number * speed))
            if act in {"play", "pause"}:
                assert playback.now_s() == before_s
            assert BEGIN_S <= playback.now_s() <= END_S

    run_virtual(scene())


@given(waits=st.lists(st.floats(BEGIN_S, END_S), min_size=1, max_size=8), pause_s=st.floats(0.0, 12.0))
def test_who_waits_wakes_in_order_and_never_early_also_over_a_pause(waits: list[float], pause_s: float) -> None:
    async def scene() -> list[float]:
        machine, woken = VirtualClock(), list[float]()
        playback = Playback(machine, BEGIN_S, END_S)

        async def wait(at_s: float) -> None:
            await playback.sleep_until_s(at_s)
            assert playback.now_s() >= at_s
            woken.append(at_s)

        async with asyncio.TaskGroup() as group:
            for at_s in waits:
                group.create_task(wait(at_s))
            playback.play(1.0)
            await machine.sleep_s(pause_s)
            playback.pause()
            await machine.sleep_s(5.0)
            playback.play(2.0)
        return woken

    assert run_virtual(scene()) == sorted(waits)


def test_to_go_ahead_wakes_who_waits_for_a_time_before():
    async def scene() -> None:
        playback = Playback(VirtualClock(), BEGIN_S, END_S)
        waiting = asyncio.create_task(playback.sleep_until_s(15.0))
        await asyncio.sleep(0.1)
        assert not waiting.done()
        playback.go_to(16.0)
        await waiting

    run_virtual(scene())


@pytest.mark.parametrize("speed", [0.0, -1.0, FASTEST * 2, math.nan, math.inf])
def test_a_speed_out_of_range_is_refused_and_changes_nothing(speed: float):
    async def scene() -> None:
        playback = Playback(VirtualClock(), BEGIN_S, END_S)
        playback.play(2.0)
        with pytest.raises(NoSuchTime):
            playback.play(speed)
        assert (playback.is_playing, playback.rate) == (True, 2.0)
        with pytest.raises(NoSuchTime):
            playback.go_to(math.nan)
        assert playback.now_s() == BEGIN_S

    run_virtual(scene())
