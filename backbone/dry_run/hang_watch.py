"""Waits for work that may hang, as the endless loop of a planner of one's own does, while the work makes progress.

The work runs in a thread, because nothing else can leave a loop that returns to no caller. A thread that hangs is left
to itself; the end of the process does not wait for it.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from backbone.errors import BackboneError

T = TypeVar("T")


class Hangs(BackboneError):
    """The work made no progress for too long."""


class Progress:
    """Counts the steps of the work.

    Attributes:
        steps: Number of steps begun.
    """

    def __init__(self) -> None:
        self.steps = 0


def result_unless_it_hangs(work: Callable[[], T], progress: Progress, within_s: float) -> T:
    """Return the result of the work, or raise its exception.

    Args:
        work: Work that counts its steps in ``progress``.
        within_s: Longest time of one step, seconds of the machine.

    Raises:
        Hangs: A step took longer; the message names the line at which it is.
    """
    outcome: Future[T] = Future()

    def run() -> None:
        try:
            outcome.set_result(work())
        except BaseException as error:
            outcome.set_exception(error)

    thread = threading.Thread(target=run, name="dry run", daemon=True)
    thread.start()
    seen = -1
    while thread.is_alive() and seen != progress.steps:
        seen = progress.steps
        thread.join(within_s)
    if not outcome.done():
        frame = sys._current_frames().get(thread.ident or 0)  # noqa: SLF001  # its documented name
        place = "" if frame is None else f"; it is at {frame.f_code.co_filename}, line {frame.f_lineno}"
        raise Hangs(f"it does not return within {within_s:g} s{place}")
    return outcome.result()
