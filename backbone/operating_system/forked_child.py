"""Forked child: does one piece of work, so that the modules it imports take no memory of this process."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from contextlib import suppress

_PART_BYTES = 1 << 16  # chosen: the size of a pipe


class ForkedChild:
    """A child that does its work and answers once.

    Args:
        work: Returns the answer; it runs in a copy of this process, and may only read.

    Raises:
        OSError: The system refused a process.
    """

    def __init__(self, work: Callable[[], bytes]) -> None:
        self._pipe, inlet = os.pipe()
        try:
            self._pid = os.fork()
        except OSError:
            os.close(self._pipe)
            os.close(inlet)
            raise
        if self._pid == 0:
            _do(work, inlet)
        os.close(inlet)

    def answer(self) -> bytes | None:
        """Return the answer when the child has ended; None: its work raised an exception, or a signal ended it.

        If this is interrupted, the child is killed. Call it once.
        """
        parts = []
        try:
            while part := os.read(self._pipe, _PART_BYTES):
                parts.append(part)
        except BaseException:
            os.kill(self._pid, signal.SIGKILL)
            raise
        finally:
            os.close(self._pipe)
            _, status = os.waitpid(self._pid, 0)
        return b"".join(parts) if status == 0 else None


def _do(work: Callable[[], bytes], inlet: int) -> None:
    """End this process without a word: the caller learns of a failure by the exit code."""
    code = 1
    try:
        with suppress(BaseException):
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            answer = memoryview(work())
            while answer:
                answer = answer[os.write(inlet, answer) :]
            code = 0
    finally:
        os._exit(code)  # not sys.exit: the child must not print the caller's buffered text
