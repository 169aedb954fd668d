"""From pictures to commands: tracker, pose and servo law in one; what a behavior holds.

Source: RAM 2002, "Visual Servoing".
"""

from __future__ import annotations

from dataclasses import dataclass

from mission_control.vision.landmark import Picture
from mission_control.vision.servo_law import Command, Stage
from mission_control.vision.skeleton_tracking import Track
from mission_control.vision.target_pose import SCOUT_CAMERA, CameraModel, TargetPose


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What one picture led to.

    Attributes:
        command: What the robot shall do now.
        stage: Of the approach.
        track: What the tracker said.
        pose: Where the robot stands, None as long as nobody knows.
    """

    command: Command
    stage: Stage
    track: Track
    pose: TargetPose | None


class VisualServo:
    """Brings a robot to its place before the landmark.

    Args:
        camera: Of the robot.
        stop_m: Distance of the place from the board, along the zero-angle line.

    Raises:
        ValueError: From ``stop_m`` away the landmark does not fit into the picture, or is too small.
    """

    def __init__(self, camera: CameraModel = SCOUT_CAMERA, stop_m: float = 0.45) -> None:
        raise NotImplementedError

    def see(self, frame: Picture, elapsed_s: float) -> Step:
        """Return what to do after this picture.

        Args:
            frame: Grey levels 0 to 255, shape (240, 320), row 0 on top.
            elapsed_s: Since the picture before, 0 for the first.

        Raises:
            ValueError: It is no grey picture, or time runs backwards.
        """
        raise NotImplementedError

    def resumed(self) -> None:
        """Begin again with acquisition, the robot standing still; what is known of the approach is kept."""
        raise NotImplementedError
