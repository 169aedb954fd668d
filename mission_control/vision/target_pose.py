"""Pose of the robot before the landmark, from the middles of the landmark's four discs.

Frame: origin on the floor under the middle of the board.  The zero-angle line leaves the board at a
right angle; ``ahead_m`` is measured along it.  A robot on it that faces the board has heading 0.

Three of the four discs lie on a line, so the usual homography cannot be computed. But a robot on a floor has only
position, heading and pitch, and eight coordinates determine them. From far away the target looks nearly the same from
both sides of the zero-angle line, so the fit starts from both.

Source: RAM 2002, "Visual Servoing": the robot shall reach a point on the zero-angle line of the target.
Method: chosen; Gauss-Newton least squares, as in Hartley and Zisserman, "Multiple View Geometry",
appendix 6, with the previously known pose, if any, as further equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mission_control.vision.landmark import DISCS_M, PITCH_M, Disc, Floats, Sighting

PIXEL_ERROR_PX = 0.25  # measured: a disc's centre on a link of 30 dB
PITCH_ERROR_RAD = math.radians(3.0)  # measured: tilt of the body at starts and stops
MOST_STEPS = 12  # chosen: 4 to 6 are enough from the starts used
_ENOUGH = 1e-5  # chosen: metres or radians; a hundredth of the relevant accuracy
_LEAST_SLANT_RAD = math.radians(12.0)  # chosen: keeps the two starts distinct on the zero-angle line
_LEAST_RANGE_M = 0.05  # chosen: nearer the camera touches the board


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A pinhole camera on a robot.

    Attributes:
        focal_px: Focal length in pixels.
        centre_px: Column and row of the optical axis.
        height_m: Above the floor.
        forward_m: Before the middle of the axle.
        tilt_rad: Upwards.
    """

    focal_px: float
    centre_px: tuple[float, float]
    height_m: float
    forward_m: float
    tilt_rad: float


SCOUT_CAMERA = CameraModel(
    focal_px=160 / math.tan(math.radians(20.0)),
    centre_px=(159.5, 119.5),
    height_m=0.026,
    forward_m=0.019,
    tilt_rad=math.radians(4.0),
)
"""The Scout's camera, at 320 × 240 pixels; a test compares it with the simulated one."""


@dataclass(frozen=True, slots=True, eq=False)
class TargetPose:
    """Estimate of the middle of the robot's axle, with its uncertainty.

    Attributes:
        ahead_m: Before the board.
        left_m: Left of the zero-angle line, for an observer who faces the board.
        heading_rad: 0: faces the board at a right angle; counter-clockwise is positive.
        pitch_rad: Upward rotation of the camera beyond its tilt.
        residual_px: Root mean square of the fit's residuals of the eight coordinates.
        covariance: Covariance of (ahead, left, heading, pitch), shape (4, 4).
    """

    ahead_m: float
    left_m: float
    heading_rad: float
    pitch_rad: float
    residual_px: float
    covariance: Floats

    @property
    def range_m(self) -> float:
        """Distance of the axle from the middle of the board."""
        return math.hypot(self.ahead_m, self.left_m)

    @property
    def off_axis_rad(self) -> float:
        """Angle at the board between the zero-angle line and the robot, positive on the left."""
        return math.atan2(self.left_m, self.ahead_m)

    @property
    def bearing_rad(self) -> float:
        """Bearing of the middle of the board from the axle: 0 straight ahead, positive to the left."""
        return math.remainder(-self.off_axis_rad - self.heading_rad, math.tau)

    def moved(self, forward_m: float, turn_rad: float) -> TargetPose:
        """Return the pose after the robot drove an arc, with the uncertainty of its wheels added.

        Args:
            forward_m: Way of its middle.
            turn_rad: Counter-clockwise is positive.
        """
        along_rad = self.heading_rad + turn_rad / 2
        ahead_m = self.ahead_m - forward_m * math.cos(along_rad)
        left_m = self.left_m + forward_m * math.sin(along_rad)
        change = np.eye(4)
        change[0, 2], change[1, 2] = forward_m * math.sin(along_rad), forward_m * math.cos(along_rad)
        change[3, 3] = 0.0
        way, turned = 0.1 * abs(forward_m) + 5e-4, 0.1 * abs(turn_rad) + 2e-3
        slip = np.diag([way**2, way**2, turned**2, PITCH_ERROR_RAD**2])
        covariance: Floats = change @ self.covariance @ change.T + slip
        heading_rad = math.remainder(self.heading_rad + turn_rad, math.tau)
        return TargetPose(ahead_m, left_m, heading_rad, 0.0, self.residual_px, covariance)


def discs_in_picture(
    ahead_m: float, left_m: float, heading_rad: float, pitch_rad: float = 0.0, camera: CameraModel = SCOUT_CAMERA
) -> Floats:
    """Return the places of the discs in the picture of a robot at this pose, as ``Sighting.blobs_px``.

    Raises:
        ValueError: A disc is not in front of the camera.
    """
    seen, depths = _project(np.array([ahead_m, left_m, heading_rad, pitch_rad]), camera)[:2]
    if float(depths.min()) < _LEAST_RANGE_M:
        raise ValueError(f"from ({ahead_m}, {left_m}) m, heading {heading_rad} rad, the board is not ahead")
    return seen


def estimate_poses(sighting: Sighting, camera: CameraModel = SCOUT_CAMERA) -> list[TargetPose]:
    """Return the poses that explain this sighting, the likeliest first.

    Args:
        sighting: Where its discs are.

    Returns:
        One or two poses; two if it could be seen from either side of the zero-angle line.  None if no
        place on the floor explains the sighting.
    """
    found: list[TargetPose] = []
    for side in (1.0, -1.0):
        pose = _fit(sighting.blobs_px, camera, _start(sighting, camera, side), None)
        if pose is not None and not any(abs(pose.left_m - other.left_m) < 0.01 for other in found):
            found.append(pose)
    return sorted(found, key=lambda pose: pose.residual_px)


def refine_pose(sighting: Sighting, before: TargetPose, camera: CameraModel = SCOUT_CAMERA) -> TargetPose | None:
    """Return the pose that explains both the sighting and the expected pose; None if there is no such pose.

    Args:
        sighting: Where its discs are.
        before: The pose expected without the sighting, see ``TargetPose.moved``.
    """
    start = np.array([before.ahead_m, before.left_m, before.heading_rad, before.pitch_rad])
    information: Floats = np.linalg.inv(before.covariance).astype(np.float64)
    return _fit(sighting.blobs_px, camera, start, information)


def _start(sighting: Sighting, camera: CameraModel, side: float) -> Floats:
    range_m = camera.focal_px * PITCH_M / max(sighting.pitch_px, 1.0)
    slant_rad = max(_LEAST_SLANT_RAD, math.acos(min(1.0, abs(float(sighting.across_px[0])) / sighting.pitch_px)))
    off_axis_rad = side * min(slant_rad, math.radians(75.0))
    column = float(sighting.blobs_px[Disc.MIDDLE][0])
    bearing_rad = math.atan2(camera.centre_px[0] - column, camera.focal_px)
    range_m += camera.forward_m
    return np.array(
        [range_m * math.cos(off_axis_rad), range_m * math.sin(off_axis_rad), -off_axis_rad - bearing_rad, 0.0]
    )


def _project(pose: Floats, camera: CameraModel) -> tuple[Floats, Floats, Floats]:
    """Return the discs in the picture, shape (4, 2), their depths, (4,), and the Jacobian, (4, 2, 4)."""
    ahead_m, left_m, heading_rad, pitch_rad = pose.tolist()
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    beside = DISCS_M[:, 0] - left_m
    forward = ahead_m * cos - camera.forward_m + beside * sin
    left = beside * cos - ahead_m * sin
    above = DISCS_M[:, 1] - camera.height_m
    up_cos, up_sin = math.cos(camera.tilt_rad + pitch_rad), math.sin(camera.tilt_rad + pitch_rad)
    depth = forward * up_cos + above * up_sin
    rise = above * up_cos - forward * up_sin
    scale = camera.focal_px / depth
    seen = np.stack([camera.centre_px[0] - scale * left, camera.centre_px[1] - scale * rise], axis=1)
    # Derivatives of forward and left by (ahead, left, heading); pitch converts depth into height.
    d_forward = np.stack([np.full(4, cos), np.full(4, -sin), left], axis=1)
    d_left = np.stack([np.full(4, -sin), np.full(4, -cos), -(forward + camera.forward_m)], axis=1)
    slopes = np.empty((4, 2, 4))
    over_depth = (scale / depth)[:, np.newaxis]
    slopes[:, 0, :3] = over_depth * (left[:, np.newaxis] * up_cos * d_forward) - scale[:, np.newaxis] * d_left
    slopes[:, 0, 3] = over_depth[:, 0] * left * rise
    slopes[:, 1, :3] = (over_depth * rise[:, np.newaxis] * up_cos + scale[:, np.newaxis] * up_sin) * d_forward
    slopes[:, 1, 3] = over_depth[:, 0] * rise * rise + camera.focal_px
    return seen, depth, slopes


def _fit(blobs_px: Floats, camera: CameraModel, start: Floats, information: Floats | None) -> TargetPose | None:
    """Return the pose of the least squares; None if the steps lead behind the board.

    Args:
        blobs_px: The discs' places in the picture.
        start: (ahead, left, heading, pitch); also the expected pose, weighted by ``information``.
        information: Inverse covariance of the expected pose; None expects nothing but a small pitch.
    """
    if information is None:
        information = np.diag([0.0, 0.0, 0.0, PITCH_ERROR_RAD**-2])
    pose, weight = start.copy(), PIXEL_ERROR_PX**-2
    for _ in range(MOST_STEPS):
        seen, depth, slopes = _project(pose, camera)
        if float(depth.min()) < _LEAST_RANGE_M:
            return None
        jacobian = slopes.reshape(8, 4)
        normal = weight * jacobian.T @ jacobian + information
        gradient = weight * jacobian.T @ (blobs_px - seen).ravel() - information @ (pose - start)
        step = np.linalg.solve(normal + np.diag(1e-9 * np.diag(normal)), gradient)
        # A long step leaves the region in which the derivatives are valid; far away, a third of the range is enough.
        longest = max(
            float(np.abs(step[:2]).max()) / (0.3 * max(abs(pose[0]), 0.2)), float(np.abs(step[2:]).max()) / 0.3
        )
        pose += step / max(1.0, longest)
        if float(np.abs(step).max()) < _ENOUGH:
            break
    seen, depth, slopes = _project(pose, camera)
    if float(depth.min()) < _LEAST_RANGE_M or pose[0] <= 0:
        return None
    jacobian = slopes.reshape(8, 4)
    covariance: Floats = np.linalg.inv(weight * jacobian.T @ jacobian + information).astype(np.float64)
    residual_px = math.sqrt(float(((blobs_px - seen) ** 2).mean()))
    ahead_m, left_m, heading_rad, pitch_rad = pose.tolist()
    return TargetPose(ahead_m, left_m, math.remainder(heading_rad, math.tau), pitch_rad, residual_px, covariance)
