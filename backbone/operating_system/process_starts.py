"""Start time of a process, which identifies one life of its pid, because pids are reused. Imports almost nothing."""

from __future__ import annotations

import os
from pathlib import Path

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_STATE, _START = 0, 19  # fields behind the name in parentheses, proc(5)


def started_s(pid: int) -> float | None:
    """Return when this process began, seconds since the machine's start; None: it has ended, or waits to be reaped."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if fields[_STATE] in "ZX" else int(fields[_START]) / _TICKS_PER_S
