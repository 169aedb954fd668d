"""What tests over real processes share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from trace_checker import check, read_lines

Judged = Callable[..., None]
TOLERANCE_S = 0.5  # a machine that also runs other tests reacts late; order and exclusion are checked all the same


@pytest.fixture
def judged() -> Judged:
    """Return a check that a trace file has no violation, but for the names allowed."""

    def judge(trace: Path, allowed: frozenset[str] = frozenset()) -> None:
        found = check(read_lines(trace), TOLERANCE_S)
        assert [str(one) for one in found if one.code not in allowed] == []

    return judge
