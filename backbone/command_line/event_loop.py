"""Event loop: runs a command's coroutine to its end, or to Ctrl-C."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager

import uvloop

from backbone.errors import BackboneError
from backbone.launcher.endings import complaint_of, say
from backbone.operating_system.ending_signals import orders_to_end


def exit_code_of(work: Callable[[], Awaitable[int]]) -> int:
    """Return the exit code of a command's coroutine; a refusal becomes one line and its own code."""

    async def guarded() -> int:
        return await work()

    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # asyncio replaces no other, see ``entry``
    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            return runner.run(guarded())
    except BackboneError as error:
        line, code = complaint_of(error)
        say(line)
        return int(code)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C, SIGTERM and a closed terminal end the block at once and in good order, although it awaits nothing.

    By default Ctrl-C only cancels the coroutine, and the coroutine notices that only when it awaits, after its work.
    The other signals end the process at once, and may leave half a file.
    """
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *orders_to_end())}
    heeded = [number for number, handler in before.items() if handler is not signal.SIG_IGN]  # as a shell's background
    for number in heeded:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, before[number])
