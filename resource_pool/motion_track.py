"""Motion track: a robot's estimated pose that misses none of its motions. Pure; times are mission seconds.

Rules of this file:

* A robot's RC numbers the motions that it publishes, and keeps the last ones, also for its next process on the same
  host. If a number is left out, motions were lost on the way. Until they are recovered, later motions wait.
* Motions count at their own times, also those that arrive late or are recovered: the track goes back to the last motion
  before them, and adds them and all events since in the order of their times.
* If no RC has the motions of some time, the spread grows by the ways and turns that are likely in that time. If an RC
  has no record of its former process, this is the time from the last motion until that process left. A robot that was
  at rest before does not move in it. The time ends sooner if the robot's radio took no more packets that move it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

import msgspec

from resource_pool.commands import Halt, Jump
from resource_pool.dead_reckoning import Belief, DeadReckoning, Motion
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied
from resource_pool.published_motions import LastMove, Motions

UNSEEN_M_S = 0.2  # chosen: standard deviation of a speed of up to 0.35 m/s forward or backward
UNSEEN_RAD_S = 0.9  # chosen: same, of up to 1.5 rad/s
AT_REST_S = 3.0  # chosen: a driven robot has motions ten times a second, and a cut is seen after 2 s
SAME_S = 0.02  # chosen: a radio takes a packet some ms before its motion counts, and clocks of hosts differ
EVENTS_KEPT = 1000  # chosen: a minute of motions and sightings

Event = Callable[[DeadReckoning], None]
"""A call of ``DeadReckoning.counts`` or ``sighted``."""


class Known(msgspec.Struct, frozen=True):
    """What a track saves for its next process.

    Attributes:
        motion: The last motion; see ``DeadReckoning.motion``.
        number: Number of the last motion taken; 0: none.
        last_s: Time of this motion.
    """

    belief: Belief
    motion: Motion
    number: int
    last_s: float


class MotionTrack:
    """The track of one robot.

    Args:
        known: What is known of it so far.
    """

    def __init__(self, known: Known) -> None:
        self._known = known
        self._reckoning = DeadReckoning(known.belief, known.motion)
        self._number, self._last_s = known.number, known.last_s
        self._left_s = math.inf
        self._at_last = self._reckoning.copy()
        self._since: deque[tuple[float, Event]] = deque(maxlen=EVENTS_KEPT)
        self._waiting: deque[Applied] = deque(maxlen=EVENTS_KEPT)

    @property
    def last_s(self) -> float:
        """Time of the last motion taken."""
        return self._last_s

    @property
    def is_moving(self) -> bool:
        """True while the last motion has not ended, as of the last event or question."""
        return self._reckoning.is_moving

    @property
    def has_gap(self) -> bool:
        """True if motions were lost on the way and are not recovered."""
        return bool(self._waiting)

    def believe(self, now_s: float) -> Belief:
        """Return the belief for this time; see ``DeadReckoning.believe``."""
        return self._reckoning.believe(now_s)

    @property
    def known(self) -> Known:
        """What to save.

        It is as of the last event, because motions after it may be on the way: to a host that is cut off, or lost.
        """
        return self._known

    def moved(self, told: Applied) -> None:
        """Take a motion; if motions before it were lost, it waits for ``recover`` or ``give_up``.

        Args:
            told: Not from the future. The number 1 is the first motion of an RC that knows of no earlier one; 0 is one
                without a number.
        """
        if 0 < told.number <= self._number and told.at_s <= self._last_s:
            return  # recovered before it arrived
        if self._waiting or told.number not in (0, 1, self._number + 1):
            self._waiting.append(told)
        else:
            self._again([told], self._last_s)

    def happened(self, at_s: float, event: Event) -> None:
        """Take a count or a sighting."""
        event(self._reckoning)
        self._since.append((at_s, event))
        self._note()

    def rc_left(self, now_s: float) -> None:
        """Record that the RC's process left now, and that all of its motions were heard until then."""
        self._left_s = self._last_s if now_s - self._last_s > AT_REST_S else now_s

    def was_deaf(self) -> None:
        """Record that motions may have been missed, and that the process of the RC may have left at any time."""
        self._left_s = math.inf

    def recover(self, told: Motions) -> None:
        """Take the motions that were lost.

        Args:
            told: The RC's motions from ``last_s`` on.
        """
        is_same = not self._number or told.begun_s <= self._last_s
        number = self._number if is_same else 0
        lost = [one for one in told.motions if (one.at_s, one.number) > (self._last_s, number)]
        if lost and lost[0].number > number + 1:
            unseen_until_s = lost[0].at_s
        else:
            unseen_until_s = (
                self._last_s if is_same else min(told.begun_s, self._left_s, self._moved_until_s(told.before))
            )
        self._again(lost, unseen_until_s)

    def give_up(self) -> None:
        """Take the motions that wait, because the RC does not return those before them."""
        if self._waiting:
            self._again(list(self._waiting), self._waiting[0].at_s)

    def _again(self, motions: list[Applied], unseen_until_s: float) -> None:
        """Go back to the last motion, and play these motions and the events since."""
        events, waiting = sorted(self._since, key=lambda one: one[0]), list(self._waiting)
        self._reckoning = self._at_last.copy()
        self._since.clear()
        self._waiting.clear()
        if unseen_until_s > self._last_s:
            while events and events[0][0] <= unseen_until_s:
                self._unseen_until(events[0][0])
                self.happened(*events.pop(0))
            self._unseen_until(unseen_until_s)
            self._number, self._at_last = 0, self._reckoning.copy()
        for motion in motions:
            while events and events[0][0] <= motion.at_s:
                self.happened(*events.pop(0))
            self._take(motion)
        for event in events:
            self.happened(*event)
        for motion in waiting:
            if motion.at_s >= self._last_s:
                self.moved(motion)

    def _moved_until_s(self, before: LastMove | None) -> float:
        """Return until when a motion that was not heard may have moved the robot, as its radio knows it."""
        if before is None or before.since_s > self._last_s:
            return math.inf
        if before.at_s is None or before.at_s <= self._last_s + SAME_S:
            return self._last_s
        return before.at_s + 2 * COMMAND_TIMEOUT_S  # repeated by the radio, and obeyed, for so long each

    def _unseen_until(self, at_s: float) -> None:
        unseen_s = at_s - self._last_s
        if unseen_s > 0:
            self._reckoning.believe(at_s)
            self._reckoning.loses(UNSEEN_M_S * unseen_s, UNSEEN_RAD_S * unseen_s)
            self._last_s = at_s
            self._note()

    def _take(self, told: Applied) -> None:
        forward_m_s, turn_rad_s = told.values.get("forward_m_s"), told.values.get("turn_rad_s")
        if told.command == Halt.word():
            self._reckoning.moves(0.0, 0.0, told.at_s)
        elif told.command == Jump.word():
            self._reckoning.jumps(told.at_s)
        elif forward_m_s is not None and turn_rad_s is not None:
            self._reckoning.moves(forward_m_s, turn_rad_s, told.at_s)
        self._number, self._last_s = told.number, max(self._last_s, told.at_s)
        self._at_last = self._reckoning.copy()
        self._since.clear()
        self._note()

    def _note(self) -> None:
        """Note what to save, as of the event that was taken just now."""
        self._known = Known(self.believe(-math.inf), self._reckoning.motion, self._number, self._last_s)
