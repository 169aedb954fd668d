"""Garbage collection leaves alone what the collection of tests has made.

Thousands of tests and all their modules are half a million objects, and live to the end of the run: a full garbage
collection visits each in vain. None runs while they are made, and afterwards they are frozen.
"""

from __future__ import annotations

import gc
from collections.abc import Generator

import pytest


class Frozen:
    """Freezes what is there once the tests are collected."""

    @pytest.hookimpl(wrapper=True)
    def pytest_collection(self) -> Generator[None, object, object]:
        """Collect the tests without garbage collection."""
        gc.disable()
        try:
            return (yield)
        finally:
            gc.collect()
            gc.freeze()
            gc.enable()
