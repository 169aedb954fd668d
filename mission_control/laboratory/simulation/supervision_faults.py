"""Injected faults of a supervised mission: processes, links and machines. Pure: the faults follow from a seed.

The id of a fault is its time and target, so a run can be repeated with a subset of its faults.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Literal

from mission_control.laboratory.simulation.operator_choices import (
    OperatorChange,
    OtherRules,
    RobotStop,
    draw_choices,
    draw_stops,
)
from mission_control.laboratory.simulation.shape import BRING_UP_S
from mission_control.laboratory.simulation.supervised_shape import SupervisedShape

SHORTEST_S, LONGEST_S = 0.1, 30.0  # durations of pauses and cuts
LONGEST_STARVED_S = 10.0  # chosen: longer than the time-outs of one and of five seconds
GAPS_S = (0.3, 1.0, 2.5)  # chosen: 20 other busy processes; a machine that swaps; a machine that almost hangs
MOST_FAULTS = 5  # chosen: a run with few faults is understandable; more faults hide the effect of each
END = Literal["killed", "politely"]


@dataclass(frozen=True, slots=True)
class _Sudden:
    """A fault of a target at one moment."""

    at_s: float
    target: str

    @property
    def over_s(self) -> float:
        """Mission time of its end; that of a successor is not known in advance."""
        return self.at_s


@dataclass(frozen=True, slots=True)
class _Lasting(_Sudden):
    lasts_s: float

    @property
    def over_s(self) -> float:
        """Mission time of its end."""
        return self.at_s + self.lasts_s


@dataclass(frozen=True, slots=True)
class Pause(_Lasting):
    """A process that is stopped as by SIGSTOP and continued.

    Attributes:
        target: A component in the process.
    """

    def __str__(self) -> str:
        return f"{self.target} is paused at {self.at_s:.3f} s for {self.lasts_s:.3f} s"


@dataclass(frozen=True, slots=True)
class End(_Sudden):
    """A process that ends.

    Attributes:
        target: A component in the process.
        how: As by SIGKILL, or in good order as by SIGTERM.
        again_after_s: Time from the fork of its successor until the successor ends in the same way; negative: the
            successor does not end.
    """

    how: END
    again_after_s: float = -1.0

    def __str__(self) -> str:
        word = "is killed" if self.how == "killed" else "ends politely"
        again = f", its successor {self.again_after_s:.3f} s after its fork" if self.again_after_s >= 0 else ""
        return f"{self.target} {word} at {self.at_s:.3f} s{again}"


@dataclass(frozen=True, slots=True)
class Cut(_Lasting):
    """A link that is cut and heals.

    Attributes:
        target: Component whose process is cut off, or host whose processes cannot reach the hub.
    """

    def __str__(self) -> str:
        return f"the link of {self.target} is cut at {self.at_s:.3f} s for {self.lasts_s:.3f} s"


@dataclass(frozen=True, slots=True)
class Starve(_Lasting):
    """A machine whose processes get a processor only for short moments.

    Attributes:
        gap_s: Time between two moments.
    """

    gap_s: float

    def __str__(self) -> str:
        return f"{self.target} is starved at {self.at_s:.3f} s for {self.lasts_s:.3f} s, gaps of {self.gap_s:g} s"


@dataclass(frozen=True, slots=True)
class Hostile(_Sudden):
    """A message with impossible numbers, under the address of a component that may send such a message.

    Attributes:
        number: Its number in ``hostile_numbers``.
    """

    number: int

    def __str__(self) -> str:
        return f"{self.target} hears hostile message {self.number} at {self.at_s:.3f} s"


SupervisionFault = Pause | End | Cut | Starve | Hostile | OtherRules | OperatorChange | RobotStop


def draw_supervision_faults(shape: SupervisedShape) -> list[SupervisionFault]:
    """Return the faults of this mission and its operators' choices, in order of time."""
    dice = Random(f"supervision {shape.seed}")
    found: list[SupervisionFault] = [*draw_choices(shape.pool, shape.groups()[-1]), *draw_stops(shape.pool)]
    found += [_draw(dice, shape) for _ in range(dice.randint(1, MOST_FAULTS))]
    return sorted(found, key=lambda fault: (fault.at_s, fault.target))


def _draw(dice: Random, shape: SupervisedShape) -> SupervisionFault:
    at_s = round(dice.uniform(BRING_UP_S, shape.pool.active_s), 6)
    target = dice.choice(dice.choice([group for group in shape.groups() if group]))
    match dice.choice(("pause", "pause", "end", "end", "cut", "starve", "hostile")):
        case "pause":
            return Pause(at_s, target, _lasts_s(dice, LONGEST_S))
        case "end":
            how: END = "killed" if dice.random() < 0.4 else "politely"
            again_s = round(dice.uniform(0.0, 0.3), 6) if dice.random() < 0.4 else -1.0
            return End(at_s, target, how, again_s)
        case "cut":
            whole_host = len(shape.hosts) > 1 and dice.random() < 0.5
            return Cut(at_s, dice.choice(shape.hosts[1:]) if whole_host else target, _lasts_s(dice, LONGEST_S))
        case "starve":
            return Starve(at_s, dice.choice(shape.hosts), _lasts_s(dice, LONGEST_STARVED_S), dice.choice(GAPS_S))
        case _:
            return Hostile(at_s, dice.choice(shape.hearers()), dice.randrange(10**6))


def _lasts_s(dice: Random, longest_s: float) -> float:
    """Draw a duration, short and long ones equally often: leases and time-outs are between 0.1 and 20 s."""
    return round(SHORTEST_S * math.exp(dice.uniform(0.0, math.log(longest_s / SHORTEST_S))), 6)


def storm_over_s(faults: Sequence[SupervisionFault]) -> float:
    """Return the end of the last fault; 0 without faults."""
    return max((fault.over_s for fault in faults), default=0.0)
