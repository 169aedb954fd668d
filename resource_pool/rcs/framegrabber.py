"""RC of a framegrabber behind a tuned receiver: pictures of one frequency, for the ARC that holds it.

Pictures are published under the ARC's address with the connection's epoch; subscribers drop pictures of other epochs.
Pictures of a further camera of the ARC have a subaddress, so that each camera's newest picture is delivered. If the
hardware identifies transmitting robots, a picture is delivered only if exactly the expected robot transmits. A picture
from before the tuning or before an earlier one, or from the future, is not delivered.

Source: IROS 2001, section 4.1; RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from operator import index
from typing import Annotated, Literal

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import Absence, LogLevel
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.ranges import LONGEST_MENTION, MOST_PX
from resource_pool.commands import Command, Tune
from resource_pool.drivers.interface import FramegrabberDriver, HardwareFault, Picture, open_device
from resource_pool.holds import Hold
from resource_pool.messages import Accepted, Frame, NothingHeard
from resource_pool.resource_controller import RcParameters, ResourceController
from resource_pool.returned_numbers import number_between

log = logging.getLogger(__name__)

SILENT_S = 0.5  # chosen: a packet gets its turn on the radio within 0.3 s, and its robot appears two pictures later
WRONG_S = 1.0  # chosen: more than clocks of hosts differ, and than a driver delivers late; mission time
DARK_S = 2.0  # chosen: four times SILENT_S, after which a transmitter is switched on again; machine seconds
MOST_HZ = 1e3  # chosen: ten times as many pictures as fast cameras deliver
DARK_PICTURES = 3  # chosen: so many pictures may be missing at a low rate
LEAST_PX = 2  # chosen: vision halves pictures; a smaller one comes of a driver that got none
LONGEST_WORD = LONGEST_MENTION - len("frames_")  # a kind is part of a statistic's name
MOST_KINDS = 64  # chosen: a grabber knows a handful of faults
ARC_REPLY_S = 1.0  # chosen: the ARC asks a robot before it answers; machine seconds


class FramegrabberParameters(RcParameters, frozen=True, kw_only=True):
    """Parameters of a framegrabber.

    Attributes:
        frame_rate_hz: Pictures a second, above 0 to 30.
        camera: What draws for the simulated driver: ``gl`` (MuJoCo's OpenGL renderer), ``paint`` (the painter, which
            needs no OpenGL), or ``auto``: OpenGL on a graphics card, else the painter if it shows all of the room.
    """

    frame_rate_hz: Annotated[float, msgspec.Meta(gt=0, le=30)] = 15.0
    camera: Literal["auto", "gl", "paint"] = "auto"


class WrongFrequency(Refusal):
    """The receiver of this framegrabber cannot receive this frequency."""

    code = "framegrabber.frequency"
    remedy = "Tune to one of the frequencies the mission file links the framegrabber to."


class Framegrabber(ResourceController[FramegrabberParameters]):
    """Delivers pictures of its frequency to the ARC that holds it."""

    parameters_type = FramegrabberParameters
    shares_process = False
    alike_most = 5  # measured: they share one renderer and its thread, and draw for a fifth of a core
    commands = Tune
    driver_kind, driver_protocol = "framegrabber", FramegrabberDriver
    closed_most_s = 5.0  # chosen: a camera starts within two; its RC waits for no driver call
    driver_parameters = frozenset({"options", "frame_rate_hz"})

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._driver: FramegrabberDriver = self.make_driver(judge=self._credible)
        self._tuned: tuple[str, Callable[[Picture], None]] | None = None
        self._tuned_anew = asyncio.Event()
        self._delivered = self._garbled = self._silent = self._foreign = 0
        self._kinds: Counter[str] = Counter()
        self._silent_since_s = math.inf
        self._newest_s, self._mistimed, self._has_told, self._has_told_rate = -math.inf, 0, False, False
        self._tuned_s = self._came_s = -math.inf
        self._shown_s, self._dark_since_s, self._why_dark = -math.inf, math.inf, ""
        self._watched_by = ""
        self._told_dark: set[str] = set()

    async def connect(self) -> None:
        """Open the device now, so that the first grant is as fast as later ones."""
        await super().connect()
        await open_device(self._driver, self.name)

    async def serve(self) -> None:
        """Report an ARC that no picture reaches, and end the hold when its lease expires."""
        self.start_task(self._watch_for_pictures(), "watch for pictures")
        await super().serve()

    async def drain(self) -> None:
        """Stop and close the device."""
        await super().drain()
        await self._driver.close()

    async def make_safe(self, hold: Hold) -> None:  # noqa: ARG002
        """Stop the delivery of pictures."""
        self._tuned, self._dark_since_s = None, math.inf
        self._driver.stop()

    async def driver_exchanged(self) -> None:
        """Continue the delivery with the new driver."""
        if self._tuned is not None:
            self._driver.tune(*self._tuned)
        else:
            self._driver.stop()

    async def driver_proved(self, since_s: float) -> None:
        """Wait for a picture, if an ARC waits for pictures; see ``ResourceController``."""
        while self._tuned is not None and self._came_s < (begun_s := max(since_s, self._tuned_s)):
            due_s = begun_s + self._dark_after_s()
            if self.clock.now_s() >= due_s:
                raise HardwareFault(f"the driver of {self.name} delivered no picture in time")
            await self.clock.sleep_until_s(due_s)

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Tune and begin to deliver."""
        if not isinstance(order, Tune):
            return await super().obey(hold, order)
        known = self.parameters.links.get("video_frequency", [])
        if order.frequency not in known:
            raise WrongFrequency(f"{self.name} receives {', '.join(known) or 'nothing'}, not {order.frequency}")
        numbers = itertools.count(1)

        def deliver(picture: Picture) -> None:
            self._deliver(hold, order, picture, numbers)

        self._silent_since_s = math.inf
        self._newest_s = self._tuned_s = self.clock.now_s()
        self._has_told = False
        self._tuned = order.frequency, deliver
        self._shown_s, self._dark_since_s, self._why_dark = self.clock.now_s(), math.inf, "its device delivers none"
        self._watched_by = hold.arc
        self._tuned_anew.set()
        self._driver.tune(order.frequency, deliver)
        return {}

    def absences(self) -> list[Absence]:
        """Return this RC while no picture reaches the ARC that holds it."""
        if self._dark_since_s == math.inf:
            return []
        remedy = "examine receiver, cable and the robot's transmitter"
        what = f"no picture reaches its ARC: {self._why_dark}"
        return [Absence(self.name, self._dark_since_s, what, "waits for pictures", remedy, is_running=True)]

    def is_wanted(self, picture: Picture, expected: str) -> bool:
        """Return whether to deliver the picture: exactly the expected robot transmits. Count the other pictures."""
        if picture.transmitters == 0:
            self._silent, self._why_dark = self._silent + 1, "no robot transmits"
        elif picture.transmitters > 1:
            self._garbled, self._why_dark = self._garbled + 1, "several robots transmit at once"
        elif expected and picture.robot and picture.robot != expected:  # a transmitter that should be off
            self._foreign, self._why_dark = self._foreign + 1, f"{picture.robot} transmits, not {expected}"
        else:
            return True
        return False

    def statistics(self) -> dict[str, float]:
        """Count delivered pictures, and pictures dropped because no robot, several robots or another robot transmitted.

        Also count dropped pictures of an impossible time. Also return the requested rate, and the rate that the driver
        allows now; the driver lowers it on a busy host. If the hardware knows the faults of its pictures, count the
        pictures of each kind too, delivered or dropped.
        """
        return {
            **super().statistics(),
            "pictures_asked_hz": self.parameters.frame_rate_hz,
            "pictures_allowed_hz": self._allowed_hz(),
            "frames_delivered": self._delivered,
            "frames_garbled": self._garbled,
            "frames_silent": self._silent,
            "frames_foreign": self._foreign,
            "frames_mistimed": self._mistimed,
            **{f"frames_{kind}": float(count) for kind, count in sorted(self._kinds.items())},
        }

    def _deliver(self, hold: Hold, order: Tune, picture: Picture, numbers: Iterator[int]) -> None:
        if not self.holds.has(hold.arc, hold.epoch):
            return  # a driver may deliver one picture after its stop
        try:
            self._take(hold, order, picture, numbers)
        except (ValueError, TypeError, AttributeError) as wrong:
            raise HardwareFault(f"the driver of {self.name} delivers a wrong picture: {wrong}") from wrong

    def _take(self, hold: Hold, order: Tune, picture: Picture, numbers: Iterator[int]) -> None:
        """Publish the picture if it is in time and wanted.

        Raises:
            ValueError: It has no legal size, or other pixels than its size says.
            TypeError: A value is not of the type that ``Picture`` declares.
            AttributeError: It is no ``Picture``.
        """
        words: tuple[object, ...] = picture.robot, picture.kind  # a driver may deliver anything
        for word in words:
            if not isinstance(word, str) or len(word) > LONGEST_WORD:
                raise TypeError(f"its robot or kind is {word!r:.40}, no name")
        if not self._is_in_time(picture.captured_s):
            return
        if picture.kind:
            self._kinds[picture.kind if picture.kind in self._kinds or len(self._kinds) < MOST_KINDS else "other"] += 1
        if picture.transmitters == 0:
            self._heard_nothing(hold)
        else:
            self._silent_since_s = math.inf
        if not self.is_wanted(picture, order.robot):
            return
        width_px, height_px = index(picture.width_px), index(picture.height_px)  # listeners drop others unseen
        if not all(LEAST_PX <= side_px <= MOST_PX for side_px in (width_px, height_px)):
            raise ValueError(f"{width_px} x {height_px} pixels, each side {LEAST_PX} to {MOST_PX}")
        frame = Frame(
            rc=self.name,
            arc=hold.arc,
            epoch=hold.epoch,
            robot=picture.robot or order.robot,
            number=next(numbers),
            captured_s=float(picture.captured_s),
            width_px=width_px,
            height_px=height_px,
            pixels=_in_a_row(picture.pixels),
        )
        self._delivered += 1
        self._is_shown(hold.arc)
        at = address(Subsystem.RESOURCE_POOL, hold.arc)
        self.bus.publish(f"{at}/{order.camera}" if order.camera else at, Conversation.FRAMES, frame)

    def _is_in_time(self, captured_s: float) -> bool:
        """Return whether a picture may have this time: not before the last one, not in the future. Count the others."""
        now_s, wrong_s = self.clock.now_s(), WRONG_S * max(1.0, self.clock.rate)
        if self._newest_s <= captured_s <= now_s + wrong_s:
            self._newest_s, self._came_s = captured_s, now_s
            return True
        self._mistimed, self._why_dark = self._mistimed + 1, "its pictures have an impossible time"
        if not self._has_told and not abs(captured_s - now_s) <= wrong_s:
            self._has_told = True
            what = f"delivers no picture of {captured_s:.1f} s at {now_s:.1f} s of mission time"
            self.publish_event(self.name, what, LogLevel.WARNING)
        return False

    async def _watch_for_pictures(self) -> None:
        """Report an ARC that no picture reaches; say it once until pictures come again."""
        while True:
            await self._tuned_anew.wait()
            dark_s = self._dark_after_s()
            now_s = self.clock.now_s()
            if self._tuned is None:
                self._tuned_anew.clear()
            elif self._dark_since_s == math.inf and now_s >= self._shown_s + dark_s:
                self._is_dark(self._watched_by)
            is_due_s = self._shown_s + dark_s
            await self.clock.sleep_until_s(is_due_s if is_due_s > now_s else now_s + dark_s)

    def _dark_after_s(self) -> float:
        """Return the mission seconds without a picture after which an ARC counts as blind."""
        hz = self._allowed_hz()
        return max(DARK_S * self.clock.rate, DARK_PICTURES / hz if hz > 0 else 0.0)

    def _allowed_hz(self) -> float:
        """Return the driver's limit of the picture rate, or without a credible one the rate that is asked for."""
        driver, asked_hz = self._driver, self.parameters.frame_rate_hz
        try:
            return driver.allowed_hz() if hasattr(driver, "allowed_hz") else asked_hz
        except HardwareFault as fault:
            if not self._has_told_rate:
                self._has_told_rate = True
                self.publish_event(self.name, fault.detail, LogLevel.WARNING)
            return asked_hz

    def _credible(self, method: str, returned: object) -> object:
        """Refuse a limit of the picture rate that is no number, or far from every rate of a camera."""
        if method != "allowed_hz":
            return returned
        return number_between(0.0, MOST_HZ, returned, f"the driver of {self.name} allows {{}} pictures a second")

    def _is_dark(self, arc: str) -> None:
        self._dark_since_s = self._shown_s
        self.changed()
        if arc not in self._told_dark:
            self._told_dark.add(arc)
            self.publish_event(self.name, f"no picture reaches {arc}: {self._why_dark}", LogLevel.WARNING)

    def _is_shown(self, arc: str) -> None:
        self._shown_s = self.clock.now_s()
        if self._dark_since_s < math.inf:
            self._dark_since_s = math.inf
            self.changed()
        if arc in self._told_dark:
            self._told_dark.discard(arc)
            self.publish_event(self.name, f"pictures reach {arc} again", LogLevel.NOTICE)

    def _heard_nothing(self, hold: Hold) -> None:
        """Ask the ARC to switch a silent transmitter on, because the transmitter was reset or missed its packet."""
        now_s = self.clock.now_s()
        self._silent_since_s = min(self._silent_since_s, now_s)
        if now_s - self._silent_since_s >= SILENT_S:
            self._silent_since_s = now_s
            self.start_task(self._complain(hold), "complain")

    async def _complain(self, hold: Hold) -> None:
        arc = address(Subsystem.RESOURCE_POOL, hold.arc)
        try:
            await self.bus.ask(arc, NothingHeard(self.name, hold.epoch), Accepted, within_s=ARC_REPLY_S)
        except (Refusal, LinkError) as error:  # repeated if it is still silent after SILENT_S
            log.info("%s did not switch its transmitter on: %s", hold.arc, error)


def _in_a_row(pixels: memoryview) -> memoryview:
    """Return the pixels as one row of bytes, not copied.

    Raises:
        ValueError: They are not contiguous in memory.
        TypeError: They are no buffer.
    """
    view = memoryview(pixels)
    if not view.c_contiguous:
        raise ValueError("its pixels are not contiguous in memory")
    return view.cast("B")
