"""What the schedule manager keeps of those who left: of a long mission no more than of a short one."""

from __future__ import annotations

import gc
from collections import Counter
from typing import Any

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import Departed
from backbone.scheduling.priority import Level
from backbone.scheduling.requests import RcUse
from backbone.scheduling.snapshot import written


def played(**rules: Any) -> Bench:
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


def counts() -> tuple[int, int]:
    """Return how many entries of ARCs and how many levels there are."""
    gc.collect()
    kinds = Counter(map(type, gc.get_objects()))
    return kinds[ArcEntry], kinds[Level]


@pytest.mark.parametrize("rules", [{}, {"discipline": "time"}, {"policy": "strict"}, {"exact_up_to": 1}], ids=str)
def test_of_arcs_that_left_none_is_kept(rules: dict[str, Any]) -> None:
    bench = come_and_go(played(**rules), range(30), orders=True)
    before = counts()
    come_and_go(bench, range(30, 230), orders=True)
    kept = [now - then for now, then in zip(counts(), before, strict=True)]
    assert max(kept) < 80  # levels are forgotten when they are the majority
    assert bench.verdict() == []


def test_a_snapshot_has_nothing_of_consoles_that_left() -> None:
    bench = played()
    sizes = [len(written(come_and_go(bench, range(one, one + 1), orders=True).manager)) for one in range(300)]
    assert max(sizes[100:]) < 1.2 * max(sizes[:100])  # empty levels are forgotten by the dozen
    assert bench.verdict() == []


def test_a_snapshot_has_nothing_of_consoles_that_left_in_vain() -> None:
    bench = Bench(manager(), unit("scout1", connect_s=0.3))
    bench.tell(ask("watch", "scout1"))
    sizes = []
    for number in range(330):
        bench.run(bench.now_s + 5.0)
        bench.tell(ask(f"console-{number}-drive", "scout1", path=[(f"console-{number}", 100)], console=True))
        bench.tell(Departed(f"console-{number}-drive", "self"))
        sizes.append(len(written(bench.manager)))
    assert max(sizes[30:]) < 1.2 * max(sizes[:30])


def test_a_snapshot_does_not_grow_while_an_arc_waits_for_days() -> None:
    bench = Bench(manager(aging_s=5.0), unit("scout1"))
    bench.tell(ask("drive", "scout1", path=[("anna", 100)], console=True, run_s=86_400.0))
    bench.tell(ask("watch", "scout1"))
    bench.run(600.0)
    size = len(written(bench.manager))
    bench.run(6_000.0)
    assert len(written(bench.manager)) < 1.2 * size


def test_a_console_that_comes_back_with_another_number_is_where_that_number_puts_it() -> None:
    bench = Bench(manager(), unit("scout1"))
    bench.tell(ask("watch", "scout1"))
    for priority in (100, -5, 100):
        bench.tell(ask("anna-drive", "scout1", path=[("anna", priority)], console=True))
        bench.run(bench.now_s + 2.0)
        assert (bench.runs("anna-drive")[-1:] or [(0, 0)])[0][1] is None or priority < 0
        bench.tell(Departed("anna-drive", "self"))
        bench.run(bench.now_s + 2.0)
    assert len(bench.runs("anna-drive")) == 2
    assert bench.verdict() == []
