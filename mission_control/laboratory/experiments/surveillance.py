"""The surveillance experiments of both papers, with and without adaptive run times.

Sources: IROS 2001, "Experiments", figure 4; RAM 2002, "Distributed Surveillance Task"; SCHEDULING.md, section 6.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from itertools import groupby
from pathlib import Path

import msgspec

from mission_control.laboratory.experiments import geometry
from mission_control.laboratory.experiments.conditions import PUBLISHED, Condition
from mission_control.laboratory.experiments.intervals import standard_errors_apart, wilson
from mission_control.laboratory.experiments.prediction import predicted
from mission_control.laboratory.experiments.trial import Trial, run_trial
from mission_control.laboratory.harness import Progress, results_of

TRIALS = 200
"""S105: number of trials of each condition, by default."""


class TrialOrder(msgspec.Struct, frozen=True):
    """The input of a trial.

    Attributes:
        trace: File for its schedule trace; empty: none.
    """

    condition: Condition
    seed: int
    number: int
    trace: str = ""


Piece = Sequence[TrialOrder] | Condition
"""Work for one process at a time: trials of one room, which share its model and its pictures, or a prediction."""


class ConditionRow(msgspec.Struct, frozen=True):
    """The result of one condition.

    Attributes:
        predicted: Share of detections predicted from geometry and schedule.
        false_alarms: Number of false alarms, in all trials.
        switches: Grants and ends of holds compared with the transmitters, in all trials.
        disagreements: Disagreements, by trial.
        jammed_frames: Frames with two transmitters on one frequency, in all trials.
        stale_packets: Packets of stale epochs, in all trials.
        simulated_s: Mission time of all trials.
        digest: Hash of all decisions and events of all trials.
    """

    condition: Condition
    trials: int
    detected: int
    predicted: float
    false_alarms: int
    switches: int
    disagreements: list[str]
    jammed_frames: int
    stale_packets: int
    simulated_s: float
    digest: str

    @property
    def rate(self) -> float:
        """Share of the trials in which the target was detected."""
        return self.detected / self.trials

    @property
    def interval95(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the rate."""
        return wilson(self.detected, self.trials)

    @property
    def errors_from_predicted(self) -> float:
        """Distance between rate and prediction, in standard errors."""
        return standard_errors_apart(self.detected, self.trials, self.predicted)

    @property
    def is_sound(self) -> bool:
        """True if grants and transmitters agreed at every switch, and no frequency ever had two transmitters."""
        return not self.disagreements and not self.jammed_frames and not self.stale_packets

    def to_json(self) -> dict[str, object]:
        """Return it as plain data."""
        condition = self.condition
        given = PUBLISHED.get(condition)
        return {
            **msgspec.to_builtins(condition),
            "speed_m_s": condition.passage.speed_m_s,
            "trials": self.trials,
            "detected": self.detected,
            "rate": self.rate,
            "interval95": list(self.interval95),
            "predicted": self.predicted,
            "standard_errors_from_predicted": round(self.errors_from_predicted, 6),
            "published": None if given is None else msgspec.to_builtins(given),
            "false_alarms": self.false_alarms,
            "switches": self.switches,
            "disagreements": self.disagreements,
            "jammed_frames": self.jammed_frames,
            "stale_packets": self.stale_packets,
            "simulated_s": round(self.simulated_s, 6),
            "digest": self.digest,
        }


class SurveillanceOutcome(msgspec.Struct, frozen=True):
    """The result of the experiment; the same seed gives the same result except ``wall_s``."""

    seed: int
    rows: list[ConditionRow]
    wall_s: float

    @property
    def simulated_s(self) -> float:
        """Mission time of all trials."""
        return sum(row.simulated_s for row in self.rows)

    @property
    def is_sound(self) -> bool:
        """True if all rows are sound."""
        return all(row.is_sound for row in self.rows)

    def to_json(self) -> dict[str, object]:
        """Return it as plain data: ``conditions``, ``geometry``, ``seed``, ``wall_s``, ``simulated_s``, ``sound``."""
        return {
            "conditions": [row.to_json() for row in self.rows],
            "geometry": geometry_json(),
            "seed": self.seed,
            "wall_s": round(self.wall_s, 3),
            "simulated_s": round(self.simulated_s, 6),
            "sound": self.is_sound,
        }


def trials_line(outcome: SurveillanceOutcome) -> str:
    """Return the number of trials of each condition, and the seed."""
    counts = sorted({row.trials for row in outcome.rows})
    return f"{' or '.join(map(str, counts))} trials of each condition, seed {outcome.seed}"


def geometry_json() -> Mapping[str, object]:
    """Return the geometry of all conditions as plain data."""
    return {
        "room_m": list(geometry.ROOM_M),
        "path_m": [list(point) for point in geometry.PATH],
        "watchers_m": [list(point) for point in geometry.WATCHERS],
        "extras_m": [list(point) for point in geometry.EXTRAS],
        "looking_deg": 90.0,
        "view_deg": 40.0,
        "settling_s": geometry.SETTLING_S,
        "frame_rate_hz": geometry.FRAME_RATE_HZ,
        "passages": {
            name: {"speed_m_s": one.speed_m_s, "there_and_back": one.there_and_back, "lasts_s": one.lasts_s}
            for name, one in geometry.PASSAGES.items()
        },
    }


def run_surveillance(
    conditions: Sequence[Condition],
    *,
    trials: int = TRIALS,
    seed: int = 1,
    jobs: int = 0,
    progress: Progress | None = None,
    traces: Path | None = None,
) -> SurveillanceOutcome:
    """Run trials of each condition and return the results.

    Args:
        conditions: The conditions, in the order of the rows.
        trials: Number of trials of each condition, above 0.
        seed: Seed of the experiment; the same seed gives the same rows with any number of jobs.
        jobs: Processes; 0: one a core.
        traces: Folder for the schedule traces of all trials; None: no traces.
    """
    began_s = time.monotonic()
    orders = [
        TrialOrder(condition, seed, number, "" if traces is None else str(traces / f"{place:02}-{number:04}.jsonl"))
        for place, condition in enumerate(conditions)
        for number in range(trials)
    ]
    turns = sorted(range(len(orders)), key=lambda place: _room(orders[place]))
    rooms = [[orders[place] for place in room] for _, room in groupby(turns, lambda place: _room(orders[place]))]
    pieces: list[Piece] = [*rooms, *conditions]  # predictions come last: they are short, so no process is alone long
    done, rates = list[Trial](), list[float]()
    with closing(results_of(run_piece, pieces, jobs=jobs)) as outcomes:
        for outcome in outcomes:
            if isinstance(outcome, float):
                rates.append(outcome)
                continue
            for trial in outcome:
                done.append(trial)
                if progress is not None:
                    progress(len(done), len(orders))
    results = [trial for _, trial in sorted(zip(turns, done, strict=True), key=lambda placed: placed[0])]
    rows = [
        _row(condition, results[place * trials : (place + 1) * trials], rates[place])
        for place, condition in enumerate(conditions)
    ]
    return SurveillanceOutcome(seed, rows, time.monotonic() - began_s)


def run_order(order: TrialOrder) -> Trial:
    """Run one trial."""
    return run_trial(order.condition, order.seed, order.number, trace=Path(order.trace) if order.trace else None)


def run_piece(piece: Piece) -> list[Trial] | float:
    """Run the trials, or return the predicted share of detections."""
    return predicted(piece) if isinstance(piece, Condition) else [run_order(order) for order in piece]


def _room(order: TrialOrder) -> tuple[int, int, int, str]:
    """Return what is the same for trials with the same room."""
    condition = order.condition
    return order.number, condition.active, condition.extra, condition.target


def _row(condition: Condition, trials: Sequence[Trial], rate: float) -> ConditionRow:
    return ConditionRow(
        condition=condition,
        trials=len(trials),
        detected=sum(trial.detected for trial in trials),
        predicted=rate,
        false_alarms=sum(trial.false_alarms for trial in trials),
        switches=sum(trial.switches for trial in trials),
        disagreements=[f"trial {trial.number}: {said}" for trial in trials for said in trial.disagreements],
        jammed_frames=sum(trial.jammed_frames for trial in trials),
        stale_packets=sum(trial.stale_packets for trial in trials),
        simulated_s=sum(trial.simulated_s for trial in trials),
        digest=digest_of([trial.digest for trial in trials]),
    )


def digest_of(digests: Sequence[str]) -> str:
    """Return one hash of many."""
    return hashlib.sha256("".join(digests).encode()).hexdigest()
