"""Signals that order a program of a terminal or a service manager to end, and blocks that they end at once."""

from __future__ import annotations

import signal
from collections.abc import Collection, Iterator
from contextlib import contextmanager


def orders_to_end() -> tuple[signal.Signals, ...]:
    """Return SIGTERM and SIGHUP, the signal of a closed terminal; a SIGHUP that ``nohup`` ignores stays ignored."""
    is_ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return (signal.SIGTERM,) if is_ignored else (signal.SIGTERM, signal.SIGHUP)


@contextmanager
def interruptible(numbers: Collection[signal.Signals] | None = None) -> Iterator[None]:
    """Let signals end the block at once and in good order, although it awaits nothing; in the main thread.

    By default Ctrl-C only cancels the coroutine, and the coroutine notices that only when it awaits, after its work.
    The other signals end the process at once, and may leave half a file.

    Args:
        numbers: The signals; None: Ctrl-C, SIGTERM and that of a closed terminal.
    """
    heard = (signal.SIGINT, *orders_to_end()) if numbers is None else numbers
    before = {number: signal.getsignal(number) for number in heard}
    heeded = [number for number, handler in before.items() if handler is not signal.SIG_IGN]  # as a shell's background
    for number in heeded:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, before[number])
