"""One event through the scheduling core: a reader seldom goes back to a file already left.

The functions of the core that an event passes are listed in the order of their first calls. A *return* is a first call
of a function in a file that was entered and left before: there a reader turns pages back. Functions without a name of
their own (lambdas, comprehensions) are read where they stand.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import NamedTuple

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, unit

import backbone.scheduling
from backbone.scheduling.events import (
    CapacityChanged,
    ConnectArc,
    Departed,
    Event,
    Extended,
    Freed,
    Idled,
    Instruction,
    Opened,
    OpenFailed,
    PriorityChanged,
    RcCameBack,
    RcWentDown,
    Record,
    RevokeArc,
    RuntimeChanged,
    WakeAt,
    Wanted,
    Woken,
)
from backbone.scheduling.master_schedule import EXACT_UP_TO
from backbone.scheduling.requests import RcUse

ROOM = Path(backbone.scheduling.__file__).parent
RUN_S = 5.0
MOST_RETURNS = 8

Uses = dict[str, RcUse]


class Step(NamedTuple):
    """A function at its first call.

    Attributes:
        file: Below ``ROOM``.
        is_return: The file was entered and left before.
    """

    file: str
    function: str
    is_return: bool


def walk(decide: Callable[[], object]) -> list[Step]:
    """Return the functions of the core that a decision passes, in the order of their first calls."""
    called: dict[CodeType, None] = {}

    def note(frame: FrameType, event: str, _argument: object) -> None:
        code = frame.f_code
        if event == "call" and Path(code.co_filename).is_relative_to(ROOM) and not code.co_name.startswith("<"):
            called.setdefault(code)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        decide()
    finally:
        sys.setprofile(before)
    steps: list[Step] = []
    for code in called:
        file = str(Path(code.co_filename).relative_to(ROOM))
        is_return = bool(steps) and steps[-1].file != file and any(step.file == file for step in steps)
        steps.append(Step(file, code.co_qualname, is_return))
    return steps


class Kind(NamedTuple):
    """The kind of the RCs and of the planner.

    Attributes:
        uses: What the ARCs ask for.
        exact_up_to: Groups of at most this size are planned whole.
    """

    uses: Uses
    exact_up_to: int

    def bench(self) -> Bench:
        """Return a bench with an RC of either kind."""
        return Bench(manager(exact_up_to=self.exact_up_to), unit("u", 0.1, 0.1), sharable("s", 1.0, 0.1, 0.1))

    def running(self, *arcs: str) -> Bench:
        """Return a bench on which the first of these ARCs runs, and the others wait for the end of its slice."""
        bench = self.bench()
        for arc in arcs:
            bench.tell(ask(arc, self.uses, run_s=RUN_S))
        return bench.run(1.0)

    @property
    def rc(self) -> str:
        """The first RC that the ARCs ask for."""
        return next(iter(self.uses))


Happens = tuple[Bench, Event, type[Instruction]]
"""A bench just before the event, the event, and the kind of instruction that must come of it."""


def granted(kind: Kind) -> Happens:
    return kind.bench(), ask("a", kind.uses), ConnectArc


def waits(kind: Kind) -> Happens:
    return kind.running("a"), ask("b", kind.uses), WakeAt


def preempts(kind: Kind) -> Happens:
    return kind.running("a"), ask("b", kind.uses, priority=3), RevokeArc


def waits_for_a_dead_rc(kind: Kind) -> Happens:
    bench = kind.bench()
    bench.tell(RcWentDown(kind.rc))
    return bench, ask("a", kind.uses), Record


def slice_ends(kind: Kind) -> Happens:
    bench = kind.running("a", "b", "c")
    bench.now_s = RUN_S + 0.1
    return bench, Woken(), RevokeArc


def idles(kind: Kind) -> Happens:
    return kind.running("a", "b"), Idled("a"), RevokeArc


def departs(kind: Kind) -> Happens:
    return kind.running("a", "b"), Departed("a"), RevokeArc


def wants_again(kind: Kind) -> Happens:
    bench = kind.running("a")
    bench.tell(Idled("a"))
    return bench.run(2.0), Wanted("a"), ConnectArc


def is_free(kind: Kind) -> Happens:
    bench = kind.running("a", "b")
    bench.tell(Departed("a"))
    return bench, Freed("a"), ConnectArc


def is_connected(kind: Kind) -> Happens:
    bench = kind.bench()
    bench.tell(ask("a", kind.uses))
    bench.tell(ask("b", kind.uses))
    return bench, Opened("a"), WakeAt


def cannot_be_connected(kind: Kind) -> Happens:
    bench, _, _ = is_connected(kind)
    return bench, OpenFailed("a", kind.rc), Record


def rc_is_lost(kind: Kind) -> Happens:
    return kind.running("a", "b"), RcWentDown(kind.rc), RevokeArc


def rc_is_back(kind: Kind) -> Happens:
    bench = kind.running("a", "b")
    bench.tell(RcWentDown(kind.rc))
    return bench.run(1.5), RcCameBack(kind.rc, 0), ConnectArc


def priority_changes(kind: Kind) -> Happens:
    return kind.running("a", "b"), PriorityChanged("owner-b", 3), RevokeArc


def run_time_changes(kind: Kind) -> Happens:
    return kind.running("a", "b"), RuntimeChanged("b", 3.0, 3.0), Record


def is_extended(kind: Kind) -> Happens:
    bench = kind.bench()
    bench.tell(ask("a", kind.uses, run_s=RUN_S, most_s=20.0))
    bench.tell(ask("b", kind.uses))
    return bench.run(1.0), Extended("a", 8.0), WakeAt


def capacity_falls(kind: Kind) -> Happens:
    bench = kind.bench()
    for arc in "abc":
        bench.tell(ask(arc, {"s": load(0.3)}))
    return bench.run(1.0), CapacityChanged("s", 0.7), RevokeArc


EVENTS: list[Callable[[Kind], Happens]] = [
    *(granted, waits, preempts, waits_for_a_dead_rc, slice_ends, idles, departs, wants_again, is_free, is_connected),
    *(cannot_be_connected, rc_is_lost, rc_is_back, priority_changes, run_time_changes, is_extended, capacity_falls),
]
USES: dict[str, Uses] = {
    "unit": {"u": RcUse()},
    "sharable": {"s": load(0.6)},
    "both": {"s": load(0.6), "u": RcUse()},
}


@pytest.mark.parametrize("exact_up_to", [EXACT_UP_TO, 0], ids=["whole group", "large group"])
@pytest.mark.parametrize("uses", USES.values(), ids=USES)
@pytest.mark.parametrize("event", EVENTS, ids=lambda event: event.__name__)
def test_a_reader_seldom_goes_back(event: Callable[[Kind], Happens], uses: Uses, exact_up_to: int) -> None:
    bench, happens, outcome = event(Kind(uses, exact_up_to))
    instructions: list[Instruction] = []
    steps = walk(lambda: instructions.extend(bench.manager.handle(happens, bench.now_s)))
    assert any(isinstance(one, outcome) for one in instructions), instructions
    returns = sum(step.is_return for step in steps)
    told = "\n".join(f"{'back to' if step.is_return else '':8}{step.file:22}{step.function}" for step in steps)
    assert returns <= MOST_RETURNS, f"{len(steps)} functions, {returns} returns:\n{told}"
