"""Event loop: runs a command's coroutine to its end, or to Ctrl-C."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable

import uvloop

from backbone.errors import BackboneError
from backbone.launcher.endings import complaint_of, say


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
