"""Waits for events and tasks, the end of tasks, and results of futures."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Any


async def set_within(event: asyncio.Event, within_s: float | None) -> bool:
    """Return True once the event is set, False if it is not within this machine time; None: however long it takes."""
    if within_s is None:
        return await event.wait()
    try:
        async with asyncio.timeout(within_s):
            return await event.wait()
    except TimeoutError:
        return False


async def first_of(*waits: Awaitable[Any]) -> None:
    """Return when one of these is over; the others are ended."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        await end_tasks(*tasks)


async def first_to_end(*waits: Awaitable[Any]) -> None:
    """Return when one of these is over, or raise what it raised; the others are ended."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    try:
        done, _others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        await end_tasks(*tasks)
    for task in done:
        task.result()


async def end_tasks(*tasks: asyncio.Future[Any]) -> None:
    """Cancel the tasks and return when all have ended; what they raise is not looked at."""
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def settle(future: asyncio.Future[Any], outcome: object) -> None:
    """Set the result of the future, or the exception, unless it is done: who waited may have been cancelled."""
    if future.done():
        return
    if isinstance(outcome, BaseException):
        future.set_exception(outcome)
    else:
        future.set_result(outcome)
