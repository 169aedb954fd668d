"""Supervised missions from seeds: real launcher, creators and placer; processes, links and machines fail."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from examples import share, some

from backbone.errors import Refusal
from backbone.wire import Envelope, Reader, write
from mission_control.laboratory.simulation.hostile_numbers import hostile_message
from mission_control.laboratory.simulation.mission_run import MissionRun
from mission_control.laboratory.simulation.operator_choices import OperatorChange
from mission_control.laboratory.simulation.supervised_mission import run_supervised
from mission_control.laboratory.simulation.supervised_shape import draw_supervised_shape
from mission_control.laboratory.simulation.supervision_faults import (
    Cut,
    End,
    Pause,
    Starve,
    SupervisionFault,
    draw_supervision_faults,
)

DIGESTS = """
from mission_control.laboratory.simulation.supervised_mission import run_supervised
print(*(run_supervised(seed, chaos=True).digest for seed in range(2)))
"""
AT_S = 3.1  # chosen: all is up and at work
CORE = ("nameserver", "component_database", "placer", "dependency_database", "rc_manager", "creator-h1")


def run_lawfully(seed: int, *faults: SupervisionFault, chaos: bool = True) -> MissionRun:
    run = run_supervised(seed, chaos=chaos, faults=list(faults) or None)
    assert run.broken is None, f"seed {seed}, {[str(fault) for fault in run.faults]}: {run.broken}"
    return run


@pytest.mark.parametrize("seed", range(0, 20, 10))
def test_supervised_missions_in_which_nothing_goes_wrong_keep_the_laws(seed: int) -> None:
    assert run_lawfully(seed, chaos=False).faults == ()


@pytest.mark.parametrize("seed", range(share(12)))
def test_supervised_missions_are_whole_again_after_whatever_goes_wrong(seed: int) -> None:
    run_lawfully(seed)


@pytest.mark.parametrize("name", some(CORE))
def test_a_core_service_that_hangs_is_replaced_and_one_that_ends_politely_comes_back(name: str) -> None:
    """Two faults of one mission; the second strikes when the first has long been mended."""
    run = run_lawfully(0, Pause(AT_S, name, 5.0), End(20.0, name, "politely", 0.02))
    ways = [
        happening.values["how"] for happening in run.happenings if (happening.who, happening.what) == (name, "fell")
    ]
    assert ways[0].startswith("hung")
    assert len(ways) > 1


def test_a_process_that_is_paused_for_less_than_its_patience_is_not_replaced() -> None:
    run = run_lawfully(0, Pause(AT_S, "placer", 2.5))
    assert not [happening for happening in run.happenings if happening.what in {"killed", "fell"}]


def test_on_a_starved_machine_nobody_is_ended() -> None:
    run = run_lawfully(0, Starve(AT_S, "h1", 10.0, 2.5))
    assert not [happening for happening in run.happenings if happening.what == "fell"]


def test_a_host_that_was_cut_off_is_whole_again() -> None:
    seed = next(seed for seed in range(20) if len(draw_supervised_shape(seed).hosts) > 1)
    run = run_lawfully(seed, Cut(AT_S, "h2", 20.0))
    assert any(happening.what == "degraded" and "h2" in str(happening) for happening in run.happenings)


def test_a_priority_that_an_operator_set_outlives_the_rc_manager() -> None:
    """Also if the console's ARC begins anew, and nothing else of the mission knows the number."""
    seed = next(seed for seed in range(20) if any(owner.console for owner in draw_supervised_shape(seed).pool.owners))
    console = next(owner for owner in draw_supervised_shape(seed).pool.owners if owner.console)
    run = run_lawfully(
        seed,
        OperatorChange(AT_S, console.name, 3),
        End(AT_S + 7.0, "rc_manager", "killed"),
        End(AT_S + 7.0, console.arc, "killed"),
    )
    asked = [one for one in run.happenings if one.what == "request" and one.values["arc"] == console.arc]
    assert asked[-1].values["owner"] == {"ui": 3, "id": console.name}


def test_supervised_missions_suffer_everything() -> None:
    """Laws are easily kept where nothing happens."""
    faults = [fault for seed in range(100) for fault in draw_supervision_faults(draw_supervised_shape(seed))]
    words = " ".join(map(str, faults))
    for word in (
        "paused",
        "killed",
        "politely",
        "its successor",
        "the link of",
        "the link of h2",
        "starved",
        "hostile",
        "the priority",
        "the parent",
        "the capacity",
        "admission",
        "an operator stops",
    ):
        assert word in words, word
    lasting = [fault.lasts_s for fault in faults if isinstance(fault, Pause)]
    assert min(lasting) < 0.3
    assert max(lasting) > 20.0


def test_hostile_numbers_do_not_get_past_the_decoder() -> None:
    """What does is of a harmless kind: an extension is cut to the maximum run time."""
    shape, passed = draw_supervised_shape(3), set[str]()
    for number in range(100):
        for target in shape.hearers():
            message = hostile_message(shape, target, number)
            try:
                Reader(type(message.body)).read(write(Envelope(1, message.source, 1, 1.0, "", message.body)))
            except Refusal:
                continue
            passed.add(type(message.body).__name__)
    assert passed <= {"Extend"}


@pytest.mark.thorough
@pytest.mark.processes
def test_a_seed_means_one_supervised_run_to_the_byte_in_every_process() -> None:
    found = set()
    for hash_seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "SCOUT_LOG": "CRITICAL"}
        done = subprocess.run(
            [sys.executable, "-c", DIGESTS], env=environment, capture_output=True, text=True, timeout=60, check=True
        )
        found.add(done.stdout)
    assert len(found) == 1
