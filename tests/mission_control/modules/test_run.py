"""The first pair of modules: thirty lines, no mission file, and what the guide says of it is so."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sample_modules import Counter, Doubler, Number

from backbone.bus.clock import VirtualClock, run_virtual
from mission_control.modules.graph import GraphRefused, NoProducer
from mission_control.modules.orders import WrongModule
from mission_control.modules.ports import type_name
from mission_control.modules.run import UNIT, connected, run, run_units
from mission_control.modules.run_in_processes import run_in_processes
from mission_control.modules.units_together import NotGiven, NothingToHear

TOP = Path(__file__).parents[3]
PAIR, GUIDE = TOP / "docs/examples/pair.py", TOP / "docs/how-to/write-a-module.md"


def test_on_a_virtual_clock_two_modules_run_at_their_frequency() -> None:
    async def main() -> None:
        clock = VirtualClock()
        units = connected(Doubler(), Counter(), frequency_hz=20.0, start_s=clock.now_s())
        units.listen("twice", lambda one: seen.append((clock.now_s(), one)))
        await run_units(units, clock, 0.2)
        kept = units.statistics()[UNIT]
        assert (kept.rounds, kept.missed, kept.most_late_s) == (4, 0, pytest.approx(0.0, abs=1e-8))
        assert kept.rate_hz == pytest.approx(20.0)

    seen: list[tuple[float, Number]] = []
    run_virtual(main())
    assert [one for _, one in seen] == [Number(2.0), Number(4.0), Number(6.0), Number(8.0)]
    assert [at for at, _ in seen] == pytest.approx([0.0, 0.05, 0.1, 0.15])


def test_without_a_frequency_they_run_on_what_is_fed() -> None:
    units, seen = connected(Doubler(), given={"number": type_name(Number)}), list[Number]()
    units.listen("twice", seen.append)
    units.feed("number", Number(4.0), 0.0)
    assert seen == [Number(8.0)]


@pytest.mark.parametrize("key", ["nummber", "twice"])
def test_a_value_that_would_reach_no_module_is_refused(key: str) -> None:
    """With a key in error, a test of what a module does *not* produce passed."""
    units = connected(Doubler(), given={"number": type_name(Number)})
    with pytest.raises(NotGiven, match=f"'{key}' is not given from outside"):
        units.feed(key, Number(4.0), 0.0)


def test_what_cannot_be_connected_is_refused_before_anything_runs() -> None:
    with pytest.raises(GraphRefused) as refused:
        run(Doubler(), for_s=1.0)
    assert [type(one) for one in refused.value.faults] == [NoProducer]


@pytest.mark.parametrize("runs", [run, run_in_processes])
def test_a_listener_of_what_nobody_makes_is_refused_before_anything_runs(runs: Callable[..., object]) -> None:
    with pytest.raises(NothingToHear, match="did you mean 'twice'"):
        runs(Doubler(), Counter(), for_s=0.1, listen={"twise": print})


@pytest.mark.parametrize("runs", [run, run_in_processes])
def test_a_class_in_place_of_a_module_is_named(runs: Callable[..., object]) -> None:
    with pytest.raises(WrongModule, match=r"<class 'sample_modules.Doubler'> is no module \(Give an instance"):
        runs(Doubler, Counter, for_s=0.1)


@pytest.mark.processes
def test_the_pair_has_thirty_lines_and_runs_as_it_stands() -> None:
    text = PAIR.read_text().replace("for_s=2", "for_s=0.2")
    assert len([line for line in text.splitlines() if line]) <= 30
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True, cwd=TOP)
    first = done.stdout.splitlines()[0]
    assert first in GUIDE.read_text()


def test_what_the_guide_shows_is_in_the_pair_and_holds() -> None:
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert blocks[0] in PAIR.read_text()
    pair: dict[str, Any] = runpy.run_path(str(PAIR), run_name="pair")
    exec(blocks[1], pair)  # noqa: S102  # the guide's own lines


def test_the_guide_tells_the_refusal_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(PAIR.parent)
    import pair

    with pytest.raises(GraphRefused) as refused:
        connected(pair.Smoothing())
    [told] = re.findall(r"GraphRefused: (.*) …", GUIDE.read_text())
    assert str(refused.value).startswith(told)
