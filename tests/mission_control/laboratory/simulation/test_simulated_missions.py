"""Whole missions from seeds: the laws hold under all faults, and a seed means one run to the byte."""

from __future__ import annotations

import functools
import logging
import os
import subprocess
import sys
from collections import Counter

import pytest
from examples import share

from backbone.component.process import exit_code_of
from backbone.errors import LinkError
from mission_control.laboratory.simulation import campaign
from mission_control.laboratory.simulation.campaign import simulate
from mission_control.laboratory.simulation.mission_run import MissionRun, run_mission

SAME_EVERYWHERE = (0, 1, 2, 3, 40, 1305)  # in 40 a component is refused by pid, in 1305 a radio still has two holders
DIGESTS = f"""
from mission_control.laboratory.simulation.mission_run import run_mission
print(*(run_mission(seed, chaos=True).digest for seed in {SAME_EVERYWHERE}))
"""


@functools.cache
def mission(seed: int, *, chaos: bool) -> MissionRun:
    """Return a run of the mission, the same for all tests that only look at it."""
    return run_mission(seed, chaos=chaos)


def run_lawfully(seed: int, *, chaos: bool) -> MissionRun:
    run = mission(seed, chaos=chaos)
    assert run.broken is None, f"scout-backbone simulate --first {seed} --seeds 1{' --chaos' if chaos else ''}"
    return run


@pytest.mark.parametrize("seed", range(0, 10 * share(10), 10))
def test_missions_in_which_nothing_goes_wrong_keep_the_laws(seed: int) -> None:
    assert run_lawfully(seed, chaos=False).faults == ()


@pytest.mark.parametrize("seed", range(share(30)))
def test_missions_keep_the_laws_whatever_goes_wrong(seed: int) -> None:
    run_lawfully(seed, chaos=True)


def test_missions_are_busy() -> None:
    """Laws are easily kept where nothing happens."""
    missing = Counter({"grant": 41, "packet": 501, "killed": 1, "cut off": 1, "revoke": 1, "suspending": 1})
    missing += Counter(["suspended", "refused", "unanswered", "safe"])
    for seed in range(10):
        missing -= Counter(happening.what for happening in mission(seed, chaos=True).happenings)
        if not missing:
            return
    pytest.fail(f"no mission in which anybody is told: {dict(missing)}")


@pytest.mark.thorough
@pytest.mark.processes
def test_a_seed_means_one_run_to_the_byte_in_every_process() -> None:
    found = set()
    for hash_seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "SCOUT_LOG": "CRITICAL"}
        done = subprocess.run(
            [sys.executable, "-c", DIGESTS], env=environment, capture_output=True, text=True, timeout=60, check=True
        )
        found.add(done.stdout)
    here = " ".join(mission(seed, chaos=True).digest for seed in SAME_EVERYWHERE) + "\n"
    assert found == {here}


def test_a_run_with_the_faults_it_had_is_the_same_run() -> None:
    run = mission(0, chaos=True)
    again = run_mission(0, chaos=True, faults=run.faults)
    assert len(run.faults) > 10
    assert again.digest == run.digest


def test_without_chaos_nothing_is_lost_and_nobody_is_killed() -> None:
    words = {happening.what for happening in mission(3, chaos=False).happenings}
    assert not words & {"killed", "cut off", "gives up", "fails"}


@pytest.mark.thorough
def test_a_campaign_counts_what_it_saw(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "BATCH", 2)
    told: list[str] = []
    outcome = simulate(0, 3, chaos=True, tell=told.append, processes=1)
    assert outcome.finding is None
    assert outcome.count.runs == 3
    assert outcome.count.faults > 0
    assert told == ["2 of 3 missions", "3 of 3 missions"]
    assert outcome.to_json()["broken"] is None


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_2000_missions_with_message_loss_and_kills_keep_the_laws() -> None:
    outcome = simulate(0, 2000, chaos=True, tell=print)
    assert outcome.finding is None, "\n".join(outcome.finding.lines())
    assert outcome.count.runs == 2000


def test_a_component_that_switches_logging_on_prints_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def ends_by_a_refusal(seed: int, **_how: object) -> MissionRun:
        exit_code_of(LinkError("no hub answers"), "mission_control/one")
        return mission(seed, chaos=False)

    mission(0, chaos=False)
    monkeypatch.setattr(campaign, "run_mission", ends_by_a_refusal)
    monkeypatch.setattr(logging.root, "handlers", [])  # as in the processes of a campaign
    assert simulate(0, 1, chaos=False, tell=print, processes=1).finding is None
    assert capsys.readouterr().err == ""
