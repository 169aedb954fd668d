"""Snapshots of a schedule: from the same events the copy decides as the original does."""

from __future__ import annotations

import pickle
from contextlib import suppress
from random import Random
from typing import Any

import msgspec
import pytest
from examples import share
from hypothesis import example, given, settings
from hypothesis import strategies as st
from random_missions import END_S, play, random_mission
from simulated_switches import Bench, ask, manager, unit

from backbone.scheduling.events import Event, Instruction
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.snapshot import FORM, NoSnapshot, read, written

RULES: list[dict[str, Any]] = [
    {},
    {"policy": "strict"},
    {"discipline": "time"},
    {"aging_s": 3.0},
    {"grid_s": 2.0},
    {"exact_up_to": 2},
    {"exact_up_to": 2, "discipline": "time"},
]


class Doubled:
    """A schedule manager, and from some event on a copy of it that must decide the same."""

    def __init__(self, first: ScheduleManager, at: int) -> None:
        self._first, self._left = first, at
        self._copy: ScheduleManager | None = None
        self.compared = 0

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        before = self._copied() if self._left == 0 else self._copy
        self._left -= 1
        decided = self._first.handle(event, now_s)
        if before is not None:
            assert before.handle(event, now_s) == decided
            assert before.wake_s == self._first.wake_s
            self.compared += 1
        return decided

    def _copied(self) -> ScheduleManager:
        self._copy = read(written(self._first))
        return self._copy

    def __getattr__(self, name: str) -> Any:
        return getattr(self._first, name)


@settings(max_examples=share(150))
@given(seed=st.integers(0, 2**32), rules=st.sampled_from(RULES), at=st.integers(0, 120))
@example(seed=713, rules={"exact_up_to": 2, "discipline": "time"}, at=11)  # one ARC came to want a shared RC alone
@example(seed=10, rules={"exact_up_to": 2}, at=20)
def test_a_copy_decides_as_the_original_does(seed: int, rules: dict[str, Any], at: int):
    bench, happens = random_mission(Random(seed), **rules)
    bench.manager = Doubled(bench.manager, at)
    play(bench, happens)


def test_the_comparison_takes_place():
    bench, happens = random_mission(Random(3))
    bench.manager = Doubled(bench.manager, 4)
    play(bench, happens)
    assert bench.manager.compared > 20


@pytest.mark.thorough
@settings(max_examples=share(60))
@given(seed=st.integers(0, 2**32), rules=st.sampled_from(RULES), until_s=st.floats(0.0, END_S))
def test_a_copy_gives_the_same_reasons(seed: int, rules: dict[str, Any], until_s: float):
    bench, happens = random_mission(Random(seed), **rules)
    play(bench, happens, until_s)
    copied = read(written(bench.manager))
    copied.check()
    now_s = bench.now_s
    assert Answers(copied).schedule(now_s) == Answers(bench.manager).schedule(now_s)
    for arc in bench.manager.master_schedule.state.arcs:
        assert Answers(copied).why(arc, now_s) == Answers(bench.manager).why(arc, now_s)


def test_to_write_changes_nothing_and_gives_the_same_bytes_again():
    bench, happens = random_mission(Random(7))
    play(bench, happens, 20.0)
    raw = written(bench.manager)
    assert written(bench.manager) == raw
    assert written(read(raw)) == raw


def test_of_more_than_64_rcs():
    rcs = [unit(f"u{number}") for number in range(70)]
    bench = Bench(manager(), *rcs)
    bench.tell(ask("a", "u69"))
    assert read(written(bench.manager)).leases() == bench.manager.leases() != []


@settings(max_examples=share(300))
@given(data=st.data())
def test_changed_bytes_are_refused_or_read(data: st.DataObject):
    bench, happens = random_mission(Random(5))
    play(bench, happens, 20.0)
    raw = bytearray(written(bench.manager))
    raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    with suppress(NoSnapshot):
        read(bytes(raw))


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        pickle.dumps(ScheduleManager),
        msgspec.msgpack.encode((FORM + 1, [])),
        msgspec.msgpack.encode((FORM, [])),
        msgspec.msgpack.encode((FORM, [["object", "Popen"]])),
        msgspec.msgpack.encode((FORM, [["method", [1], "__init__"], ["object", "Damping"]])),
        msgspec.msgpack.encode((FORM, [["object", "ArcEntry", "__class__", 1]])),
        msgspec.msgpack.encode((FORM, [["tuple", [0]]])),
        msgspec.msgpack.encode((FORM, [["list"]])),
    ],
)
def test_other_bytes_are_refused(raw: bytes):
    with pytest.raises(NoSnapshot):
        read(raw)
