"""What tests over real processes share."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
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


@pytest.fixture
def full_pipe() -> Iterator[int]:
    """Return the end for writing of a pipe that takes no more bytes."""
    reader, its_end = os.pipe()
    os.set_blocking(its_end, False)
    with suppress(BlockingIOError):
        while True:
            os.write(its_end, b" ")
    os.set_blocking(its_end, True)
    yield its_end
    os.close(its_end)
    os.close(reader)
