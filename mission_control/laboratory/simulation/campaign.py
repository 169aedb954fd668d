"""Fault campaign: runs many simulated missions on all processors; reports the story of the first broken law."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import msgspec

from mission_control.laboratory.harness import results_of
from mission_control.laboratory.simulation.faults import Fault
from mission_control.laboratory.simulation.laws import Broken, story_of
from mission_control.laboratory.simulation.mission_run import MissionRun, run_mission
from mission_control.laboratory.simulation.shrink import smallest
from mission_control.laboratory.simulation.supervised_mission import run_supervised
from mission_control.laboratory.simulation.supervision_faults import SupervisionFault

BATCH = 10  # chosen: two seconds of work, so that progress is visible and a broken law ends the campaign soon
ALONE = 2 * BATCH  # chosen: fewer missions are finished before other processes have started


AnyFault = Fault | SupervisionFault


@dataclass(frozen=True, slots=True)
class CampaignCount:
    """Counts of some runs.

    Attributes:
        runs: Number of seeds; each seed gives a pool mission and a supervised mission.
    """

    runs: int = 0
    happenings: int = 0
    grants: int = 0
    packets: int = 0
    faults: int = 0

    def __add__(self, other: CampaignCount) -> CampaignCount:
        """Return the sum of both counts."""
        return CampaignCount(
            self.runs + other.runs,
            self.happenings + other.happenings,
            self.grants + other.grants,
            self.packets + other.packets,
            self.faults + other.faults,
        )


@dataclass(frozen=True, slots=True)
class Finding:
    """A mission that breaks a law.

    Attributes:
        supervised: True: the supervised mission of this seed; False: its pool mission.
        chaos: True if faults were injected.
        broken: The law, in the run with the fewest faults.
        faults: The smallest set of faults, as far as found, that breaks the law.
        faults_before: Number of faults in the first run that broke it.
        story: Events of the concerned components up to the breach.
    """

    seed: int
    supervised: bool
    chaos: bool
    broken: Broken
    faults: tuple[AnyFault, ...]
    faults_before: int
    story: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """Yield the report for people."""
        mission = "supervised" if self.supervised else "pool"
        yield f"seed {self.seed}{' --chaos' if self.chaos else ''}, {mission} mission, breaks the law {self.broken}"
        if self.chaos:
            yield f"{len(self.faults)} of {self.faults_before} faults are enough for it:"
            yield from (f"  {fault}" for fault in self.faults)
        yield f"what happened to {', '.join(self.broken.names)}:"
        yield from (f"  {line}" for line in self.story)
        yield f"again: scout-backbone simulate --first {self.seed} --seeds 1{' --chaos' if self.chaos else ''}"


@dataclass(frozen=True, slots=True)
class CampaignOutcome:
    """The result of all runs.

    Attributes:
        count: Counts of all runs.
        finding: The broken law of the smallest failing seed; None if all laws hold.
        took_s: Duration, machine seconds.
    """

    count: CampaignCount
    finding: Finding | None
    took_s: float

    def summary(self) -> str:
        """Return one line for people."""
        count = self.count
        verdict = "all laws hold" if self.finding is None else f"broken: {self.finding.broken.law}"
        return (
            f"{count.runs} missions, {count.grants} grants, {count.packets} packets, {count.faults} faults on purpose "
            f"in {self.took_s:.1f} s: {verdict}"
        )

    def to_json(self) -> dict[str, object]:
        """Return the result as plain data, for ``--json``."""
        finding = self.finding
        plain: dict[str, object] = {**msgspec.to_builtins(self.count), "took_s": round(self.took_s, 3), "broken": None}
        if finding is not None:
            plain["broken"] = {
                "law": finding.broken.law,
                "seed": finding.seed,
                "supervised": finding.supervised,
                "chaos": finding.chaos,
                "at_s": finding.broken.at_s,
                "what": finding.broken.what,
                "names": list(finding.broken.names),
                "faults": [str(fault) for fault in finding.faults],
                "faults_before": finding.faults_before,
                "story": list(finding.story),
            }
        return plain


def simulate(
    first: int, seeds: int, *, chaos: bool, tell: Callable[[str], None], processes: int | None = None
) -> CampaignOutcome:
    """Run the missions of these seeds until a mission breaks a law; reproduce and shrink that mission.

    Args:
        seeds: Number of seeds, 1 or more.
        tell: Called with lines of progress.
        processes: Number of processes; None: one for each processor, or only this one for few seeds.
    """
    began_s = time.monotonic()
    batches = [range(at, min(at + BATCH, first + seeds)) for at in range(first, first + seeds, BATCH)]
    workers = processes or (1 if seeds <= ALONE else 0)
    counted, failed, finding = CampaignCount(), None, None
    with closing(results_of(partial(_run_batch, chaos=chaos), batches, jobs=workers)) as results:
        while failed is None and (result := next(results, None)) is not None:
            count, failed = result
            counted += count
            tell(f"{counted.runs} of {seeds} missions")
    if failed is not None:
        tell(f"seed {failed} breaks a law; looking for the fewest faults that do")
        finding = find(failed, chaos=chaos)
    return CampaignOutcome(counted, finding, time.monotonic() - began_s)


def find(seed: int, *, chaos: bool) -> Finding | None:
    """Return the law that the mission of this seed breaks, with as few faults as possible; None if all laws hold."""
    runs = ((supervised, _run_quietly(seed, supervised, chaos)) for supervised in (False, True))
    supervised, run = next(((supervised, run) for supervised, run in runs if run.broken is not None), (False, None))
    if run is None or run.broken is None:
        return None
    law, least, faults_before = run.broken.law, run, len(run.faults)

    def breaks(faults: Sequence[AnyFault]) -> bool:
        nonlocal least
        tried = _run_quietly(seed, supervised, chaos, faults)
        if tried.broken is None or tried.broken.law != law:
            return False
        least = tried
        return True

    smallest(run.faults, breaks)
    broken = least.broken or run.broken
    story = tuple(str(happening) for happening in story_of(broken, least.happenings))
    return Finding(seed, supervised, chaos, broken, least.faults, faults_before, story)


def _run_batch(batch: Sequence[int], *, chaos: bool) -> tuple[CampaignCount, int | None]:
    """Run missions until one breaks a law; return the counts, and the seed of that mission."""
    counted = CampaignCount()
    for seed in batch:
        counted += CampaignCount(1)
        for supervised in (False, True):
            run = _run_quietly(seed, supervised, chaos)
            counted += _count(run)
            if run.broken is not None:
                return counted, seed
    return counted, None


def _run_quietly(seed: int, supervised: bool, chaos: bool, faults: Sequence[AnyFault] | None = None) -> MissionRun:
    """Run the mission without logging, because components log every fault and the audit has all relevant events.

    A component that ends by a fault switches logging on again, in case its author silenced it; a handler that drops all
    keeps that from the terminal.
    """
    before, drop = logging.root.manager.disable, logging.NullHandler()
    logging.disable(logging.CRITICAL)
    logging.root.addHandler(drop)
    try:
        if supervised:
            struck = None if faults is None else [each for each in faults if isinstance(each, SupervisionFault)]
            return run_supervised(seed, chaos=chaos, faults=struck)
        said = None if faults is None else [each for each in faults if not isinstance(each, SupervisionFault)]
        return run_mission(seed, chaos=chaos, faults=said)
    finally:
        logging.root.removeHandler(drop)
        logging.disable(before)


def _count(run: MissionRun) -> CampaignCount:
    words = [happening.what for happening in run.happenings]
    return CampaignCount(0, len(words), words.count("grant"), words.count("packet"), len(run.faults))
