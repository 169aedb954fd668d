"""Cost of vision: tracking beside OpenCV's template match on the same pictures, acquisition, pose, motion.

A Scout drives up to the board; its noisy pictures are drawn before the measurement. Times are of the process, one core.
Prints one JSON line; ``ratio`` is tracking over the template match of the same subimage with the whole picture,
``ratio_in_reach`` over a match within the tracker's reach only.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable

import cv2
import numpy as np
from measuring import report
from numpy.typing import NDArray

from mission_control.vision.frame_averaging import FrameAveraging
from mission_control.vision.landmark import Picture, Sighting
from mission_control.vision.motion_detection import MotionDetector
from mission_control.vision.pose_filter import PoseFilter
from mission_control.vision.skeleton_model import TargetModel
from mission_control.vision.skeleton_tracking import REACH_COLUMNS_PX, REACH_ROWS_PX, TargetTracker, TrackingPhase
from mission_control.vision.target_acquisition import acquire
from mission_control.vision.target_pose import estimate_poses
from mission_control.vision.visual_servo import VisualServo
from scout_model.camera import Camera
from scout_model.description import AirDescription, Landmark, RobotPlace, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.radio_link import encode_drive
from scout_model.video_link import Receiver, Signal
from scout_model.world import World

ROBOTS = 4
SPEED_RAD_S = 8.0  # 0.16 m/s


def drive_up(frames: int, noise: float) -> list[Picture]:
    """Return the pictures of a Scout that drives from 2.2 to 0.5 m, as received."""
    world = World(
        WorldDescription(
            6.0,
            8.0,
            1,
            robots=[RobotPlace("scout", 1, 3.3, 4.2, -0.1)],
            landmarks=[Landmark("home", 5.5, 4.0, math.pi)],
        )
    )
    receiver = Receiver(1, "A", AirDescription(noise=noise))
    pictures = []
    with Camera(world.mjcf, "paint") as camera:
        for _ in range(frames):
            world.hear(1, encode_drive(SPEED_RAD_S, SPEED_RAD_S))
            world.step_frame()
            camera.show(world.state())
            signal = Signal(camera.picture("scout"), "scout", motors=0.45)
            pictures.append(receiver.receive([signal], world.frame).picture)
    return pictures


def ms_each(work: Callable[[Picture], object], pictures: list[Picture]) -> float:
    """Return the process's milliseconds for a picture."""
    began_s = time.process_time()
    for picture in pictures:
        work(picture)
    return 1000 * (time.process_time() - began_s) / len(pictures)


def followed(pictures: list[Picture]) -> tuple[list[float], list[float], list[float], list[float], list[Sighting]]:
    """Track once through; return ms of looks that tracked, of looks that did not, of the two template matches."""
    tracker, sightings = TargetTracker(), []
    tracked_ms: list[float] = []
    other_ms: list[float] = []
    whole_ms: list[float] = []
    reach_ms: list[float] = []
    for picture in pictures:
        model = tracker.model
        began_s = time.process_time_ns()
        track = tracker.look(picture)
        took_ms = (time.process_time_ns() - began_s) / 1e6
        if track.phase is not TrackingPhase.TRACKING or model is None or track.sighting is None:
            other_ms.append(took_ms)
            continue
        tracked_ms.append(took_ms)
        sightings.append(track.sighting)
        began_s = time.process_time_ns()
        matched(picture, model.subimage)
        whole_ms.append((time.process_time_ns() - began_s) / 1e6)
        began_s = time.process_time_ns()
        matched(in_reach(picture, model), model.subimage)
        reach_ms.append((time.process_time_ns() - began_s) / 1e6)
    return tracked_ms, other_ms, whole_ms, reach_ms, sightings


def matched(picture: NDArray[np.uint8], subimage: Picture) -> tuple[float, float, tuple[int, int], tuple[int, int]]:
    """Find the subimage by OpenCV's template match."""
    found = cv2.minMaxLoc(cv2.matchTemplate(picture, subimage, cv2.TM_CCOEFF_NORMED))
    return found[0], found[1], (found[2][0], found[2][1]), (found[3][0], found[3][1])


def in_reach(picture: Picture, model: TargetModel) -> Picture:
    """Return the part of the picture that the tracker examines."""
    (column, row), (height, width) = model.corner_px, model.subimage.shape
    top, left = max(0, row - REACH_ROWS_PX), max(0, column - REACH_COLUMNS_PX)
    return picture[top : row + height + REACH_ROWS_PX, left : column + width + REACH_COLUMNS_PX]


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--noise", type=float, default=0.25, help="scale of the air's noise, 1 is the papers'")
    chosen = parser.parse_args()
    cv2.setNumThreads(1)
    pictures = drive_up(chosen.frames, chosen.noise)
    followed(pictures[:30])
    tracked_ms, other_ms, whole_ms, reach_ms, sightings = followed(pictures)
    tracking_ms, whole, reach = (sum(each) / len(each) for each in (tracked_ms, whole_ms, reach_ms))

    began_s = time.process_time()
    for sighting in sightings:
        estimate_poses(sighting)
    pose_ms = 1000 * (time.process_time() - began_s) / len(sightings)
    known = PoseFilter()
    began_s = time.process_time()
    for sighting in sightings:
        known.moved(SPEED_RAD_S * 0.02 / FRAMES_PER_S, 0.0)
        known.saw(sighting)
    filter_ms = 1000 * (time.process_time() - began_s) / len(sightings)

    trackers = [TargetTracker() for _ in range(ROBOTS)]
    began_s = time.process_time()
    for picture in pictures:
        for tracker in trackers:
            tracker.look(picture)
    share = (time.process_time() - began_s) * FRAMES_PER_S / len(pictures)
    servo = VisualServo()
    report(
        "vision",
        frames=len(pictures),
        noise=chosen.noise,
        tracked=len(tracked_ms),
        tracking_ms=round(tracking_ms, 3),
        template_ms=round(whole, 3),
        ratio=round(tracking_ms / whole, 3),
        template_in_reach_ms=round(reach, 3),
        ratio_in_reach=round(tracking_ms / reach, 3),
        look_when_lost_ms=round(sum(other_ms) / max(1, len(other_ms)), 3),
        four_robots_at_30_hz_core_share=round(share, 3),
        acquisition_ms=round(ms_each(acquire, pictures), 3),
        pose_ms=round(pose_ms, 3),
        pose_filter_ms=round(filter_ms, 3),
        whole_servo_ms=round(ms_each(lambda picture: servo.see(picture, 1 / FRAMES_PER_S), pictures), 3),
        motion_ms=round(ms_each(MotionDetector().look, pictures), 3),
        frame_averaging_ms=round(ms_each(FrameAveraging().look, pictures), 3),
    )


if __name__ == "__main__":
    main()
