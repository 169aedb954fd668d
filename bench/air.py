"""The cost of the air for a frame: each effect alone, and all as in the papers, beside one cv2.add of two pictures.

Effects and floor take turns, frame by frame, so that all run under the same load. Prints one JSON line; ``ratio`` is an
effect's median over the floor's. The picture is drawn by a formula, nothing is rendered.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable

import cv2
import msgspec
import numpy as np
from measuring import percentile, report

from scout_model.description import AS_THE_PAPERS, CLEAN_AIR, AirDescription
from scout_model.video_link import Receiver, Signal

PICTURE = np.add.outer(np.arange(240), np.arange(320)).astype(np.uint8)
OTHER = np.ascontiguousarray(PICTURE[::-1])
STILL, DRIVEN = Signal(PICTURE, "scout1"), Signal(PICTURE, "scout1", motors=1.0)
EFFECTS = ("white_noise", "tears", "ghosts", "fades", "partial_frames")


def only(**scales: float) -> AirDescription:
    """Return air with only these effects."""
    return msgspec.structs.replace(CLEAN_AIR, **{**dict.fromkeys(EFFECTS, 0.0), "noise": 1.0, **scales})


CASES: dict[str, tuple[AirDescription, list[Signal], bool]] = {
    "clean": (CLEAN_AIR, [STILL], False),
    "white_noise": (only(white_noise=1.0), [STILL], False),
    "tears_motors_running": (only(tears=1.0), [DRIVEN], False),
    "ghost": (only(ghosts=1.0), [STILL], False),
    "fade_always": (only(fades=10.0), [STILL], False),
    "partial_always": (only(partial_frames=10.0, fades=10.0), [STILL], False),
    "settling_always": (msgspec.structs.replace(CLEAN_AIR, settling=1.0), [STILL], True),
    "mild": (AirDescription(), [STILL], False),
    "papers": (AS_THE_PAPERS, [STILL], False),
    "papers_motors_running": (AS_THE_PAPERS, [DRIVEN], False),
    "two_transmitters": (AS_THE_PAPERS, [STILL, Signal(OTHER, "scout2")], False),
    "snow": (AS_THE_PAPERS, [], False),
}


def reception(air: AirDescription, signals: list[Signal], anew: bool) -> Callable[[int], None]:
    """Return a function that receives a frame; with ``anew``, each time after another tuning."""
    receiver = Receiver(1, "video1", air)

    def receive(frame: int) -> None:
        if anew:
            receiver.tune()
        receiver.receive(signals, frame)

    return receive


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1000)
    frames = parser.parse_args().frames
    into = np.empty_like(PICTURE)
    works: dict[str, Callable[[int], object]] = {name: reception(*case) for name, case in CASES.items()}
    works["cv2_add"] = lambda _frame: cv2.add(PICTURE, OTHER, dst=into)
    works["copy"] = lambda _frame: np.copyto(into, PICTURE)
    took_s: dict[str, list[float]] = {name: [] for name in works}
    for frame in range(frames):
        for name, work in works.items():
            began_s = time.perf_counter()
            work(frame)
            took_s[name].append(time.perf_counter() - began_s)
    floor_s = percentile(took_s["cv2_add"], 0.5)
    kinds = Receiver(1, "video1", AS_THE_PAPERS)
    told = Counter(kinds.receive([STILL], frame).kind.value for frame in range(frames))
    report(
        "air",
        ms={name: round(percentile(times, 0.5) * 1e3, 4) for name, times in took_s.items()},
        mean_ms={name: round(sum(times) / len(times) * 1e3, 4) for name, times in took_s.items()},
        ratio={name: round(percentile(times, 0.5) / floor_s, 1) for name, times in took_s.items()},
        papers_frames=dict(told),
    )


if __name__ == "__main__":
    main()
