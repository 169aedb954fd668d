"""What an RC's process loads before it has a driver."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("numpy", "cv2", "mujoco", "mink", "pydantic", "lxml", "mcap", "rich", "typer", "textual")
LIGHT = [
    "resource_pool.rcs.scout",
    "resource_pool.rcs.command_radio",
    "resource_pool.rcs.video_frequency",
    "resource_pool.rcs.framegrabber",
    "resource_pool.rcs.skeleton",
    "resource_pool.drivers.simulated",
    "resource_pool.drivers.recorded",
    "resource_pool.drivers.video_device",
    "resource_pool.drivers.serial_radio",
    "resource_pool.arcs.capture",
    "resource_pool.robots.rover.arcs",
    "resource_pool.devices.monitor.rc",
    "resource_pool.devices.monitor.arcs",
    "resource_pool.arc_client",
    "resource_pool.robots.walker.arcs",
    "resource_pool.robots.walker.body",
]


@pytest.mark.processes
@pytest.mark.parametrize("modules", [", ".join(LIGHT)])
def test_rcs_and_arcs_load_no_arrays_no_pictures_and_no_physics(modules: str) -> None:
    program = f"import sys, {modules}; print(*(name for name in {HEAVY!r} if name in sys.modules))"
    child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=True)
    assert child.stdout.split() == []
