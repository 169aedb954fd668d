"""Dead reckoning: estimates one robot's pose from the motions that it carried out since a known place.

Rules of this file: no bus, no clock. Events and mission time go in; pose estimates ("beliefs") come out.

* A motion lasts until the next one, but at most ``COMMAND_TIMEOUT_S``, because robots then stop by themselves. If a
  robot measures its own way (odometry), its count replaces the commanded way.
* The spread grows with way and turns. It shrinks only when a landmark is sighted, because the sighting replaces the
  belief. By the model in ``doubt`` the error may shrink on a way back; the published spread does not.
* Impossible numbers are ignored; time never runs backwards.

Source: Borenstein, Everett and Feng, "Where am I?", 1996, chapter 1: odometry "is fundamentally the integration of
incremental motion information over time, which leads inevitably to the accumulation of errors".
"""

from __future__ import annotations

import math
from collections import deque
from copy import copy
from dataclasses import dataclass, replace

from resource_pool.doubt import Doubt
from resource_pool.localization import PoseSource
from resource_pool.messages import COMMAND_TIMEOUT_S

LEAST_SHARE = 0.01  # chosen: of the way; the spread grows by at least this share, also on a way back
JUMP_M = 0.5  # chosen: farther than a Scout's jump over 30 cm leads
JUMP_RAD = math.pi / 2  # chosen: the robot lands on its wheels, but turned
ROUND_M = 0.01  # chosen: resolution of a count
ROUND_RAD = 0.02  # chosen: same
COASTS_M = 0.3  # chosen: most robots coast less after their last command, or are pushed less by hand
COASTS_RAD = 1.0  # chosen: same
FASTEST_M_S = 5.0  # chosen: faster than any indoor robot; an odometer with a larger step has been reset
MOST_RAD_S = 50.0  # chosen: faster than any indoor robot turns
FARTHEST_M = 1e6  # the limit of ``Meters``
REMEMBERED_S = 1.0  # chosen: a landmark is found at most a third of a second after its picture was taken
REMEMBERED = 128  # chosen: twice as many motions as arrive in that time
SIGHT_LASTS_S = 1.0  # chosen: while a robot sees a landmark, sightings arrive several times a second

Motion = tuple[float, float, float]
"""Forward m/s, turn rad/s, and the mission time at which the motion ends by itself."""
STILL: Motion = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class FloorPose:
    """A place on the floor with a heading: meters, radians from -pi to pi."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0

    def moved(self, way_m: float, turned_rad: float) -> FloorPose:
        """Return the pose after a way along an arc that turns by this angle, to the left if positive."""
        half_rad = turned_rad / 2
        chord_m = way_m * (math.sin(half_rad) / half_rad if abs(half_rad) > 1e-6 else 1.0)
        along_rad = self.heading_rad + half_rad
        return FloorPose(
            _within(self.x_m + chord_m * math.cos(along_rad), FARTHEST_M),
            _within(self.y_m + chord_m * math.sin(along_rad), FARTHEST_M),
            _turned(self.heading_rad + turned_rad),
        )

    def after(self, begin: FloorPose, end: FloorPose) -> FloorPose:
        """Return the pose reached from here by the same motion that leads from ``begin`` to ``end``."""
        angle_rad = self.heading_rad - begin.heading_rad
        x_m, y_m = end.x_m - begin.x_m, end.y_m - begin.y_m
        return FloorPose(
            _within(self.x_m + x_m * math.cos(angle_rad) - y_m * math.sin(angle_rad), FARTHEST_M),
            _within(self.y_m + x_m * math.sin(angle_rad) + y_m * math.cos(angle_rad), FARTHEST_M),
            _turned(end.heading_rad + angle_rad),
        )

    def distance_m(self, other: FloorPose) -> float:
        """Return the distance between the two places."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)

    @property
    def is_finite(self) -> bool:
        """True if every coordinate is finite and within the limit of ``Meters``."""
        return _are_sane(FARTHEST_M, self.x_m, self.y_m, self.heading_rad)


@dataclass(frozen=True, slots=True)
class Belief:
    """The estimated pose of a robot.

    Attributes:
        at_s: Mission time for which it holds.
        spread_m: Standard deviation of the place.
        spread_rad: Standard deviation of the heading, at most pi; pi: the heading is unknown.
        source: Kind of the newest evidence for it.
    """

    pose: FloorPose
    at_s: float
    spread_m: float
    spread_rad: float
    source: PoseSource = PoseSource.DEAD_RECKONING


class DeadReckoning:
    """The belief about one robot.

    Args:
        begin: The first belief; finite.
        motion: The motion in progress; see ``motion``.
    """

    def __init__(self, begin: Belief, motion: Motion = STILL) -> None:
        self._belief = begin
        self._doubt = Doubt.of(begin.spread_m, begin.spread_rad)
        self._moves, self._until_s = motion[:2], motion[2]
        self._count: tuple[float, float, float] | None = None  # its own count: way, turn, mission time
        self._counted_from = (begin, self._doubt)
        self._commanded: tuple[float, float] | None = (0.0, 0.0)  # way and turn since the last count; None: unknown
        self._sighted_s = -math.inf
        self._past = deque([(begin.at_s, begin.pose)], maxlen=REMEMBERED)

    def copy(self) -> DeadReckoning:
        """Return an independent copy."""
        twin = copy(self)
        twin._past = self._past.copy()  # noqa: SLF001  of this class
        return twin

    @property
    def motion(self) -> Motion:
        """The last motion: its speeds, and the mission time at which it ends by itself."""
        return (*self._moves, self._until_s)

    @property
    def is_moving(self) -> bool:
        """True while the last motion has not ended, as of the last event or question."""
        return any(self._moves) and self._belief.at_s < self._until_s

    def believe(self, now_s: float) -> Belief:
        """Return the belief for this time; a time before the last event counts as the time of that event."""
        self._advance(now_s)
        return self._belief

    def moves(self, forward_m_s: float, turn_rad_s: float, at_s: float) -> None:
        """Record that the robot moves at these speeds from now on, for at most ``COMMAND_TIMEOUT_S``."""
        if not (_are_sane(FASTEST_M_S, forward_m_s) and _are_sane(MOST_RAD_S, turn_rad_s)):
            return
        self._advance(at_s)
        self._moves, self._until_s = (forward_m_s, turn_rad_s), self._belief.at_s + COMMAND_TIMEOUT_S

    def jumps(self, at_s: float) -> None:
        """Record a jump: the robot leaves the floor and lands somewhere near."""
        self.moves(0.0, 0.0, at_s)
        self.loses(JUMP_M, JUMP_RAD)

    def loses(self, spread_m: float, spread_rad: float) -> None:
        """Record that something moved the robot: add an independent error with these standard deviations."""
        self._doubt = self._doubt.larger(spread_m, spread_rad)
        self._widen(math.hypot(self._belief.spread_m, spread_m), math.hypot(self._belief.spread_rad, spread_rad))
        self._commanded = None
        if self._count is not None:
            self._counted_from = (self._belief, self._doubt)

    def counts(self, way_m: float, turned_rad: float, at_s: float) -> None:
        """Use the robot's own count of way and turn since power-on instead of the commanded motion.

        The first count, the first count after a sighting, and an impossible count begin a new series. But if the first
        count is not larger than the way commanded since the begin, the robot has counted since the begin. A later count
        begins a new series, too, if only a count that began at 0 again explains it: the robot, or the RC that counts
        for it, has restarted.
        """
        if not _are_sane(FARTHEST_M, way_m, turned_rad):
            return
        self._advance(at_s)
        now, before = self._belief, self._count
        if self._commanded is not None:
            way, turn = self._commanded
            may_be_from_0 = abs(way_m) <= way + ROUND_M and abs(turned_rad) <= turn + ROUND_RAD
            if before is None:
                before = (0.0, 0.0, self._counted_from[0].at_s) if may_be_from_0 else None
            elif abs(way_m - before[0]) > way + COASTS_M or abs(turned_rad - before[1]) > turn + COASTS_RAD:
                before = None if may_be_from_0 else before
        self._commanded = (0.0, 0.0)
        if before is not None:
            way_m_since, turned_since, passed_s = way_m - before[0], turned_rad - before[1], now.at_s - before[2]
            may_s = passed_s + COMMAND_TIMEOUT_S
            if abs(way_m_since) <= FASTEST_M_S * may_s and abs(turned_since) <= MOST_RAD_S * may_s:
                self._belief, self._doubt = self._counted_from
                self._go(way_m_since, turned_since, now.at_s)
                self._widen(now.spread_m, now.spread_rad)
                self._belief = replace(self._belief, source=now.source)
                self._remember()
        self._count, self._counted_from = (way_m, turned_rad, now.at_s), (self._belief, self._doubt)

    def sighted(self, pose: FloorPose, spread_m: float, spread_rad: float, at_s: float) -> None:
        """Replace the belief by the pose that a landmark showed at ``at_s``, plus the motion since then.

        A sighting older than ``REMEMBERED_S`` is ignored.

        Args:
            at_s: Mission time of the picture, at most the present.
        """
        now = self._belief
        fits = pose.is_finite and _are_sane(FARTHEST_M, spread_m, spread_rad) and min(spread_m, spread_rad) >= 0
        if not fits or not now.at_s - REMEMBERED_S <= at_s < math.inf:
            return
        self._advance(at_s)
        now, then = self._belief, self._at(at_s)
        seen = pose.after(then, now.pose)
        self._belief = Belief(seen, now.at_s, spread_m, min(math.pi, spread_rad), PoseSource.LANDMARK)
        self._doubt = Doubt.of(self._belief.spread_m, self._belief.spread_rad)
        self._count, self._commanded, self._sighted_s = None, None, now.at_s
        self._past.clear()
        self._remember()

    def _go(self, way_m: float, turned_rad: float, at_s: float) -> None:
        """Add a way along an arc."""
        before = self._belief
        pose, way, turn = before.pose.moved(way_m, turned_rad), abs(way_m), abs(turned_rad)
        doubted_rad2 = self._doubt.hh
        self._doubt = self._doubt.moved(pose.x_m - before.pose.x_m, pose.y_m - before.pose.y_m, way, turn)
        self._belief = replace(before, pose=pose, at_s=at_s)
        spread_m = max(before.spread_m + LEAST_SHARE * way, self._doubt.spread_m)
        self._widen(spread_m, math.sqrt(before.spread_rad**2 + self._doubt.hh - doubted_rad2))

    def _widen(self, spread_m: float, spread_rad: float) -> None:
        """Raise the spreads to at least these values."""
        now = self._belief
        self._belief = replace(
            now,
            spread_m=min(FARTHEST_M, max(now.spread_m, spread_m)),
            spread_rad=min(math.pi, max(now.spread_rad, spread_rad)),
        )

    def _advance(self, now_s: float) -> None:
        before = self._belief
        if not before.at_s < now_s < math.inf:
            return
        lasted_s = max(0.0, min(now_s, self._until_s) - before.at_s)
        forward_m_s, turn_rad_s = self._moves
        way_m, turned_rad = forward_m_s * lasted_s, turn_rad_s * lasted_s
        self._go(way_m, turned_rad, now_s)
        if self._commanded is not None:
            self._commanded = (self._commanded[0] + abs(way_m), self._commanded[1] + abs(turned_rad))
        if now_s - self._sighted_s > SIGHT_LASTS_S and any(self._moves) and lasted_s:
            self._belief = replace(self._belief, source=PoseSource.DEAD_RECKONING)
        if now_s >= self._until_s:
            self._moves = (0.0, 0.0)
        self._remember()

    def _remember(self) -> None:
        now = self._belief
        if self._past and self._past[-1][0] == now.at_s:
            self._past.pop()  # a sighting has corrected the belief
        self._past.append((now.at_s, now.pose))
        while len(self._past) > 2 and self._past[1][0] <= now.at_s - REMEMBERED_S:
            self._past.popleft()

    def _at(self, at_s: float) -> FloorPose:
        """Return the pose believed for a past time, interpolated between the two nearest recorded poses."""
        before_s, before = self._past[0]
        for after_s, after in self._past:
            if after_s >= at_s:
                share = (at_s - before_s) / (after_s - before_s) if after_s > before_s else 1.0
                share = min(1.0, max(0.0, share))
                return FloorPose(
                    before.x_m + share * (after.x_m - before.x_m),
                    before.y_m + share * (after.y_m - before.y_m),
                    before.heading_rad + share * _turned(after.heading_rad - before.heading_rad),
                )
            before_s, before = after_s, after
        return before


def _are_sane(most: float, *numbers: float) -> bool:
    """Return whether all numbers are finite and within this limit."""
    return all(abs(number) <= most for number in numbers)


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))


def _turned(angle_rad: float) -> float:
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))
