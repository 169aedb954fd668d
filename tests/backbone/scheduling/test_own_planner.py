"""A planner of one's own plugs in by class path, and its traces are judged by the same rules."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from examples import share
from random_missions import play, random_mission
from simulated_switches import Bench, ask, manager, unit
from test_scheduling_laws import SAFETY, violations

from backbone.scheduling.own_planner import WrongPlanner, load_planner
from backbone.scheduling.whole_group import WholeGroupPlanner

GUIDE = Path(__file__).parents[3] / "docs" / "how-to" / "write-a-planner.md"
SHORTEST_FIRST = "shortest_first:ShortestFirst"
SHIPPED = "backbone.scheduling.whole_group:WholeGroupPlanner"


@pytest.fixture(scope="module", autouse=True)
def guide(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Put the guide's planner on Python's path."""
    found = re.search(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert found is not None
    folder = tmp_path_factory.mktemp("planner")
    (folder / "shortest_first.py").write_text(found[1])
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield
    sys.modules.pop("shortest_first", None)


def starts(planner: str) -> list[str]:
    """Return the ARCs in the order of their first grants, where the one that asks for most asked first."""
    bench = Bench(manager(planner=planner), unit("v"))
    bench.tell(ask("holder", "v", run_s=1.0))
    for arc, run_s in (("long", 8.0), ("middle", 4.0), ("short", 1.0)):
        bench.tell(ask(arc, "v", run_s=run_s))
    bench.run(13.9)
    return [line["arc"] for line in bench.trace if line["ev"] == "grant"]


def test_the_planner_of_the_guide_lets_the_shortest_slice_go_first() -> None:
    assert starts("")[:4] == ["holder", "long", "middle", "short"]
    assert starts(SHORTEST_FIRST)[:3] == ["holder", "short", "holder"]
    assert "long" not in starts(SHORTEST_FIRST)


def test_the_planner_of_the_guide_breaks_nothing_but_the_order_of_equals() -> None:
    broken = {
        one.code
        for seed in range(share(150))
        for one in violations(play(*random_mission(Random(seed), planner=SHORTEST_FIRST)))
    }
    assert "DELAY" in broken
    assert not broken & (SAFETY - {"MINRUN", "DEMOTE"})


@pytest.mark.parametrize("seed", range(share(60)))
def test_a_shipped_planner_named_by_its_path_does_what_it_does_unnamed(seed: int) -> None:
    named, unnamed = (play(*random_mission(Random(seed), planner=planner)) for planner in (SHIPPED, ""))
    assert named.trace == unnamed.trace


def test_no_path_is_no_planner_of_ones_own() -> None:
    assert load_planner("") is None
    assert load_planner(SHIPPED) is WholeGroupPlanner


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("def order(:", "SyntaxError: invalid syntax"),
        ("slack = margin", "NameError: name 'margin' is not defined"),
        ("raise SystemExit(3)", "SystemExit: 3"),
    ],
)
def test_a_planner_whose_file_cannot_be_imported_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, reason: str
) -> None:
    (tmp_path / "planner_in_work.py").write_text(f"{line}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(WrongPlanner, match=re.escape(reason)) as refused:
        load_planner("planner_in_work:Planner")
    assert "Correct the fault" in refused.value.remedy


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("no.such.module:Planner", "No module named 'no'"),
        ("backbone.scheduling.whole_group:Missing", "has no attribute 'Missing'"),
        ("backbone.scheduling.rules:SchedulingRules", "is no planner: it lacks before, due, "),
        ("backbone.scheduling.own_planner:load_planner", "is no planner: it lacks before, due, "),
    ],
)
def test_what_is_no_planner_is_refused_with_a_remedy(path: str, reason: str) -> None:
    with pytest.raises(WrongPlanner, match=re.escape(reason)) as refused:
        load_planner(path)
    assert "package.module:Class" in refused.value.remedy
