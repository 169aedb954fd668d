"""Event loop: runs a command's coroutine to its end, or to Ctrl-C."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager

import uvloop

from backbone.errors import BackboneError
from backbone.launcher.endings import complaint_of, say


def exit_code_of(work: Callable[[], Awaitable[int]]) -> int:
    """Return the exit code of a command's coroutine; a refusal becomes one line and its own code."""

    async def guarded() -> int:
        return await work()

    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            return runner.run(guarded())
    except BackboneError as error:
        line, code = complaint_of(error)
        say(line)
        return int(code)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C end the block at once, although it awaits nothing.

    By default Ctrl-C only cancels the coroutine, which notices that when it awaits, and so after its work.
    """
    before = signal.getsignal(signal.SIGINT)
    if not callable(before):  # ignored, as in the background of a shell
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
