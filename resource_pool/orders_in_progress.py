"""Commands that an RC is carrying out: the end of their hold cuts them off, so that none follows the safe state."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import TypeVar

from backbone.rc_manager.messages import StaleEpoch
from resource_pool.holds import Hold

T = TypeVar("T")
CUT_WITHIN_S = 0.1  # chosen: of the time for the safe state, so that it is reached even if a command goes on


class OrdersInProgress:
    """The commands of all holds of one RC.

    Args:
        rc: Its name, for refusals.
    """

    def __init__(self, rc: str) -> None:
        self._rc = rc
        self._going: dict[asyncio.Task[object], Hold] = {}
        self._cut: set[asyncio.Task[object]] = set()
        self._deaf: set[asyncio.Task[object]] = set()

    async def run(self, hold: Hold, work: Awaitable[T]) -> T:
        """Return the result of the work.

        Raises:
            StaleEpoch: The hold ended first; the work was cancelled, even if it went on.
        """
        task = asyncio.current_task()
        assert task is not None  # noqa: S101  a coroutine runs in a task
        self._going[task] = hold
        lost = StaleEpoch(f"{hold.arc} lost {self._rc} before its command was carried out", epoch=hold.epoch)
        try:
            done = await work
        except asyncio.CancelledError:
            if task not in self._cut or task.uncancel():  # another caller cancelled the task, too
                raise
            raise lost from None
        else:
            if task not in self._cut:
                return done
            task.uncancel()
            raise lost
        finally:
            del self._going[task]
            self._cut.discard(task)

    async def cut_off(self, hold: Hold) -> bool:
        """Cancel the commands of this hold; return whether all have ended within ``CUT_WITHIN_S``."""
        going = {
            task
            for task, under in self._going.items()
            if (under.arc, under.epoch) == (hold.arc, hold.epoch) and task is not asyncio.current_task()
        }
        for task in going - self._cut:
            task.cancel()
        self._cut |= going
        if going:
            await asyncio.wait(going, timeout=CUT_WITHIN_S)
        self._deaf |= going & self._going.keys()
        return not going & self._going.keys()

    def went_on(self) -> bool:
        """Return whether the command of the present task has ended, but later than ``cut_off`` waited."""
        task = asyncio.current_task()
        is_deaf = task in self._deaf
        self._deaf -= {task}
        return is_deaf
