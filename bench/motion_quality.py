"""Quality of motion detection in noise: precision, recall and false alarms per hour, from seeded noisy clips.

A Scout watches the published path for slices of five seconds. In the crossings a Pioneer or a person passes; in the
still clips nothing moves. Every detector gets the same received pictures: the shipped one, the same one without its
filter of whole rows, and the earlier frame averaging. Prints a table and one JSON line.

An alarm counts as right while the body covers at least ``SEEN_PX`` pixels of the picture as sent, or did so within the
last half second. Recall is the share of crossings with a right alarm.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from measuring import report
from numpy.typing import NDArray

from mission_control.vision.frame_averaging import FrameAveraging
from mission_control.vision.motion_detection import MotionDetector
from scout_model.camera import Camera
from scout_model.description import AirDescription, Furniture, RobotPlace, Target, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.video_link import Receiver, Signal
from scout_model.world import World

Picture = NDArray[np.uint8]

SLICE_FRAMES = 5 * FRAMES_PER_S  # RAM 2002, "Distributed Surveillance Task": at least 5 s
AFTERGLOW_FRAMES = FRAMES_PER_S // 2
SETTLING_FRAMES = 12  # after tuning; a watcher gets no picture before its ARC's gate opens
SEEN_PX = 150  # 0.2 % of the picture; the detector's own least area is 160
NOISES = (0.25, 1.0, 2.0)
DETECTORS = ("as used", "without row filter", "frame averaging")


@dataclass
class Count:
    """The alarms of one detector."""

    right: int = 0
    wrong: int = 0
    crossings: int = 0
    found: int = 0
    still_frames: int = 0
    still_alarms: int = 0
    still_slices: int = 0
    alarmed_slices: int = 0

    def figures(self) -> dict[str, float]:
        """Return the measures, rounded."""
        hours = self.still_frames / FRAMES_PER_S / 3600
        return {
            "precision": round(self.right / max(1, self.right + self.wrong), 3),
            "recall": round(self.found / max(1, self.crossings), 3),
            "false_alarms_per_hour": round(self.still_alarms / hours),
            "slices_with_a_false_alarm": round(self.alarmed_slices / max(1, self.still_slices), 3),
        }


def crossing(target: Target) -> tuple[list[Picture], list[bool]]:
    """Return the pictures as sent while the target passes, and whether it is in view in each."""
    places = [RobotPlace("scout", 1, 4.0, 0.7, math.pi / 2)]
    table = [Furniture("table", 6.5, 4.8, 1.6, 0.7, 0.72)]
    world = World(WorldDescription(9.0, 6.0, 1, furniture=table, robots=places, targets=[target]))
    pictures: list[Picture] = []
    for _ in range(FRAMES_PER_S):
        world.step_frame()
    with Camera(world.mjcf, "paint") as camera:
        for _ in range(SLICE_FRAMES):
            world.step_frame()
            camera.show(world.state())
            pictures.append(camera.picture("scout").copy())
    empty = pictures[0].astype(np.int16)
    return pictures, [int((np.abs(picture - empty) > 25).sum()) >= SEEN_PX for picture in pictures]


def received(pictures: list[Picture], seed: int, noise: float, first_frame: int) -> Iterator[Picture]:
    """Yield the pictures as received."""
    receiver = Receiver(seed, "A", AirDescription(noise=noise))
    for number in range(SETTLING_FRAMES):
        receiver.receive([Signal(pictures[0], "scout")], first_frame + number)
    first_frame += SETTLING_FRAMES
    for number, picture in enumerate(pictures):
        yield receiver.receive([Signal(picture, "scout")], first_frame + number).picture


def looks(pictures: Iterator[Picture]) -> Iterator[dict[str, bool]]:
    """Yield, for each picture, which detectors give an alarm."""
    used, unfiltered, averaging = MotionDetector(), MotionDetector(filters_rows=False), FrameAveraging()
    for picture in pictures:
        answers = (used.look(picture), unfiltered.look(picture), averaging.look(picture))
        yield {name: answer is not None for name, answer in zip(DETECTORS, answers, strict=True)}


def measure(noise: float, crossings: int, still_slices: int, seed: int) -> dict[str, Count]:
    """Return the counts of each detector under this noise."""
    counts = {name: Count() for name in DETECTORS}
    # They depart after two seconds: one in which the robot came to rest, and one in which its view is learned.
    bodies = [
        Target("pioneer", "pioneer", [(2.6, 3.0), (8.0, 3.0)], 0.5, begin_s=1.5),
        Target("person", "person", [(1.6, 3.0), (8.0, 3.0)], 1.2, begin_s=1.5),
    ]
    clips = [crossing(body) for body in bodies]
    for number in range(crossings):
        pictures, in_view = clips[number % len(clips)]
        found = dict.fromkeys(DETECTORS, False)
        alarms = looks(received(pictures, seed + number, noise, 1000 * number))
        for frame, answers in enumerate(alarms):
            is_right = any(in_view[max(0, frame - AFTERGLOW_FRAMES) : frame + 1])
            for name, alarm in answers.items():
                counts[name].right += alarm and is_right
                counts[name].wrong += alarm and not is_right
                found[name] |= alarm and is_right
        for name, was_found in found.items():
            counts[name].crossings += 1
            counts[name].found += was_found
    still = [clips[0][0][0]] * SLICE_FRAMES
    for number in range(still_slices):
        before, alarmed = dict.fromkeys(DETECTORS, False), dict.fromkeys(DETECTORS, False)
        for answers in looks(received(still, seed + 10_000 + number, noise, 1000 * number)):
            for name, alarm in answers.items():
                counts[name].still_frames += 1
                counts[name].still_alarms += alarm and not before[name]
                counts[name].wrong += alarm
                alarmed[name] |= alarm
            before = answers
        for name, was in alarmed.items():
            counts[name].still_slices += 1
            counts[name].alarmed_slices += was
    return counts


def main() -> None:
    """Measure, print the table and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crossings", type=int, default=40)
    parser.add_argument("--still", type=int, default=60, help="slices of 5 s in which nothing moves")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    measured = {}
    print("noise  detector            precision  recall  false alarms/h  slices with one")
    for noise in NOISES:
        told = {
            name: count.figures() for name, count in measure(noise, chosen.crossings, chosen.still, chosen.seed).items()
        }
        measured[str(noise)] = told
        for name, row in told.items():
            print(
                f"{noise:5.2f}  {name:18s}  {row['precision']:9.0%}  {row['recall']:6.0%}"
                f"  {row['false_alarms_per_hour']:14.0f}  {row['slices_with_a_false_alarm']:15.0%}",
                flush=True,
            )
    report("motion_quality", crossings=chosen.crossings, still_slices=chosen.still, seed=chosen.seed, measured=measured)


if __name__ == "__main__":
    main()
