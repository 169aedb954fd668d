"""A folder for boards, and how many descriptors this process has."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        yield Path(name) / "board"


@pytest.fixture
def descriptors() -> Callable[[], int]:
    def count() -> int:
        gc.collect()
        return len(os.listdir("/proc/self/fd"))

    return count
