"""Driver of the simulated receiver and framegrabber: renders the received pictures in the RC's process.

It draws only the cameras of robots that transmit on the tuned frequency, and only while it is tuned. A thread of their
own draws for all framegrabbers of the process; on a virtual clock the event loop draws, in no virtual time. In both
cases the driver delivers the picture of a frame ``capture_delay_s`` after the frame's time, or as soon as it is drawn
if that is later. If the processors are full, it draws fewer pictures; see ``picture_pace``.
"""

from __future__ import annotations

import asyncio
import functools
import importlib
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from backbone.bus.clock import VirtualLoop
from backbone.bus.interface import Subscription
from backbone.keys import Conversation
from backbone.waiting import end_tasks
from backbone.wire import Envelope
from resource_pool.drivers.interface import DriverSite, Picture
from resource_pool.drivers.picture_pace import PicturePace
from resource_pool.drivers.picture_turns import PictureTurns
from resource_pool.drivers.shared_camera import SharedCamera
from resource_pool.drivers.simulated import meet_world, world_of
from resource_pool.drivers.world_messages import WorldModel, WorldState
from scout_model.gl_probe import GlSupport, forget, probe, probe_once


class GrabberOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a simulated framegrabber.

    Attributes:
        capture_delay_s: Time from a frame to its delivery, seconds. The camera sends a frame row by row, so the
            framegrabber has it only after the last row.
    """

    capture_delay_s: Annotated[float, msgspec.Meta(ge=0, le=1)] = 1 / 30


class SimulatedFramegrabber:
    """A receiver in the simulated world."""

    opens_beside = True
    options_type = GrabberOptions

    def __init__(self, site: DriverSite) -> None:
        self._site = site
        self._camera: SharedCamera | None = None
        self._studio: _Studio | None = None
        self._world: Subscription | None = None
        self._frequency = ""
        self._deliver: Callable[[Picture], None] | None = None
        self._drawing: Future[tuple[Picture, float]] | None = None
        self._is_new = False
        self._taking: set[asyncio.Task[None]] = set()
        self._turns = PictureTurns()
        self._pace = PicturePace(site.parameters.frame_rate_hz)
        self._delay_s = site.options(GrabberOptions).capture_delay_s

    def adjust(self, site: DriverSite) -> None:
        """Apply the new rate and delay from the next picture on."""
        self._delay_s = site.options(GrabberOptions).capture_delay_s
        self._pace.ask(site.parameters.frame_rate_hz)
        self._site.remark(self._pace.remark())

    def allowed_hz(self) -> float:
        """Return the present limit of the picture rate; see ``YieldingDriver.allowed_hz``."""
        return self._pace.allowed_hz

    async def open(self) -> None:
        """Fetch the world's model, and open the renderer or the painter if no neighbor did."""
        run, wanted = asyncio.get_running_loop().run_in_executor, self._site.parameters.camera
        probing = run(None, _support, wanted, self._site.folder)
        world = await meet_world(self._site)
        support = await probing
        paints_first = wanted == "auto" and not support.has_card
        lasts = isinstance(asyncio.get_running_loop(), VirtualLoop)
        camera = SharedCamera.join(world.mjcf, support.backend, paints_first=paints_first, lasts=lasts)
        self._camera = camera
        try:
            self._studio = await run(camera.thread, lambda: _Studio(world, camera.opened(), keeps_noise=lasts))
        except Exception:  # mujoco's import raises errors of many kinds where OpenGL is missing
            forget(self._site.folder)
            raise
        if support.missing_packages and (wanted == "gl" or self._studio.lacks):
            self._site.tell(support.summary)
        self._world = self._site.bus.subscribe(
            world_of(self._site), Conversation.BODIES, WorldState, self._world_moved, latest=True
        )

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        """Receive this frequency from now on; see ``FramegrabberDriver.tune``."""
        self._frequency, self._deliver, self._is_new = frequency, deliver, True
        self._turns.begin()

    def stop(self) -> None:
        """Stop the delivery of pictures; see ``FramegrabberDriver.stop``."""
        self._frequency, self._deliver = "", None

    async def close(self) -> None:
        """Stop drawing, and close the renderer unless a neighbor uses it."""
        self.stop()
        if self._world is not None:
            self._world.close()
        await end_tasks(*self._taking)
        camera, self._camera = self._camera, None
        if camera is not None:
            await camera.leave()

    def _world_moved(self, envelope: Envelope[WorldState]) -> None:
        state = envelope.body
        is_drawing = self._drawing is not None and not self._drawing.done()
        if self._deliver is None or is_drawing or not self._turns.take(state.at_s, self._pace.allowed_hz):
            return
        tuned = _Tuned(self._frequency, self._deliver, self._is_new)
        self._is_new = False
        self._drawing = self._draw(state, tuned)
        taking = asyncio.create_task(self._take(state.at_s, tuned, self._drawing), name="take picture")
        self._taking.add(taking)
        taking.add_done_callback(self._taken)

    def _taken(self, taking: asyncio.Task[None]) -> None:
        self._taking.discard(taking)
        if not taking.cancelled() and (bug := taking.exception()) is not None:
            self._site.fail(bug)

    async def _take(self, at_s: float, tuned: _Tuned, drawing: Future[tuple[Picture, float]]) -> None:
        clock = self._site.clock
        began_s, due_s = clock.now_s(), at_s + self._delay_s
        await clock.sleep_until_s(due_s)
        picture, took_s = drawing.result() if drawing.done() else await asyncio.wrap_future(drawing)
        if self._deliver is tuned.deliver:
            self._keep_pace(max(due_s, began_s + took_s * clock.rate))
            tuned.deliver(picture)

    def _draw(self, state: WorldState, tuned: _Tuned) -> Future[tuple[Picture, float]]:
        """Draw in the thread, which does not wake the event loop when it is ready; on a virtual clock, draw at once."""
        assert self._camera is not None and self._studio is not None  # noqa: S101, PT018  open before the first state
        draw = functools.partial(self._studio.take, state, tuned.frequency, tuned.is_new)
        if not isinstance(asyncio.get_running_loop(), VirtualLoop):
            return self._camera.thread.submit(draw)
        drawn: Future[tuple[Picture, float]] = Future()
        try:
            drawn.set_result(draw())
        except Exception as bug:
            drawn.set_exception(bug)
        return drawn

    def _keep_pace(self, due_s: float) -> None:
        """Compare the time of a delivery with the earliest possible one: frame due, and drawn without a wait."""
        clock = self._site.clock
        now_s = clock.now_s()
        if self._pace.delivered((now_s - due_s) / clock.rate, now_s / clock.rate):
            self._site.remark(self._pace.remark())


@dataclass(frozen=True, slots=True)
class _Tuned:
    """The tuned frequency and the listener for its pictures; with ``is_new`` the receiver has to lock first."""

    frequency: str
    deliver: Callable[[Picture], None]
    is_new: bool


class _Studio:
    """Cameras of all robots and one receiver for each frequency; used only by the drawing thread.

    Args:
        keeps_noise: True where many pictures a second are drawn, in virtual time; see ``video_link.Receiver``.

    Attributes:
        lacks: What the pictures lack without OpenGL.
    """

    def __init__(self, world: WorldModel, camera: Any, *, keeps_noise: bool) -> None:
        self._camera, self._keeps_noise = camera, keeps_noise
        self.lacks: list[str] = camera.lacks
        self._video_link = importlib.import_module("scout_model.video_link")
        self._distance_m = importlib.import_module("scout_model.air").distance_m
        self._world = world
        self._receivers: dict[str, Any] = {}

    def take(self, state: WorldState, frequency: str, is_new: bool) -> tuple[Picture, float]:
        """Return the picture of this frequency's receiver for this state of the world, and its processor time."""
        began_s = time.thread_time()
        return self._received(state, frequency, is_new), time.thread_time() - began_s

    def _received(self, state: WorldState, frequency: str, is_new: bool) -> Picture:
        receiver = self._receivers.get(frequency)
        if receiver is None:
            world, keeps_noise = self._world, self._keeps_noise
            receiver = self._video_link.Receiver(world.seed, frequency, world.air, keeps_noise=keeps_noise)
            self._receivers[frequency] = receiver
        if is_new:
            receiver.tune()
        heard = sorted(robot for robot, on in state.transmitting.items() if on == frequency)
        if heard:
            self._camera.show(np.frombuffer(state.state, np.float64))
        reception = receiver.receive([self._signal(robot, state) for robot in heard], state.frame)
        pixels = np.ascontiguousarray(reception.picture)
        height_px, width_px = pixels.shape
        robot = heard[0] if len(heard) == 1 else ""
        return Picture(
            state.at_s,
            pixels.reshape(-1).data,
            width_px,
            height_px,
            reception.transmitters,
            robot,
            reception.kind.value,
        )

    def _signal(self, robot: str, state: WorldState) -> Any:
        return self._video_link.Signal(
            self._camera.picture(robot),
            robot,
            self._distance_m(self._camera.position_m(robot), self._world.antenna_m),
            min(1.0, state.motors.get(robot, 0.0)),
            state.on_since.get(robot, 0),
        )


def _support(wanted: str, folder: Path | None) -> GlSupport:
    """Return the OpenGL support of this machine; none if a painted picture is wanted."""
    if wanted == "paint":
        return GlSupport("none", "", "")
    return probe() if folder is None else probe_once(folder)
