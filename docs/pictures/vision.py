"""Draw ``vision.jpg``: the skeleton on a received picture, the stages of motion detection, and one approach from above.

Run from anywhere: ``python docs/pictures/vision.py``.  The same seeds give the same picture.
"""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from mission_control.vision.motion_detection import MotionDetector
from mission_control.vision.servo_law import HALT, STOP_M, Stage
from mission_control.vision.skeleton_model import skeleton_px
from mission_control.vision.visual_servo import VisualServo
from scout_model.camera import Camera
from scout_model.description import AS_THE_PAPERS, Landmark, RobotPlace, Target, WorldDescription
from scout_model.radio_link import encode_drive
from scout_model.scout import wheels_rad_s
from scout_model.video_link import Receiver, Signal
from scout_model.world import World

Image = NDArray[np.uint8]

BOARD = Landmark("home", 2.6, 1.5, math.pi)
COLORS = {
    Stage.SEARCHING: (160, 160, 160),
    Stage.FORWARD: (60, 140, 40),
    Stage.BACKING: (40, 40, 210),
    Stage.SETTLING: (200, 120, 0),
    Stage.ARRIVED: (0, 0, 0),
}
PX_PER_M = 165
VIEW_PX = (480, 480)


def approach() -> tuple[Image, Image]:
    """Return one received picture with the target's models on it, and the way from above."""
    world = World(WorldDescription(3.0, 3.0, 4, robots=[RobotPlace("scout", 1, 0.85, 2.55, -0.2)], landmarks=[BOARD]))
    receiver, servo = Receiver(4, "A", AS_THE_PAPERS), VisualServo()
    sent = [HALT] * 2
    marked, way = np.zeros((240, 320, 3), np.uint8), np.full((*VIEW_PX, 3), 255, np.uint8)
    half_m = 0.14
    cv2.line(way, _above(BOARD.x_m, BOARD.y_m - half_m), _above(BOARD.x_m, BOARD.y_m + half_m), (0, 0, 0), 4)
    cv2.line(way, _above(BOARD.x_m, BOARD.y_m), _above(0.2, BOARD.y_m), (200, 200, 200), 1)
    cv2.drawMarker(way, _above(BOARD.x_m - STOP_M, BOARD.y_m), (0, 0, 0), cv2.MARKER_TILTED_CROSS, 12, 2)
    with Camera(world.mjcf, "paint") as camera:
        while servo.stage is not Stage.ARRIVED and world.time_s < 120:
            now = sent.pop(0)
            world.hear(1, encode_drive(*wheels_rad_s(now.forward_m_s, now.turn_rad_s)))
            world.step_frame()
            camera.show(world.state())
            picture = receiver.receive([Signal(camera.picture("scout"), "scout", motors=0.3)], world.frame).picture
            step = servo.see(picture, 1 / 30)
            sent.append(step.command)
            cv2.circle(way, _above(*world.pose("scout")[:2]), 2, COLORS[step.stage], -1)
            model = servo.tracker.model
            is_near = model is not None and step.pose is not None and step.pose.range_m < 0.9
            if model is not None and is_near and step.stage is Stage.FORWARD and not marked.any():
                marked = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
                (left, top), (height, width) = model.corner_px, model.subimage.shape
                cv2.rectangle(marked, (left, top), (left + width, top + height), (0, 200, 255), 1)
                for column, row in skeleton_px(model.blobs_px).tolist():
                    cv2.drawMarker(marked, (column, row), (0, 0, 255), cv2.MARKER_CROSS, 7, 1)
    return marked, way


def _above(x_m: float, y_m: float) -> tuple[int, int]:
    return round(x_m * PX_PER_M), round(VIEW_PX[0] - (y_m - 0.05) * PX_PER_M)


def motion() -> Image:
    """Return the stages of a judgment side by side: picture, average, changed, kept."""
    pioneer = Target("pioneer", "pioneer", [(2.6, 3.0), (8.0, 3.0)], 0.5)
    places = [RobotPlace("scout", 1, 4.0, 0.7, math.pi / 2)]
    world, receiver = (
        World(WorldDescription(9.0, 6.0, 1, robots=places, targets=[pioneer])),
        Receiver(1, "A", AS_THE_PAPERS),
    )
    detector, best, torn = MotionDetector(), np.zeros((120, 640), np.uint8), -1
    with Camera(world.mjcf, "paint") as camera:
        for _ in range(120):
            world.step_frame()
            camera.show(world.state())
            blob = detector.look(receiver.receive([Signal(camera.picture("scout"), "scout")], world.frame).picture)
            stages = detector.stages
            if blob is not None and stages is not None:
                dropped = int((stages.changed & ~stages.kept).sum())
                if dropped > torn:
                    shown = (stages.picture, stages.average, 255.0 * stages.changed, 255.0 * stages.kept)
                    best, torn = np.hstack([np.clip(each, 0, 255).astype(np.uint8) for each in shown]), dropped
    return np.asarray(cv2.cvtColor(best, cv2.COLOR_GRAY2BGR), np.uint8)


def main() -> None:
    """Draw and save."""
    marked, way = approach()
    stages = motion()
    left = np.vstack([cv2.resize(marked, (640, 480), interpolation=cv2.INTER_NEAREST)])
    upper = np.hstack([left, way])
    height = round(stages.shape[0] * upper.shape[1] / stages.shape[1])
    lower = cv2.resize(stages, (upper.shape[1], height), interpolation=cv2.INTER_AREA)
    file = Path(__file__).with_suffix(".jpg")
    cv2.imwrite(str(file), np.vstack([upper, lower]), [cv2.IMWRITE_JPEG_QUALITY, 70])


if __name__ == "__main__":
    main()
