"""What the schedule manager keeps of those who left: of a long mission no more than of a short one."""

from __future__ import annotations

import gc

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import Departed
from backbone.scheduling.priority import Level
from backbone.scheduling.requests import RcUse


def played(**rules: object) -> Bench:
    """Two behaviors share a radio, and each has a robot of its own."""
    bench = Bench(manager(**rules), sharable("radio"), unit("scout1"), unit("scout2"))
    for robot in ("scout1", "scout2"):
        bench.tell(ask(f"watch-{robot}", {"radio": load(0.2), robot: RcUse()}))
    return bench


def come_and_go(bench: Bench, consoles: range, held_s: float = 2.0, orders: bool = False) -> Bench:
    """Let consoles, each with a name of its own, take a robot one after the other, and leave."""
    for number in consoles:
        path = [(f"console-{number}", 100)] + ([(f"console-{number}-order-1", 1)] if orders else [])
        bench.tell(ask(f"console-{number}-drive", {"radio": load(0.7), "scout1": RcUse()}, path=path, console=True))
        bench.run(bench.now_s + held_s)
        bench.tell(Departed(f"console-{number}-drive", "self"))
        bench.run(bench.now_s + 1.0)
    return bench


def count(kind: type) -> int:
    gc.collect()
    return sum(isinstance(one, kind) for one in gc.get_objects())


@pytest.mark.parametrize("rules", [{}, {"discipline": "time"}, {"policy": "strict"}, {"exact_up_to": 1}], ids=str)
@pytest.mark.parametrize("kind", [ArcEntry, Level])
def test_of_arcs_that_left_none_is_kept(kind: type, rules: dict[str, object]):
    bench = come_and_go(played(**rules), range(30), orders=True)
    before = count(kind)
    come_and_go(bench, range(30, 230), orders=True)
    assert count(kind) - before < 80  # levels are forgotten when they are the majority
    assert bench.verdict() == []
