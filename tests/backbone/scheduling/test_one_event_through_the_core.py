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
from simulated_switches import Bench, ask, manager, unit

import backbone.scheduling
from backbone.scheduling.events import ConnectArc, Event, Instruction, RevokeArc, WakeAt, Woken

ROOM = Path(backbone.scheduling.__file__).parent
RUN_S = 5.0


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


def a_granted_request() -> list[Step]:
    """An ARC asks for an RC that no ARC holds."""
    bench = Bench(manager(), unit("v"))
    return decided(bench, ask("a", "v", run_s=RUN_S), 0.0, ConnectArc)


def a_request_that_waits() -> list[Step]:
    """An ARC asks for an RC that an equal holds: it gets the next slice."""
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v", run_s=RUN_S))
    bench.run(1.0)
    return decided(bench, ask("b", "v", run_s=RUN_S), 1.0, WakeAt)


def an_ended_slice() -> list[Step]:
    """A slice ends for whose end an equal waits."""
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v", run_s=RUN_S))
    bench.tell(ask("b", "v", run_s=RUN_S))
    bench.run(1.0)
    return decided(bench, Woken(), RUN_S, RevokeArc)


def decided(bench: Bench, event: Event, now_s: float, outcome: type[Instruction]) -> list[Step]:
    """Return the functions that the event passes; the decision is of this kind."""
    instructions: list[Instruction] = []
    steps = walk(lambda: instructions.extend(bench.manager.handle(event, now_s)))
    assert any(isinstance(one, outcome) for one in instructions), instructions
    return steps


@pytest.mark.parametrize(("event", "most"), [(a_granted_request, 8), (a_request_that_waits, 4), (an_ended_slice, 14)])
def test_a_reader_seldom_goes_back(event: Callable[[], list[Step]], most: int) -> None:
    steps = event()
    returns = sum(step.is_return for step in steps)
    told = "\n".join(f"{'back to' if step.is_return else '':8}{step.file:22}{step.function}" for step in steps)
    assert returns <= most, f"{len(steps)} functions, {returns} returns:\n{told}"
