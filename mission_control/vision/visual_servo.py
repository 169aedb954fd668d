"""Visual servo: combines tracker, pose and servo law, so that pictures go in and commands come out.

Source: RAM 2002, "Visual Servoing".
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from mission_control.vision.landmark import Picture
from mission_control.vision.pose_filter import PoseFilter
from mission_control.vision.servo_law import STOP_M, Approach, SpeedCommand, Stage
from mission_control.vision.skeleton_tracking import TargetTracker, Track
from mission_control.vision.target_pose import TargetPose

LATENCY_S = 0.1  # chosen: from a frame's capture until its command turns the wheels, on one machine
NEAREST_STOP_M, FARTHEST_STOP_M = 0.40, 1.2  # measured: nearer, the T leaves the picture; farther, the line is unsure
LONGEST_GAP_S = 0.5  # chosen: the robots' own watchdog has stopped the wheels by then


@dataclass(frozen=True, slots=True, eq=False)
class ServoStep:
    """The decision from one picture.

    Attributes:
        track: Result of the tracker.
        pose: Pose of the robot; None while the target is not in sight.
    """

    command: SpeedCommand
    stage: Stage
    track: Track
    pose: TargetPose | None


class VisualServo:
    """Brings a robot to its place before the landmark.

    Args:
        stop_m: Distance of the place from the board, along the zero-angle line.
        latency_s: Time from a frame's capture until its command turns the wheels.

    Raises:
        ValueError: From ``stop_m`` away the landmark does not fit into the picture, or is too small.
    """

    def __init__(self, stop_m: float = STOP_M, latency_s: float = LATENCY_S) -> None:
        if not NEAREST_STOP_M <= stop_m <= FARTHEST_STOP_M:
            raise ValueError(f"stop {NEAREST_STOP_M} to {FARTHEST_STOP_M} m before the board, not {stop_m} m")
        if not 0 <= latency_s < LONGEST_GAP_S:
            raise ValueError(f"a latency of {latency_s} s is not within 0 to {LONGEST_GAP_S} s")
        self.tracker = TargetTracker()
        """The tracker; debug views show its models."""
        self._filter = PoseFilter()
        self._approach = Approach(stop_m)
        self._latency_s = latency_s
        self._sent: deque[tuple[float, SpeedCommand]] = deque()
        self._now_s = 0.0
        self._is_fresh = True

    @property
    def stage(self) -> Stage:
        """Stage of the approach."""
        return self._approach.stage

    @property
    def approaches(self) -> int:
        """Number of approaches to the board."""
        return self._approach.approaches

    @property
    def spread_m(self) -> float:
        """Standard deviation of the place of the last pose; infinite: there is no pose."""
        return self._filter.spread_m

    @property
    def searched_rad(self) -> float:
        """The robot's turn since the last sighting; after a full turn the target is not there."""
        return self._approach.searched_rad

    def see(self, frame: Picture, elapsed_s: float) -> ServoStep:
        """Return the decision of this picture.

        Args:
            frame: Grey levels 0 to 255, shape (240, 320), row 0 on top.
            elapsed_s: Time since the last picture; ignored for the first picture, and the first after ``resumed``.

        Raises:
            ValueError: The array is not a grey picture, or time runs backwards.
        """
        if elapsed_s < 0:
            raise ValueError(f"a picture comes {-elapsed_s} s before the one before it")
        if self._is_fresh:
            # The time between two grants counts neither as search nor as motion.
            self._is_fresh, elapsed_s = False, 0.0
        self._dead_reckon(elapsed_s)
        track = self.tracker.look(frame)
        pose = None if track.sighting is None else self._filter.saw(track.sighting)
        command = self._approach.step(track.phase, pose, min(elapsed_s, LONGEST_GAP_S))
        self._sent.append((self._now_s + self._latency_s, command))
        return ServoStep(command, self._approach.stage, track, pose)

    def resumed(self) -> None:
        """Begin again with acquisition, the robot standing still; the number of approaches is kept."""
        self.tracker.forget()
        self._filter.forget()
        self._approach.resumed()
        self._sent.clear()
        self._is_fresh = True

    def _dead_reckon(self, elapsed_s: float) -> None:
        """Move the pose by the wheels' motion between the two pictures."""
        begin_s, self._now_s = self._now_s, self._now_s + elapsed_s
        forward_m = turn_rad = 0.0
        while self._sent:
            since_s, command = self._sent[0]
            until_s = min(self._now_s, self._sent[1][0]) if len(self._sent) > 1 else self._now_s
            lasted_s = max(0.0, until_s - max(begin_s, since_s))
            forward_m += command.forward_m_s * lasted_s
            turn_rad += command.turn_rad_s * lasted_s
            if len(self._sent) > 1 and self._sent[1][0] <= self._now_s:
                self._sent.popleft()
            else:
                break
        self._filter.moved(forward_m, turn_rad)
