"""Patrol route: the next way point, and the motion towards it from any position.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.

Law: way points are reached in order, each once a round, whatever happens between two decisions. Only positions during
grants count. So an interrupted patrol has the same record as an undisturbed one, even if a person drove the robot
elsewhere meanwhile.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from mission_control.behaviors.motion import STILL, FloorPoint, Motion, Position, Pursuit

REMEMBERED = 1000  # chosen: hours of an ordinary patrol
LONGEST_STEP_S = 0.5  # chosen: if decisions are further apart, the robot stood still or was not granted
BACK_AT = 2.0  # chosen: tolerances; a robot that was carried farther away during its rest drives back


@dataclass(frozen=True, slots=True)
class Visit:
    """An arrival at a way point.

    Attributes:
        number: Counts from 1 over all rounds.
        waypoint: Number of the way point, from 0.
    """

    number: int
    waypoint: int
    at_s: float


class PatrolRoute:
    """The state of a patrol.

    Args:
        places: Way points, in order; at least one.
        rounds: Number of rounds; 0: endless.
        speed_m_s: Speed on straight ways.
        reached_within_m: Distance that counts as reached.
        rest_s: Time at each way point; only time of grants counts.
    """

    def __init__(
        self, places: Sequence[FloorPoint], *, rounds: int, speed_m_s: float, reached_within_m: float, rest_s: float
    ) -> None:
        self._places = tuple(places)
        self._last = rounds * len(self._places) if rounds else math.inf
        self._within_m, self._rest_s = reached_within_m, rest_s
        self._visits: deque[Visit] = deque(maxlen=REMEMBERED)
        self.reached = 0
        """Number of arrivals, over all rounds."""
        self._resting_s = 0.0  # remaining rest at the last way point
        self._decided_s: float | None = None
        self._pursuit = Pursuit(speed_m_s)

    def visits_since(self, number: int) -> Sequence[Visit]:
        """Return the kept arrivals after this number."""
        return tuple(visit for visit in self._visits if visit.number > number)

    @property
    def freed(self) -> int:
        """Number of times that a stuck robot was shaken free."""
        return self._pursuit.freed

    @property
    def next_waypoint(self) -> int:
        """Number of the next way point, from 0."""
        return self.reached % len(self._places)

    @property
    def is_over(self) -> bool:
        """True after the rest at the last way point of the last round."""
        return self.reached >= self._last and self._resting_s <= 0

    def interrupt(self) -> None:
        """Record the loss of the robot; the next decision continues from its position then."""
        self._decided_s = None
        self._pursuit.interrupt()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return the next motion; record a way point that is reached.

        Args:
            now_s: Mission time; it never decreases.
        """
        passed_s = 0.0 if self._decided_s is None else min(now_s - self._decided_s, LONGEST_STEP_S)
        self._decided_s = now_s
        if self._resting_s > 0:
            here = self._places[(self.reached - 1) % len(self._places)]
            if here.distance_m(position) > BACK_AT * self._within_m:
                return self._pursuit.go(here, position, now_s)
            self._pursuit.rest()
            self._resting_s -= passed_s
            if self._resting_s > 0:
                return STILL
        if self.is_over:
            return STILL
        goal = self._places[self.next_waypoint]
        if goal.distance_m(position) > self._within_m:
            return self._pursuit.go(goal, position, now_s)
        self._visits.append(Visit(self.reached + 1, self.next_waypoint, now_s))
        self.reached += 1
        self._resting_s = self._rest_s
        self._pursuit.rest()
        if self._rest_s or self.is_over:
            return STILL
        return self._pursuit.go(self._places[self.next_waypoint], position, now_s)
