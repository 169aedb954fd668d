"""Signals that order a program of a terminal or a service manager to end in good order."""

from __future__ import annotations

import signal


def orders_to_end() -> tuple[signal.Signals, ...]:
    """Return SIGTERM and SIGHUP, the signal of a closed terminal; a SIGHUP that ``nohup`` ignores stays ignored."""
    is_ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return (signal.SIGTERM,) if is_ignored else (signal.SIGTERM, signal.SIGHUP)
