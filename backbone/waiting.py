"""Waits for events and tasks, the end of tasks, and results of futures."""

from __future__ import annotations

import asyncio
import contextvars
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any, TypeVar

from backbone.errors import complaint

T = TypeVar("T")
PASSING = (asyncio.CancelledError, KeyboardInterrupt, GeneratorExit)
"""What a caller raises into a coroutine, so no bug; a ``CancelledError`` only if a caller cancelled."""


async def set_within(event: asyncio.Event, within_s: float | None) -> bool:
    """Return True once the event is set, False if it is not within this machine time; None: however long it takes."""
    if within_s is None:
        return await event.wait()
    try:
        async with asyncio.timeout(within_s):
            return await event.wait()
    except TimeoutError:
        return False


async def first_of(*waits: Awaitable[Any]) -> set[asyncio.Task[Any]]:
    """Wait until one of these has ended, and return those that have; the others are cancelled."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    try:
        done, _others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        await end_tasks(*tasks)
    return done


async def first_to_end(*waits: Awaitable[Any]) -> None:
    """Return when one of these has ended, or raise its exception; the others are cancelled."""
    for task in await first_of(*waits):
        task.result()


async def end_tasks(*tasks: asyncio.Future[Any]) -> None:
    """Cancel the tasks and return when all have ended; their exceptions are ignored."""
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def bug_of(task: asyncio.Task[Any]) -> BaseException | None:
    """Return the bug that ended a task; a ``CancelledError`` is a bug if no caller cancelled the task."""
    if not task.cancelled():
        return task.exception()
    return (
        None
        if task.cancelling()
        else RuntimeError(f"{task.get_name()} raised CancelledError, and no caller cancelled it")
    )


def is_cancelled() -> bool:
    """Return whether a caller has cancelled the present task; otherwise a ``CancelledError`` in it is a bug."""
    task = asyncio.current_task()
    return task is None or task.cancelling() > 0


async def only_bugs(work: Awaitable[T], name: str = "") -> T:
    """Return the result of the work; raise its exceptions as an ``Exception``, except those in ``PASSING``.

    No caller handles the others: a ``SystemExit`` would end the event loop, for all components of the process, and an
    exception of a library in another language would end the component without a drain.

    Args:
        work: The work of a class that is not ours.
        name: Its name for people; empty: the name of the task.
    """
    try:
        return await work
    except asyncio.CancelledError as cut:
        task = asyncio.current_task()
        if task is None or is_cancelled():
            raise
        raise RuntimeError(f"{name or task.get_name()} raised {complaint(cut)}, and no caller cancelled it") from cut
    except PASSING:
        raise
    except BaseException as error:
        raise as_bug(error) from error


def as_bug(error: object) -> Exception:
    """Return the exception, which a caller of ``Exception`` can handle; anything else becomes the text of one.

    Example:
        >>> as_bug(KeyError("no")), as_bug(SystemExit(3)), as_bug("no cable")
        (KeyError('no'), RuntimeError('SystemExit: 3'), RuntimeError("'no cable' in place of an exception"))
    """
    if isinstance(error, BaseException):
        return error if isinstance(error, Exception) else RuntimeError(complaint(error))
    return RuntimeError(f"{error!r} in place of an exception")


def settle(future: asyncio.Future[Any], outcome: object) -> None:
    """Set the result or the exception of the future, unless it is done: its waiter may have been cancelled."""
    if future.done():
        return
    if isinstance(outcome, BaseException):
        future.set_exception(outcome)
    else:
        future.set_result(outcome)


class _OwnThread(Executor):
    """Runs each function in a thread of its own, for which the end of the process does not wait."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **named: Any) -> Future[T]:
        outcome: Future[T] = Future()
        outcome.set_running_or_notify_cancel()

        def run() -> None:
            try:
                outcome.set_result(fn(*args, **named))
            except BaseException as error:
                outcome.set_exception(error)

        threading.Thread(target=run, daemon=True).start()
        return outcome


async def in_thread_within(work: Callable[[], T], within_s: float | None) -> T:
    """Do the work in a thread of its own, while the event loop continues; return its result.

    Work that hangs delays neither its caller nor the end of the process, because nothing waits for its thread.

    Raises:
        TimeoutError: The work takes longer than ``within_s`` seconds of the machine. None: it has no time limit.
    """
    done = partial(contextvars.copy_context().run, work)
    async with asyncio.timeout(within_s):
        return await asyncio.get_running_loop().run_in_executor(_OwnThread(), done)
