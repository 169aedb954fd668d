"""The terminal's tests run in virtual time: Textual's timers and pauses take none, however busy the machine is."""

from __future__ import annotations

import asyncio

import pytest
from textual import _time, _wait

from backbone.bus.clock import VirtualLoop


def now_s() -> float:
    return asyncio.get_running_loop().time()


@pytest.fixture(autouse=True)
def _time_is_virtual(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have loops jump when nothing is left to do, and Textual read their time.

    Textual takes a screen for settled when the process has slept; on a loop that jumps, all that was due is done then.
    """
    monkeypatch.setattr(asyncio.events, "new_event_loop", VirtualLoop)
    monkeypatch.setattr(_time, "get_time", now_s)
    monkeypatch.setattr(_wait, "monotonic", now_s)
    monkeypatch.setattr(_wait, "process_time", lambda: 0.0)
