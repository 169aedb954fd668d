"""Pose of a target: a pure function of time, so the target moves the same in every trial."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from scout_model.description import Target
from scout_model.dimensions import PERSON_HIP_M, PERSON_HIP_WIDTH_M, PERSON_STRIDE_M, PERSON_SWING_RAD

CARRIER = "carrier"
SHAPES = ("pioneer", "person", CARRIER)
LEGS = ("left_leg", "right_leg")


class TargetState(NamedTuple):
    """The state of a target at one time.

    Attributes:
        x_m: Position.
        y_m: Position.
        heading_rad: Direction of its present motion; at rest, of its last or next motion.
        walked_m: Way since the end of the path that it left last.
    """

    x_m: float
    y_m: float
    heading_rad: float
    walked_m: float


class PartPose(NamedTuple):
    """The pose of one of the bodies that form a target.

    Attributes:
        body: Name: the target's, or ``<target>/left_leg`` and ``<target>/right_leg`` of a person.
        position_m: Origin: on the floor; for a leg, in the hip.
        quaternion: Orientation, real part first.
    """

    body: str
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def path_length_m(path: list[tuple[float, float]]) -> float:
    """Return the length of the path through these points, metres."""
    return sum(math.dist(a, b) for a, b in pairwise(path))


class Route:
    """The route of one target, precomputed for many questions."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._there = _Path(target.path)
        self._back = _Path(target.path[::-1])
        self._lap_s = self._there.length_m / target.speed_m_s + target.rest_s
        self._first = self._there.along(0.0)
        self._path, self._pose = self._there, self._first  # of the last question; a resting target repeats

    def where(self, time_s: float) -> TargetState:
        """Return the target's pose at this world time; see ``where``."""
        target = self._target
        if time_s <= target.begin_s:
            return self._first
        lap, lap_elapsed_s = divmod(time_s - target.begin_s, self._lap_s)
        path = self._back if target.there_and_back and lap % 2 == 1 else self._there
        walked_m = min(path.length_m, lap_elapsed_s * target.speed_m_s)
        if path is not self._path or walked_m != self._pose.walked_m:
            self._path, self._pose = path, path.along(walked_m)
        return self._pose


def where(target: Target, time_s: float) -> TargetState:
    """Return the target's pose at this world time.

    Before ``begin_s`` the target stands at the first point. Then it moves to the last point and rests. With
    ``there_and_back`` it returns along the path and rests again; otherwise it appears at the first point at once.

    Example:
        >>> there = Target("p", "pioneer", [(0.0, 3.0), (9.0, 3.0)], speed_m_s=0.5, rest_s=2.0)
        >>> where(there, 4.0).x_m, where(there, 19.0).x_m, where(there, 21.0).x_m
        (2.0, 9.0, 8.5)
    """
    return Route(target).where(time_s)


def part_poses(target: Target, time_s: float) -> list[PartPose]:
    """Return the poses of all bodies of the target at this world time, always in the same order."""
    return parts(target, where(target, time_s))


def parts(target: Target, pose: TargetState) -> list[PartPose]:
    """Return the poses of all bodies of the target in this state, always in the same order."""
    bodies = [PartPose(target.name, (pose.x_m, pose.y_m, 0.0), _turned(pose.heading_rad, 0.0))]
    if target.shape == "person":
        swing_rad = PERSON_SWING_RAD * math.sin(2 * math.pi * pose.walked_m / PERSON_STRIDE_M)
        for leg, side in zip(LEGS, (1, -1), strict=True):
            across_m = side * PERSON_HIP_WIDTH_M / 2
            hip_m = (
                pose.x_m - across_m * math.sin(pose.heading_rad),
                pose.y_m + across_m * math.cos(pose.heading_rad),
                PERSON_HIP_M,
            )
            bodies.append(PartPose(f"{target.name}/{leg}", hip_m, _turned(pose.heading_rad, side * swing_rad)))
    return bodies


def _turned(heading_rad: float, pitch_rad: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation by pitch about y, then by heading about z."""
    c_heading, s_heading = math.cos(heading_rad / 2), math.sin(heading_rad / 2)
    c_pitch, s_pitch = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    return c_heading * c_pitch, -s_heading * s_pitch, c_heading * s_pitch, s_heading * c_pitch


class _Path:
    """Points joined by straight segments."""

    def __init__(self, points: list[tuple[float, float]]) -> None:
        segments = [(a, b) for a, b in pairwise(points) if a != b]
        if not segments:
            raise ValueError("a path needs two different points")
        lengths_m = [math.dist(a, b) for a, b in segments]
        self._segments = [
            (a, b, length_m, math.atan2(b[1] - a[1], b[0] - a[0]))
            for (a, b), length_m in zip(segments, lengths_m, strict=True)
        ]
        self.length_m = path_length_m(points)

    def along(self, walked_m: float) -> TargetState:
        """Return the place at this distance along the path from the first point."""
        left_m, last = walked_m, self._segments[-1]
        for segment in self._segments:
            if left_m <= segment[2] or segment is last:
                break
            left_m -= segment[2]
        a, b, length_m, heading_rad = segment
        share = min(1.0, left_m / length_m)
        return TargetState(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), heading_rad, walked_m)
