"""Injected faults of a pool mission: lost messages, hanging components, killed components.

Every fault has an id that does not depend on other faults: the id of a message is its sender, receiver, kind and number
of this kind. So a run can be repeated with a subset of its faults, to find the smallest set that breaks a law.

Pure: the faults follow from a seed or from a list.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from random import Random
from typing import Literal

from mission_control.laboratory.simulation.operator_choices import OperatorChange, OtherRules, RobotStop
from mission_control.laboratory.simulation.shape import BRING_UP_S, MissionShape

Effect = Literal["lost", "late", "doubled"]

LONGEST_DELAY_S = 2.5  # chosen: longer than a lease, so that a late message arrives after its time-out
LONGEST_HANG_S = 3.0  # chosen: longer than a lease
LONGEST_ABSENCE_S = 1.5  # chosen: a creator restarts at once the first time, and later each further time


@dataclass(frozen=True, slots=True)
class MessageFault:
    """A fault of one message.

    Attributes:
        message: Its id: sender, receiver, kind and number of this kind.
        effect: ``lost``, ``late`` or ``doubled``.
        by_s: Delay of a late message.
    """

    message: str
    effect: Effect
    by_s: float = 0.0

    def __str__(self) -> str:
        return f"{self.message} is {self.effect}{f' by {self.by_s:.3f} s' if self.effect == 'late' else ''}"


@dataclass(frozen=True, slots=True)
class KillFault:
    """The death of a component as by SIGKILL.

    Attributes:
        target: Name of the component.
        away_s: Time until its creator has restarted it, if the creator restarts it at all.
    """

    at_s: float
    target: str
    away_s: float

    def __str__(self) -> str:
        return f"{self.target} is killed at {self.at_s:.3f} s, back after {self.away_s:.3f} s"


@dataclass(frozen=True, slots=True)
class Hang:
    """A component that neither receives nor sends messages for a while; then all messages are delivered, in order.

    Attributes:
        target: Address of the component.
    """

    at_s: float
    target: str
    lasts_s: float

    def __str__(self) -> str:
        return f"{self.target} is cut off at {self.at_s:.3f} s for {self.lasts_s:.3f} s"


Moment = KillFault | Hang | OtherRules | OperatorChange | RobotStop
Fault = MessageFault | Moment


@dataclass(frozen=True, slots=True)
class Weather:
    """Shares and numbers of faults.

    Attributes:
        lost: Share of lost messages.
        late: Share of late messages.
        doubled: Share of doubled messages.
        kills: Number of killed components.
        hangs: Number of hanging components.
    """

    lost: float = 0.0
    late: float = 0.0
    doubled: float = 0.0
    kills: int = 0
    hangs: int = 0


CALM_WEATHER = Weather()


def draw_weather(seed: int) -> Weather:
    """Return the weather of this seed: only kills for some seeds, only network faults for some, all faults for most."""
    dice = Random(f"weather {seed}")
    kind = dice.choice(("kills", "network", "both", "both"))
    kills = dice.randint(1, 6) if kind != "network" else 0
    hangs = dice.choice((0, 0, 1, 2))
    if kind == "kills":
        return Weather(kills=kills)
    bad = dice.choice((0.002, 0.01, 0.03))
    return Weather(bad, bad, bad, kills, hangs)


def draw_moments(shape: MissionShape, weather: Weather) -> list[KillFault | Hang]:
    """Return the kills and hangs of this mission, in order of time."""
    dice = Random(f"moments {shape.seed}")
    rcs = [resource.name for resource in shape.resources]
    arcs = [owner.arc for owner in shape.owners]
    owners = [owner.name for owner in shape.owners]
    begin_s, end_s = BRING_UP_S, shape.active_s
    found: list[KillFault | Hang] = []
    for _ in range(weather.kills):
        target = dice.choice(dice.choice((["rc_manager"], rcs, arcs, owners)))
        found.append(KillFault(_moment(dice, begin_s, end_s), target, round(dice.uniform(0.05, LONGEST_ABSENCE_S), 3)))
    for _ in range(weather.hangs):
        target = dice.choice(dice.choice((["rc_manager"], rcs, arcs, owners)))
        found.append(Hang(_moment(dice, begin_s, end_s), target, round(dice.uniform(0.2, LONGEST_HANG_S), 3)))
    return sorted(found, key=lambda fault: (fault.at_s, fault.target))


def _moment(dice: Random, begin_s: float, end_s: float) -> float:
    return round(dice.uniform(begin_s, end_s), 6)


class DrawnFates:
    """Decides on each message only from the seed and the message's id."""

    def __init__(self, seed: int, weather: Weather) -> None:
        self._key = f"fate {seed}".encode()
        self._lost = weather.lost
        self._late = weather.lost + weather.late
        self._doubled = weather.lost + weather.late + weather.doubled

    def fate(self, message: str) -> MessageFault | None:
        """Return the fault of this message; None: it arrives."""
        if not self._doubled:
            return None
        digest = hashlib.blake2b(message.encode(), digest_size=16, key=self._key).digest()
        share = int.from_bytes(digest[:8], "big") / 2.0**64
        if share < self._lost:
            return MessageFault(message, "lost")
        if share < self._late:
            part = int.from_bytes(digest[8:], "big") / 2.0**64
            return MessageFault(message, "late", round(LONGEST_DELAY_S * part**3, 6))  # mostly by a short time
        return MessageFault(message, "doubled") if share < self._doubled else None


class GivenFates:
    """Injects exactly the faults of a list."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = {fault.message: fault for fault in faults if isinstance(fault, MessageFault)}

    def fate(self, message: str) -> MessageFault | None:
        """Return the fault of this message; None: it arrives."""
        return self._faults.get(message)


Fates = DrawnFates | GivenFates
