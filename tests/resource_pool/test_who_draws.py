"""A graphics card renders; without one the painter draws, unless the room has what only OpenGL shows."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock
from backbone.bus.local_bus import LocalNetwork
from resource_pool.drivers import simulated_video
from resource_pool.drivers.interface import DriverSite
from resource_pool.drivers.world_messages import AskWorld, WorldModel
from scout_model.gl_probe import MISSING_PACKAGES, GlSupport, probe

CARD, LLVMPIPE = (
    GlSupport("egl", "NVIDIA GeForce RTX 3060/PCIe/SSE2", ""),
    GlSupport("egl", "llvmpipe (LLVM 15.0.6)", ""),
)
NOTHING = GlSupport("none", "", MISSING_PACKAGES)
PLAIN = """<mujoco>
  <visual><headlight diffuse="0 0 0"/></visual><worldbody><geom name="wall" size="1"/></worldbody>
</mujoco>"""
OF_BRICK = PLAIN.replace("<worldbody>", '<asset><material name="brick"/></asset><worldbody>').replace(
    "<geom", '<geom material="brick"'
)
CHOOSE = """
import json, sys
from resource_pool.drivers.shared_camera import SharedCamera
mjcf, gl, paints_first = json.loads(sys.argv[1])
shared = SharedCamera.join(mjcf, gl, paints_first=paints_first, lasts=False)
camera = shared.thread.submit(shared.opened).result()
print(type(camera._drawing).__name__, *camera.lacks)
"""


class Shared:
    """In place of the shared camera: keeps what was asked for, and says what its pictures would lack."""

    def __init__(self, lacks: list[str]) -> None:
        self.thread, self.asked, self._lacks = ThreadPoolExecutor(1), list[tuple[str, bool]](), lacks

    def join(self, _mjcf: str, gl: str, *, paints_first: bool, lasts: bool) -> Shared:
        assert not lasts
        self.asked.append((gl, paints_first))
        return self

    def opened(self) -> Any:
        return SimpleNamespace(lacks=self._lacks)

    async def leave(self) -> None:
        self.thread.shutdown()


async def opened(monkeypatch: pytest.MonkeyPatch, wanted: str, support: GlSupport, lacks: list[str]) -> Any:
    """Return how a driver asked for a camera, and what it told the operator."""
    network, clock, told = LocalNetwork(), VirtualClock(), list[str]()
    world, ear = network.join("resource_pool/world", clock), network.join("resource_pool/grabber", clock)

    async def answer(_asked: object) -> WorldModel:
        return WorldModel(PLAIN, {})

    world.serve("resource_pool/world", AskWorld, answer)
    shared = Shared(lacks)
    monkeypatch.setattr(simulated_video, "SharedCamera", shared)
    monkeypatch.setattr(simulated_video, "probe", lambda: support)
    parameters = SimpleNamespace(world="world", camera=wanted, frame_rate_hz=15.0, options={})
    driver = simulated_video.SimulatedFramegrabber(
        DriverSite("grabber", ear, clock, parameters, told.append, pytest.fail, remark=told.append)
    )
    await driver.open()
    await driver.close()
    await ear.close()
    await world.close()
    return shared.asked, told


@pytest.mark.parametrize(
    ("wanted", "support", "asked"),
    [
        ("auto", CARD, ("egl", False)),
        ("auto", LLVMPIPE, ("egl", True)),
        ("auto", NOTHING, ("none", True)),
        ("gl", CARD, ("egl", False)),
        ("gl", LLVMPIPE, ("egl", False)),
        ("paint", CARD, ("none", False)),
    ],
)
async def test_the_parameter_and_the_machine_choose(
    monkeypatch: pytest.MonkeyPatch, wanted: str, support: GlSupport, asked: tuple[str, bool]
) -> None:
    assert await opened(monkeypatch, wanted, support, []) == ([asked], [])


@pytest.mark.parametrize(("wanted", "lacks"), [("gl", []), ("auto", ["materials"])])
async def test_missing_packages_are_named_if_the_pictures_lack_something(
    monkeypatch: pytest.MonkeyPatch, wanted: str, lacks: list[str]
) -> None:
    _asked, [told] = await opened(monkeypatch, wanted, NOTHING, lacks)
    assert MISSING_PACKAGES in told


@pytest.mark.processes
@pytest.mark.parametrize(
    ("mjcf", "paints_first", "drawn"),
    [
        (PLAIN, True, lambda _gl: "Painter"),
        (OF_BRICK, True, lambda gl: "_GlDrawing" if gl else "Painter materials"),
        (PLAIN, False, lambda gl: "_GlDrawing" if gl else "Painter"),
    ],
)
def test_the_room_chooses_where_the_painter_may_draw(
    mjcf: str, paints_first: bool, drawn: Callable[[bool], str]
) -> None:
    gl = probe().backend
    command = [sys.executable, "-c", CHOOSE, json.dumps([mjcf, gl, paints_first])]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split("\n")[0] == drawn(gl != "none")
