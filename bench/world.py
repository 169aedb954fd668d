"""Twelve bodies and six transmitting cameras: the cost of physics and pictures, and whether two cores suffice.

Ten Scouts, six of which drive about, a Pioneer and a person in the papers' room. Measured are: physics alone, with all
Scouts standing and with six of them driving; a picture by OpenGL and by the painter, and one that was drawn before; and
the whole: physics in one process, the pictures of three cameras each in two others, noise of the air included, as fast
as possible. ``real_time_factor`` is simulated over real seconds. If it is below 1, a mission keeps its pace by drawing
fewer pictures: of thirty, ``pictures_per_s`` of each camera remain. ``cores_at_real_time`` is the CPU time of all three
processes for a simulated second, on which a busy machine has less influence. Prints one JSON line.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from measuring import report

from scout_model.gl_probe import probe

LOADS = Path(__file__).with_name("world_loads.py")


def measured(backend: str, frames: int, mujoco_gl: str) -> dict[str, float]:
    """Return the measurements of the other program with this backend."""
    environment = {**os.environ, "MUJOCO_GL": mujoco_gl, "LP_NUM_THREADS": "0", "OPENBLAS_NUM_THREADS": "1"}
    told = subprocess.run(
        [sys.executable, str(LOADS), backend, "--frames", str(frames)],
        env=environment,
        stdout=subprocess.PIPE,
        check=True,
    )
    found: dict[str, float] = json.loads(told.stdout)
    return found


def main() -> None:
    """Measure with every backend of this machine."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=300)
    asked = parser.parse_args()
    support = probe()
    backends = {"paint": measured("paint", asked.frames, "disable")}
    if support.backend != "none":
        backends["gl"] = measured("gl", asked.frames, support.backend)
    report("world", bodies=12, cameras=6, processes=3, renderer=support.renderer, **backends)


if __name__ == "__main__":
    main()
