"""The tasks of one component: they run beside its ``serve`` and end with it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine

from backbone.waiting import bug_of, only_bugs

log = logging.getLogger(__name__)

TASKS_END_WITHIN_S = 1.0  # chosen: below the time that creators give a component to end; machine seconds


class OwnTasks:
    """Starts tasks, reports their bugs, and ends them together.

    Args:
        failed: Called with the bug of a task, after all others are cancelled.
        goes_on: Called with the name of a task that goes on after its cancellation.
    """

    def __init__(self, failed: Callable[[BaseException], None], goes_on: Callable[[str], None]) -> None:
        self._failed, self._goes_on = failed, goes_on
        self._tasks: dict[asyncio.Task[None], None] = {}  # in the order of their starts
        self.are_taken = False
        """True: a new task runs; False: it is cancelled at once."""

    def start(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None]:
        """Run the coroutine as a task of this name, until the component ends."""
        task = asyncio.create_task(only_bugs(work), name=name)
        task.add_done_callback(lambda _ended: work.close())  # it may be cancelled before it begins
        if self.are_taken:
            self._tasks[task] = None
            task.add_done_callback(self._ended)
        else:
            task.cancel()
        return task

    async def end(self) -> None:
        """Cancel the tasks and wait for their ends; a task that goes on holds up neither the drain nor the end."""
        self._cancel()
        if not self._tasks:
            return
        _ended, left = await asyncio.wait(list(self._tasks), timeout=TASKS_END_WITHIN_S)
        for task in left:
            log.error("%s goes on %g s after its cancellation", task.get_name(), TASKS_END_WITHIN_S)
            self._goes_on(task.get_name())

    def _cancel(self) -> None:
        """Cancel each task once, because a second cancellation could interrupt its end, and take no new ones."""
        if self.are_taken:
            self.are_taken = False
            for task in self._tasks:
                task.cancel()

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.pop(task, None)
        if (bug := bug_of(task)) is not None:
            self._cancel()
            self._failed(bug)
