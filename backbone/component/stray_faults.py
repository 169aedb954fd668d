"""Stray faults: those of a component's code that reach neither its hooks nor its tasks, told in its story.

If a coroutine is never awaited, or a task or thread of its own fails, Python only writes a line to the log, and the
component continues.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from backbone.component.repeats import Repeats
from backbone.errors import complaint

_WARNINGS, _TASKS, _THREADS = "py.warnings", "asyncio", "threads"


class StrayFaults(logging.Handler):
    """Log handler that calls ``tell`` in the event loop, once for each new fault.

    Args:
        tell: Called in the loop with the fault as one line, and with the name of the task in which it occurred.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, tell: Callable[[str, str], None]) -> None:
        super().__init__(logging.WARNING)
        self._loop, self._tell, self._repeats = loop, tell, Repeats()

    def emit(self, record: logging.LogRecord) -> None:
        """Tell the fault, unless it repeats."""
        error = record.exc_info[1] if record.exc_info else None
        lines = record.getMessage().splitlines()
        line = " ".join(lines[:2]) if error is None else f"{lines[0]}: {complaint(error)}"
        if self._repeats.is_new((record.name, record.levelno), line, time.monotonic()) and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._tell, line, _present_task())


@contextmanager
def strays_told(tell: Callable[[str, str], None]) -> Iterator[None]:
    """Tell the stray faults of this process by this function until the block ends; see ``StrayFaults``."""
    told = StrayFaults(asyncio.get_running_loop(), tell)
    loggers, before = [logging.getLogger(name) for name in (_WARNINGS, _TASKS, _THREADS)], threading.excepthook
    levels = [one.level for one in loggers]
    for one in loggers:
        one.addHandler(told)
        one.setLevel(logging.WARNING)  # else the log's own level would keep warnings from the story
    logging.captureWarnings(True)
    threading.excepthook = _thread_failed
    try:
        yield
    finally:
        threading.excepthook = before
        logging.captureWarnings(False)
        for one, level in zip(loggers, levels, strict=True):
            one.removeHandler(told)
            one.setLevel(level)


def _thread_failed(failed: threading.ExceptHookArgs) -> None:
    if failed.exc_value is not None and not isinstance(failed.exc_value, SystemExit):
        name = "a thread" if failed.thread is None else failed.thread.name
        logging.getLogger(_THREADS).error("%s failed", name, exc_info=failed.exc_value)


def _present_task() -> str:
    try:
        task = asyncio.current_task()
    except RuntimeError:  # it occurred in a thread
        return ""
    return "" if task is None else task.get_name()
