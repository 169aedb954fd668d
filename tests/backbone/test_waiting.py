"""Waits for several at once: the first that is over decides, and nobody is left."""

from __future__ import annotations

import asyncio
import threading

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.waiting import first_to_end, in_thread_within


def test_the_first_to_end_decides_what_is_raised_and_the_others_are_ended():
    ended: list[str] = []

    async def wait(name: str, after_s: float, error: Exception | None = None) -> None:
        try:
            await VirtualClock().sleep_s(after_s)
            if error is not None:
                raise error
        finally:
            ended.append(name)

    async def scene() -> None:
        await first_to_end(wait("a", 1.0), wait("b", 2.0, ValueError("b")))
        assert ended == ["a", "b"]
        with pytest.raises(ValueError, match="c"):
            await first_to_end(wait("c", 1.0, ValueError("c")), wait("d", 2.0))
        assert sorted(ended) == ["a", "b", "c", "d"]
        assert len(asyncio.all_tasks()) == 1

    run_virtual(scene())


async def test_work_in_a_thread_is_awaited_no_longer_than_it_may_take() -> None:
    assert await in_thread_within(lambda: "done", 60.0) == "done"
    with pytest.raises(KeyError):
        await in_thread_within(lambda: {}["no"], 60.0)
    goes_on = threading.Event()
    with pytest.raises(TimeoutError):
        await in_thread_within(goes_on.wait, 0.05)
    goes_on.set()
