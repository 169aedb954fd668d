"""What goes wrong on purpose: which message gets lost, who hangs, who is killed, and when.

Every fault has an identity that does not depend on the others: a message is known by who said it to
whom and as the how-manieth of its kind. So a run can be repeated with some of its faults only, and the
smallest set that still breaks a law can be looked for.

Pure: a seed gives the faults, or a list does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from random import Random
from typing import Literal

from resource_pool.simulation.shape import BRING_UP_S, MissionShape

Effect = Literal["lost", "late", "doubled"]

LONGEST_DELAY_S = 2.5  # chosen: longer than a lease, so that what comes late has long been given up
LONGEST_HANG_S = 3.0  # chosen: longer than a lease
LONGEST_ABSENCE_S = 1.5  # chosen: a creator restarts at once, and later each time


@dataclass(frozen=True, slots=True)
class MessageFault:
    """A message that does not arrive as it should.

    Attributes:
        message: Its identity: who said it to whom, what, and the how-manieth of these it is.
        effect: What becomes of it.
        by_s: Of one that is late: by how much.
    """

    message: str
    effect: Effect
    by_s: float = 0.0

    def __str__(self) -> str:
        return f"{self.message} is {self.effect}{f' by {self.by_s:.3f} s' if self.effect == 'late' else ''}"


@dataclass(frozen=True, slots=True)
class Kill:
    """A component that dies as by SIGKILL.

    Attributes:
        at_s: When.
        target: Name of the component.
        away_s: Time until its creator has it running again, if it does.
    """

    at_s: float
    target: str
    away_s: float

    def __str__(self) -> str:
        return f"{self.target} is killed at {self.at_s:.3f} s, back after {self.away_s:.3f} s"


@dataclass(frozen=True, slots=True)
class Hang:
    """A component that for a while gets nothing and nothing gets away from it; then everything, in order.

    Attributes:
        at_s: When it begins.
        target: Address of the component.
        lasts_s: How long.
    """

    at_s: float
    target: str
    lasts_s: float

    def __str__(self) -> str:
        return f"{self.target} is cut off at {self.at_s:.3f} s for {self.lasts_s:.3f} s"


Fault = MessageFault | Kill | Hang


@dataclass(frozen=True, slots=True)
class Weather:
    """How bad it is.

    Attributes:
        lost: Share of messages that get lost.
        late: Share that come late.
        doubled: Share that come twice.
        kills: How many components are killed.
        hangs: How many are cut off.
    """

    lost: float = 0.0
    late: float = 0.0
    doubled: float = 0.0
    kills: int = 0
    hangs: int = 0


CALM_WEATHER = Weather()


def draw_weather(seed: int) -> Weather:
    """Return the weather of this seed: of some seeds only kills, of some only the network, of most everything."""
    dice = Random(f"weather {seed}")
    kind = dice.choice(("kills", "network", "both", "both"))
    kills = dice.randint(1, 6) if kind != "network" else 0
    hangs = dice.choice((0, 0, 1, 2))
    if kind == "kills":
        return Weather(kills=kills)
    bad = dice.choice((0.002, 0.01, 0.03))
    return Weather(bad, bad, bad, kills, hangs)


def draw_moments(shape: MissionShape, weather: Weather) -> list[Kill | Hang]:
    """Return who is killed and who hangs in this mission, in order of time."""
    dice = Random(f"moments {shape.seed}")
    rcs = [resource.name for resource in shape.resources]
    arcs = [owner.arc for owner in shape.owners]
    owners = [owner.name for owner in shape.owners]
    begin_s, end_s = BRING_UP_S, shape.active_s
    found: list[Kill | Hang] = []
    for _ in range(weather.kills):
        target = dice.choice(dice.choice((["rc_manager"], rcs, arcs, owners)))
        found.append(Kill(_moment(dice, begin_s, end_s), target, round(dice.uniform(0.05, LONGEST_ABSENCE_S), 3)))
    for _ in range(weather.hangs):
        target = dice.choice(dice.choice((["rc_manager"], rcs, arcs, owners)))
        found.append(Hang(_moment(dice, begin_s, end_s), target, round(dice.uniform(0.2, LONGEST_HANG_S), 3)))
    return sorted(found, key=lambda fault: (fault.at_s, fault.target))


def _moment(dice: Random, begin_s: float, end_s: float) -> float:
    return round(dice.uniform(begin_s, end_s), 6)


class DrawnFates:
    """Decides on each message from the seed and the message's identity alone."""

    def __init__(self, seed: int, weather: Weather) -> None:
        self._key = f"fate {seed}".encode()
        self._lost = weather.lost
        self._late = weather.lost + weather.late
        self._doubled = weather.lost + weather.late + weather.doubled

    def fate(self, message: str) -> MessageFault | None:
        """Return what becomes of this message; None: it arrives as it should."""
        if not self._doubled:
            return None
        digest = hashlib.blake2b(message.encode(), digest_size=16, key=self._key).digest()
        share = int.from_bytes(digest[:8], "big") / 2.0**64
        if share < self._lost:
            return MessageFault(message, "lost")
        if share < self._late:
            part = int.from_bytes(digest[8:], "big") / 2.0**64
            return MessageFault(message, "late", round(LONGEST_DELAY_S * part**3, 6))  # mostly by little
        return MessageFault(message, "doubled") if share < self._doubled else None


class GivenFates:
    """Lets happen what a list says and nothing else."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = {fault.message: fault for fault in faults if isinstance(fault, MessageFault)}

    def fate(self, message: str) -> MessageFault | None:
        """Return what becomes of this message; None: it arrives as it should."""
        return self._faults.get(message)


Fates = DrawnFates | GivenFates
