"""Patrol route: which way point is next, and how to get there from wherever the robot is.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.

Law: way points are reached in order and each once a round, whatever happens between two decisions. Only what is seen
while the robot is held counts, so the record of a patrol that was interrupted, also by a person who drove the robot
elsewhere, is that of one nobody disturbed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from mission_control.behaviors.motion import STILL, Maneuver, Motion, Place, Position, Watchdog, head_for, shake_free

REMEMBERED = 1000  # chosen: hours of an ordinary patrol
PATIENCE_S = 4.0  # chosen: turning round takes two seconds
LONGEST_STEP_S = 0.5  # chosen: between decisions that are further apart than this the robot stood or was not held
BACK_AT = 2.0  # chosen: tolerances beyond which a robot that was carried away during its rest drives back


@dataclass(frozen=True, slots=True)
class Visit:
    """A way point was reached.

    Attributes:
        number: Counts from 1 over all rounds.
        waypoint: Which one, from 0.
        at_s: Mission time.
    """

    number: int
    waypoint: int
    at_s: float


class PatrolRoute:
    """The state of a patrol.

    Args:
        places: Way points, in order; at least one.
        rounds: After so many it is over; 0: never.
        speed_m_s: On straight ways.
        reached_within_m: As near as this counts as reached.
        rest_s: So long it stays at each, of the time in which it is held.
    """

    def __init__(
        self, places: Sequence[Place], *, rounds: int, speed_m_s: float, reached_within_m: float, rest_s: float
    ) -> None:
        self._places = tuple(places)
        self._last = rounds * len(self._places) if rounds else math.inf
        self._speed_m_s, self._within_m, self._rest_s = speed_m_s, reached_within_m, rest_s
        self._visits: deque[Visit] = deque(maxlen=REMEMBERED)
        self._reached, self._freed = 0, 0
        self._resting_s = 0.0  # still to rest at the way point reached last
        self._decided_s: float | None = None
        self._watchdog = Watchdog(PATIENCE_S)
        self._freeing: Maneuver | None = None

    @property
    def visits(self) -> Sequence[Visit]:
        """The last ``REMEMBERED`` way points reached, oldest first."""
        return tuple(self._visits)

    def visits_since(self, number: int) -> Sequence[Visit]:
        """Return those remembered that came after the one of this number."""
        return tuple(visit for visit in self._visits if visit.number > number)

    @property
    def reached(self) -> int:
        """How many way points were reached, over all rounds."""
        return self._reached

    @property
    def freed(self) -> int:
        """How often it did not get on and was shaken free."""
        return self._freed

    @property
    def next_waypoint(self) -> int:
        """The way point it heads for, from 0."""
        return self._reached % len(self._places)

    @property
    def is_over(self) -> bool:
        """True when the last way point of the last round was reached and rested at."""
        return self._reached >= self._last and self._resting_s <= 0

    def interrupt(self) -> None:
        """Note that the robot is not held any more: wherever it is at the next decision, it goes on from there."""
        self._decided_s = self._freeing = None
        self._watchdog.rest()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return how to move now; note a way point that is reached.

        Args:
            position: Where the robot is now.
            now_s: Mission time, never before an earlier call's.
        """
        passed_s = 0.0 if self._decided_s is None else min(now_s - self._decided_s, LONGEST_STEP_S)
        self._decided_s = now_s
        if self._resting_s > 0:
            here = self._places[(self._reached - 1) % len(self._places)]
            if here.distance_m(position) > BACK_AT * self._within_m:
                return self._go(here, position, now_s)
            self._resting_s -= passed_s
            if self._resting_s > 0:
                return STILL
        if self.is_over:
            return STILL
        goal = self._places[self.next_waypoint]
        if goal.distance_m(position) > self._within_m:
            return self._go(goal, position, now_s)
        self._visits.append(Visit(self._reached + 1, self.next_waypoint, now_s))
        self._reached += 1
        self._resting_s = self._rest_s
        self._watchdog.rest()
        return STILL if self._rest_s or self.is_over else self._go(self._places[self.next_waypoint], position, now_s)

    def _go(self, goal: Place, position: Position, now_s: float) -> Motion:
        if self._freeing is None and self._watchdog.is_stuck(goal.distance_m(position), now_s):
            self._freeing = shake_free()
            self._freed += 1
        if self._freeing is not None:
            motion = self._freeing.motion(now_s)
            if motion is not None:
                return motion
            self._freeing = None
            self._watchdog.rest()
        return head_for(position, goal, self._speed_m_s)
