"""Faults that reach no hook of a component are told with the line of its code."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest

from backbone.component.stray_faults import strays_told


async def work() -> None:
    """Nobody awaits it."""


async def failing() -> None:
    raise ValueError("no cup")


def fail() -> None:
    raise ValueError("no cup")


async def forgets() -> None:
    work()  # type: ignore[unused-coroutine]


async def leaves_a_task() -> None:
    task = asyncio.create_task(failing())
    await asyncio.wait({task})


async def leaves_a_thread() -> None:
    thread = threading.Thread(target=fail, name="sensor")
    thread.start()
    await asyncio.to_thread(thread.join)


def strays_of(own: Callable[[], Awaitable[None]]) -> list[tuple[str, str]]:
    told: list[tuple[str, str]] = []

    async def life() -> None:
        with strays_told(lambda line, task: told.append((line, task))):
            await asyncio.create_task(own(), name="mine:act")  # type: ignore[arg-type]
            await asyncio.to_thread(int)  # what was to be told in the loop is told

    asyncio.run(life())
    return told


def line_of(function: Callable[..., object], after: int = 1) -> int:
    return function.__code__.co_firstlineno + after


@pytest.mark.filterwarnings("always")
def test_a_coroutine_that_nobody_awaits_is_told_with_its_line_and_its_task() -> None:
    [(line, task)] = strays_of(forgets)
    assert f"{__file__}:{line_of(forgets)}: RuntimeWarning: coroutine 'work' was never awaited" in line
    assert task == "mine:act"


@pytest.mark.parametrize(
    ("own", "fault"),
    [
        (
            leaves_a_task,
            f"Task exception was never retrieved: ValueError: no cup ({__file__}, line {line_of(failing)})",
        ),
        (leaves_a_thread, f"sensor failed: ValueError: no cup ({__file__}, line {line_of(fail)})"),
    ],
    ids=["task", "thread"],
)
def test_a_task_or_thread_of_its_own_that_fails_is_told(own: Callable[[], Awaitable[None]], fault: str) -> None:
    assert [line for line, _task in strays_of(own)] == [fault]
