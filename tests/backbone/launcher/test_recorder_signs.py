"""A recorder that gives no signs of life is found out, and one that gives them again, too."""

from __future__ import annotations

import asyncio

from backbone.bus.clock import run_virtual
from backbone.launcher.recorder_signs import EACH_S, LATE_S, MOST_LATE, watch


def watched(pauses_s: list[float], sign: bytes = b"\n") -> list[tuple[bool, float]]:
    """Return what a watcher says, and when, of signs with these pauses before them."""
    found: list[tuple[bool, float]] = []

    async def play() -> None:
        loop, signs = asyncio.get_running_loop(), asyncio.StreamReader()
        watching = asyncio.create_task(watch(signs, lambda silent: found.append((silent, loop.time()))))
        for pause_s in pauses_s:
            await asyncio.sleep(pause_s)
            signs.feed_data(sign)
        signs.feed_eof()
        await watching

    run_virtual(play())
    return found


def test_one_that_gives_signs_in_time_is_never_silent() -> None:
    assert watched([EACH_S] * 50) == []


def test_a_progress_bar_without_an_end_of_line_is_a_sign_like_any_other() -> None:
    assert watched([EACH_S] * 5, b"\r" * 200_000) == []


def test_one_that_hangs_before_its_first_sign_is_told_too() -> None:
    assert watched([60.0, EACH_S]) == [(True, MOST_LATE * LATE_S), (False, 60.0)]


def test_one_late_sign_is_not_told() -> None:
    assert watched([EACH_S, MOST_LATE * LATE_S - 0.1, EACH_S, MOST_LATE * LATE_S - 0.1]) == []


def test_silence_is_told_once_within_seconds_and_so_is_its_end() -> None:
    assert watched([1.0, 60.0, EACH_S]) == [(True, 1.0 + MOST_LATE * LATE_S), (False, 61.0)]


def test_a_process_that_ends_is_not_silent() -> None:
    assert watched([1.0]) == []
