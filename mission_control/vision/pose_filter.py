"""Estimates the robot's pose from many pictures and odometry, with a hypothesis for each side of the zero-angle line.

Source: the extended Kalman filter as in Thrun, Burgard and Fox, "Probabilistic Robotics", section 3.3,
iterated, with one hypothesis for each side of the zero-angle line (same book, section 7.5).
"""

from __future__ import annotations

import math

from mission_control.vision.landmark import Sighting
from mission_control.vision.target_pose import PIXEL_ERROR_PX, TargetPose, estimate_poses, refine_pose

FORGETTING = 0.97  # chosen: one second of pictures decides between the two sides
REFUTED_PX = 1.0  # chosen: four times a disc's error; above it the pose no longer explains the sighting
REFUTATIONS = 5  # chosen: more than a burst of bad pictures spoils; a moved robot is found again in a sixth of a second
WORSE = 12.0  # chosen: in squared pixel errors; at this difference the other side is given up


class PoseFilter:
    """The robot's pose, from all sightings so far."""

    def __init__(self) -> None:
        self._hypotheses: list[tuple[TargetPose, float]] = []
        self._refuted = 0

    def forget(self) -> None:
        """Discard the pose, because the robot may have been moved."""
        self._hypotheses = []

    @property
    def spread_m(self) -> float:
        """Standard deviation of the place, or the distance to the place on the other side if that is larger."""
        if not self._hypotheses:
            return math.inf
        (best, _), *others = self._hypotheses
        of_fit_m = math.sqrt(max(0.0, float(best.covariance[0, 0] + best.covariance[1, 1])))
        return max(
            of_fit_m, *(math.hypot(pose.ahead_m - best.ahead_m, pose.left_m - best.left_m) for pose, _ in others), 0.0
        )

    def moved(self, forward_m: float, turn_rad: float) -> None:
        """Add the motion of the robot along an arc, counter-clockwise is positive."""
        self._hypotheses = [(pose.moved(forward_m, turn_rad), badness) for pose, badness in self._hypotheses]

    def saw(self, sighting: Sighting) -> TargetPose | None:
        """Add a sighting and return the likeliest pose.

        Returns:
            None if no place on the floor, or none near the known pose, explains the sighting. The known pose is given
            up only after ``REFUTATIONS`` contradicting sightings in a row.
        """
        kept = []
        for before, badness in self._hypotheses:
            pose = refine_pose(sighting, before)
            if pose is not None and pose.residual_px < REFUTED_PX:
                kept.append((pose, FORGETTING * badness + _squared(pose)))
        if not kept:
            self._refuted += 1
            if self._hypotheses and self._refuted < REFUTATIONS:
                return None
            kept = [(pose, _squared(pose)) for pose in estimate_poses(sighting)]
            kept = [(pose, badness) for pose, badness in kept if pose.residual_px < REFUTED_PX]
        self._refuted = 0
        kept.sort(key=lambda hypothesis: hypothesis[1])
        if len(kept) == 2:
            (best, badness), (other, worse) = kept
            if worse > badness + WORSE or (abs(best.left_m - other.left_m) < 0.01):
                kept = kept[:1]
        self._hypotheses = kept
        return kept[0][0] if kept else None


def _squared(pose: TargetPose) -> float:
    """Return the sum of the eight squared errors, in units of a disc's usual error."""
    return 8 * (pose.residual_px / PIXEL_ERROR_PX) ** 2
