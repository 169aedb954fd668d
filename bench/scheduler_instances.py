"""Seeded fleets for ``scheduler.py``, and a schedule manager whose decisions are timed.

Many ARCs need two to four RCs each, in several shapes:

* ``uniform``: any RCs; with many ARCs nearly all of them form one group.
* ``cells``: robots in cells of eight RCs; no robot needs an RC of another cell: many small groups.
* ``hub``: every ARC needs one of a few RCs (a video frequency) beside its own: one big group with a bottleneck.
* ``tree``: as uniform, and the owners are in a behavior tree of three levels with priorities.
* ``radio``: as uniform, and one of the RCs is a radio shared by streams.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from time import perf_counter

from backbone.scheduling.events import Departed, Event, Freed, Instruction, Opened, RcKnown, Requested, Woken
from backbone.scheduling.requests import PathNode, RcUse, SchedulingRequest, Usage
from backbone.scheduling.schedule_manager import ScheduleManager

MISSION = "fleet"
SHAPES = ("uniform", "cells", "hub", "tree", "radio")
CONNECT_S, DISCONNECT_S = 0.3, 0.05  # the papers' picture settles; a radio packet stops a robot
SLICES_S = (4.0, 5.0, 6.0)  # around the papers' 5 s; different, so that slice ends do not coincide
CELL_RCS = 8  # chosen: two robots and their frequencies
RCS_OF_A_HUB = 20  # chosen: RCs for each RC that every ARC needs
RCS_OF_A_RADIO = 20  # chosen: RCs for each radio
LEVELS = 3
KINDS: dict[type[Event], str] = {
    Requested: "request",
    Departed: "release",
    Woken: "slice_end",
    Freed: "freed",
    Opened: "opened",
}


class TooSlow(Exception):
    """The wall time for this size is used up."""


@dataclass
class Stopwatch:
    """A schedule manager with the durations of its decisions.

    Attributes:
        ends_at: ``perf_counter`` value at which the measurement is abandoned.
        times_s: Kind of event → seconds, decision by decision.
    """

    manager: ScheduleManager
    ends_at: float
    times_s: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Decide, and record the duration.

        Raises:
            TooSlow: The wall time was used up before.
        """
        began = perf_counter()
        if began > self.ends_at:
            raise TooSlow
        told = self.manager.handle(event, now_s)
        self.times_s[KINDS.get(type(event), "other")].append(perf_counter() - began)
        return told


@dataclass(frozen=True)
class Fleet:
    """RCs, and a source of requests for them.

    Attributes:
        shape: A name in ``SHAPES``.
        rng: Source of all random choices.
    """

    shape: str
    rcs: Sequence[RcKnown]
    rng: Random

    def request(self, name: str) -> Requested:
        """Return the request of one more ARC."""
        uses = self._uses()
        request = SchedulingRequest(
            arc=name,
            owner=f"mission_control/owner-{name}",
            path=[PathNode(MISSION, 0), *self._place(name)],
            console=False,
            alternatives=[dict(uses)],
            minimum_runtime_s=self.rng.choice(SLICES_S),
        )
        return Requested(request, tuple(uses))

    def _place(self, name: str) -> list[PathNode]:
        if self.shape != "tree":
            return [PathNode(f"owner-{name}", 1)]
        squad, team = self.rng.randrange(10), self.rng.randrange(10)
        own = PathNode(f"owner-{name}", 1 + self.rng.randrange(LEVELS))
        return [PathNode(f"squad{squad}", 1 + squad % LEVELS), PathNode(f"team{team}", 1 + team % LEVELS), own]

    def _uses(self) -> Mapping[str, RcUse]:
        count = self.rng.randint(2, 4)
        units = [rc for rc in self.rcs if not rc.sharable]
        match self.shape:
            case "cells":
                cells = max(1, len(units) // CELL_RCS)
                cell = self.rng.randrange(cells)
                return _exclusive(self.rng.sample(units[cell::cells], count))
            case "hub":
                hubs = max(1, len(units) // RCS_OF_A_HUB)
                return _exclusive([self.rng.choice(units[:hubs]), *self.rng.sample(units[hubs:], count - 1)])
            case "radio":
                radio = self.rng.choice([rc for rc in self.rcs if rc.sharable])
                period_s = self.rng.choice([0.05, 0.1, 0.2])
                stream = Usage(period_s, period_s * self.rng.choice([0.02, 0.05, 0.1]), kind="drive")
                return {**_exclusive(self.rng.sample(units, count - 1)), radio.rc: RcUse([stream])}
            case _:
                return _exclusive(self.rng.sample(units, count))


def fleet(
    shape: str, rcs: int, seed: int, *, connect_s: float = CONNECT_S, disconnect_s: float = DISCONNECT_S
) -> Fleet:
    """Return a fleet of this shape with so many RCs."""
    radios = max(1, rcs // RCS_OF_A_RADIO) if shape == "radio" else 0
    return Fleet(
        shape,
        [
            RcKnown(f"rc{number}", "thing", number < radios, 1.0, connect_s, disconnect_s, True, 0)
            for number in range(rcs)
        ],
        Random(f"{shape} {rcs} {seed}"),
    )


def _exclusive(rcs: Sequence[RcKnown]) -> dict[str, RcUse]:
    return {rc.rc: RcUse() for rc in rcs}
