"""Driver of a camera or a receiver that this host shows as a video device, or of a camera in the network.

It has no tuner: the device receives what a person has set it to, or what its cable carries. So its framegrabber is
linked to one frequency, and tuning only begins the delivery.

A thread of its own opens, reads and closes the device, because each of these can take seconds. It takes every picture,
so that none waits in the device, and decodes those that are delivered. If the event loop is late, only the newest
picture is delivered, and later fewer; see ``picture_pace``.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import importlib
import logging
import math
import re
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Annotated, Any

import msgspec

from backbone.component.messages import WrongParameter
from backbone.ranges import MOST_PX
from backbone.waiting import end_tasks, set_within, settle
from resource_pool.drivers.interface import DriverSite, FixedOption, HardwareFault, Picture
from resource_pool.drivers.picture_pace import PicturePace
from resource_pool.drivers.picture_turns import PictureTurns

log = logging.getLogger(__name__)

SILENT_S = 5.0  # chosen: a camera that adapts to the dark pauses for less; machine seconds
WINDOW_S = 2.0  # chosen: 10 pictures of a slow camera; machine seconds
CLOSES_WITHIN_S = 2.0  # chosen: a camera ends its last picture within one; an exchange of drivers waits for 5
FEW = 0.95  # chosen: the measured rate of a window errs by one picture
UNPLUGGED = "Plug it in again; a cable or hub that delivers too little power does this, too."


class VideoDeviceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a video device.

    Attributes:
        device: Its number on its host, 0 is the first camera; its path, as in ``/dev/video0``; or the address of a
            camera in the network, as in ``http://camera/video.mjpg``.
        width_px: Wished columns; 0: as the device likes. A device may deliver another size.
        height_px: Wished rows; 0: as the device likes.
    """

    device: str | Annotated[int, msgspec.Meta(ge=0)] = 0
    width_px: Annotated[int, msgspec.Meta(ge=0, le=MOST_PX)] = 0
    height_px: Annotated[int, msgspec.Meta(ge=0, le=MOST_PX)] = 0


Deliver = Callable[[Picture], None]


class _Reading:
    """One opening of the device.

    Attributes:
        opened: Done when the device is open, with its columns and rows, or with the fault.
        ends: Set when the thread is to close the device.
        has_ended: Set when the device is closed.
        newest: The newest picture that is not delivered yet, its listener, and its machine times: taken, decoded.
        alive_s: Machine time of the last picture.
    """

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self.opened: asyncio.Future[tuple[int, int]] = self._loop.create_future()
        self.ends, self.has_ended = threading.Event(), asyncio.Event()
        self.newest = deque[tuple[Picture, Deliver, float, float]](maxlen=1)
        self.alive_s = time.monotonic()

    def call(self, what: Callable[..., object], *given: object) -> None:
        """Call this in the event loop. When: in the thread."""
        with contextlib.suppress(RuntimeError):  # the loop is closed: the process ends
            self._loop.call_soon_threadsafe(what, *given)


class VideoDevice:
    """A camera of this host or of its network."""

    options_type = VideoDeviceOptions

    def __init__(self, site: DriverSite) -> None:
        self._site = site
        self._options = site.options(VideoDeviceOptions)
        self._name = _named(self._options.device)
        self._pace = PicturePace(site.parameters.frame_rate_hz)
        self._delivers_hz = math.inf  # until it is measured
        self._deliver: Deliver | None = None
        self._remark = ""
        self._reading: _Reading | None = None
        self._watching: asyncio.Task[None] | None = None
        if len(linked := site.parameters.links.get("video_frequency", [])) > 1:
            raise WrongParameter(
                f"{site.resource}: a video device has no tuner, and is linked to {', '.join(linked)}",
                remedy="Link it to the one frequency that its receiver is set to, or its camera stands for.",
            )

    def adjust(self, site: DriverSite) -> None:
        """Apply the new rate from the next picture on."""
        if site.options(VideoDeviceOptions) != self._options:
            raise FixedOption(f"{site.resource} cannot change device or size of its pictures while it runs")
        self._pace.ask(site.parameters.frame_rate_hz)
        self._remark_rate()

    def allowed_hz(self) -> float:
        """Return the rate of the device or of a busy host, if lower than the requested one; see ``YieldingDriver``."""
        return min(self._pace.allowed_hz, self._delivers_hz)

    async def open(self) -> None:
        """Open the device, and begin to take its pictures."""
        self._delivers_hz, self._remark = math.inf, ""
        reading = _Reading()
        name = f"read {self._site.resource}"
        threading.Thread(target=self._read, args=(reading,), name=name, daemon=True).start()
        try:
            width_px, height_px = await reading.opened
        except BaseException:
            reading.ends.set()
            raise
        self._reading = reading
        self._watching = asyncio.create_task(self._watch(reading), name=f"{self._site.resource}: watch the device")
        wished = self._options.width_px or width_px, self._options.height_px or height_px
        if wished != (width_px, height_px):
            self._site.tell(f"{self._name} delivers {width_px} x {height_px} pixels, not {wished[0]} x {wished[1]}")

    def tune(self, frequency: str, deliver: Deliver) -> None:  # noqa: ARG002  it has no tuner
        """Deliver the pictures that come from now on; see ``FramegrabberDriver.tune``."""
        self._deliver = deliver

    def stop(self) -> None:
        """Stop the delivery of pictures."""
        self._deliver = None

    async def close(self) -> None:
        """Close the device. If it hangs, its thread is left behind, and ends with the process."""
        self.stop()
        reading, self._reading = self._reading, None
        if reading is None:
            return
        reading.ends.set()
        if self._watching is not None:
            await end_tasks(self._watching)
        if not await set_within(reading.has_ended, CLOSES_WITHIN_S):
            log.warning("%s: %s does not close", self._site.resource, self._name)

    def _read(self, reading: _Reading) -> None:
        """Open, read and close the device. When: in the thread."""
        options = self._options
        try:
            pictures: Any = importlib.import_module("resource_pool.drivers.opencv_pictures")
            capture = pictures.open_camera(options.device, self._name, options.width_px, options.height_px)
            try:
                reading.alive_s = time.monotonic()
                reading.call(settle, reading.opened, capture.size_px())
                self._take_pictures(reading, capture)
            finally:
                capture.close()
        except Exception as error:  # it ends the RC, by the event loop
            reading.call(self._failed, reading, error)
        finally:
            reading.call(reading.has_ended.set)

    def _take_pictures(self, reading: _Reading, capture: Any) -> None:
        turns, served = PictureTurns(), None
        begin_s, count = time.monotonic(), 0
        while not reading.ends.is_set():
            deliver = self._deliver  # before the picture is taken, so that none is older than the tuning
            rate_hz = self._pace.allowed_hz * self._site.clock.rate
            if not capture.grab():
                raise HardwareFault(f"{self._name} delivers no more pictures", remedy=UNPLUGGED)
            now_s = reading.alive_s = time.monotonic()
            count += 1
            if now_s >= begin_s + WINDOW_S:
                reading.call(self._measured, count / (now_s - begin_s))
                begin_s, count = now_s, 0
            if served != (served := (deliver, rate_hz)):
                turns.begin()
            if deliver is None or not turns.take(now_s, rate_hz):
                continue
            picture = capture.picture(0.0)
            if picture is not None:
                reading.newest.append((picture, deliver, now_s, time.monotonic()))
                reading.call(self._hand_over, reading)

    def _hand_over(self, reading: _Reading) -> None:
        """Deliver the newest picture, unless an earlier call has done so."""
        if not reading.newest:
            return
        picture, deliver, taken_s, decoded_s = reading.newest.pop()
        if self._deliver is not deliver or reading.ends.is_set():
            return
        clock, now_s = self._site.clock, time.monotonic()
        if self._pace.delivered(now_s - decoded_s, now_s):
            self._remark_rate()
        deliver(dataclasses.replace(picture, captured_s=clock.now_s() - (now_s - taken_s) * clock.rate))

    def _failed(self, reading: _Reading, error: Exception) -> None:
        if not reading.opened.done():
            reading.opened.set_exception(error)
        elif not reading.ends.is_set():
            self._site.fail(error)

    async def _watch(self, reading: _Reading) -> None:
        """Report a device that is silent, because a call of its driver in the system may hang."""
        clock = self._site.clock
        while (silent_s := time.monotonic() - reading.alive_s) < SILENT_S:
            await clock.sleep_s((SILENT_S - silent_s) * clock.rate)
        self._site.fail(HardwareFault(f"{self._name} delivered no picture for {SILENT_S:g} s", remedy=UNPLUGGED))

    def _measured(self, delivers_hz: float) -> None:
        self._delivers_hz = delivers_hz / self._site.clock.rate
        self._remark_rate()

    def _remark_rate(self) -> None:
        """Show the rate of a busy host, or else of the device, if it is lower than the requested one."""
        asked_hz, remark = self._pace.asked_hz, self._pace.remark()
        if not remark and self._delivers_hz < FEW * asked_hz:
            remark = f"{self._delivers_hz:.2g} of {asked_hz:.3g} pictures a second: the device delivers no more"
        if remark != self._remark:
            self._remark = remark
            self._site.remark(remark)


def _named(device: str | int) -> str:
    """Return the name of a device for people and logs: the address of a camera without user and password."""
    return f"video device {device}" if isinstance(device, int) else re.sub(r"//[^/]*@", "//", device)
