"""Garbage collection costs a run of the tests little.

* Thousands of tests and all their modules are half a million objects, and live to the end of the run: a full garbage
  collection visits each in vain. None runs while they are made, and afterwards they are frozen.
* A message at its limits and a screen with its styles are hundreds of thousands of objects that live for one test.
  With Python's own thresholds, full collections took a tenth of the quick run's processor time (measured).
"""

from __future__ import annotations

import gc
from collections.abc import Generator

import pytest

OBJECTS_AT_ONCE = 20_000  # chosen: as in the harness of experiments; some megabytes of garbage


class Frozen:
    """Freezes what is there once the tests are collected, and has garbage looked for less often from then on."""

    @pytest.hookimpl(wrapper=True)
    def pytest_collection(self) -> Generator[None, object, object]:
        """Collect the tests without garbage collection."""
        gc.disable()
        try:
            return (yield)
        finally:
            gc.collect()
            gc.freeze()
            gc.set_threshold(OBJECTS_AT_ONCE)
            gc.enable()
