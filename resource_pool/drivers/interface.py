"""Driver interface: the protocols between RCs and hardware. A driver knows one device, but no ARC, epoch or bus.

The simulated drivers, a radio on a serial port and a grabber behind V4L2 all fit these protocols. A mission names a
driver: one of ``BUILT_IN`` for its kind, or ``package.module:Class``.

RCs ask ``hasattr`` for optional methods, because a driver may forward its calls to another object. From Python 3.12 on,
``isinstance`` with a protocol is false for such a driver.
"""

from __future__ import annotations

import asyncio
import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar, cast

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.class_faults import fault_of_method
from backbone.component.parameter_values import parameters_from
from backbone.errors import Refusal
from backbone.import_faults import import_fault, object_at
from backbone.ranges import Share

Options = TypeVar("Options", bound=msgspec.Struct)
OPENS_WITHIN_S = 60.0  # chosen: longer than a world may take to answer; machine seconds


class UnknownDriver(Refusal):
    """No driver of this name exists for this kind of resource; facts: ``class_path``, if it cannot be imported."""

    code = "driver.unknown"
    remedy = "Name a built-in driver, or a class as package.module:Class."


class HardwareFault(Refusal):
    """The hardware did not obey; the RC reports itself down."""

    code = "rc.hardware"
    remedy = "Check cable, power and driver of the resource."


class FixedOption(Refusal):
    """A device that is open cannot change this option; nothing is changed."""

    code = "driver.fixed_option"
    remedy = "Change it in the mission file; the driver uses it from its next start on."


@dataclass(frozen=True)
class DriverSite:
    """A driver's interface to its RC.

    Attributes:
        parameters: The RC's parameters; the driver's own are in ``options``, checked by its ``options_type``.
        tell: Publishes one line in the mission's log.
        fail: Ends the RC because of this bug or fault. Its creator restarts the RC, which opens the device again.
        folder: Cache folder of the mission on this machine; None: no folder.
        remark: Shows one line with the RC's state until the next line; empty: nothing.
    """

    resource: str
    bus: Bus
    clock: Clock
    parameters: Any
    tell: Callable[[str], None]
    fail: Callable[[BaseException], None]
    folder: Path | None = None
    remark: Callable[[str], None] = lambda _line: None

    def options(self, kind: type[Options]) -> Options:
        """Return the driver's own options from the mission file.

        Raises:
            WrongParameter: An option is not in ``kind``, or its value is illegal.
        """
        return parameters_from(self.parameters.options, kind, self.resource)


class NoOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """For drivers without options."""


class RadioDriver(Protocol):
    """A transmitter of command packets."""

    async def open(self) -> None:
        """Open the device.

        When: before readiness, and again after ``close`` if a driver exchange brings this driver back. Raise
        ``HardwareFault`` if it is missing.
        """

    async def transmit(
        self, network_id: int, payload: bytes, *, arc: str, robot_epoch: int, robot_stop: int = 0
    ) -> float | None:
        """Send the packet and return when it is on the air. Arguments after ``payload`` are for audits.

        Not: queue it, or send it after the call was cancelled; else a robot drives after its stop was confirmed.

        Returns:
            Time on the air, in mission seconds from the call on, 0 to 10; the RC manager plans with it if it is longer
            than declared. None: unknown. Then the duration of this call is used, for an alarm only.

        Raises:
            HardwareFault: The packet was not sent.
        """

    async def close(self) -> None:
        """Close the device. When: once, last."""


class AnsweringRadio(Protocol):
    """A radio on which robots reply."""

    def hear(self, network_id: int, heard: Callable[[bytes], None]) -> None:
        """Ask this robot for replies from now on, together with packets that are sent anyway.

        When: once for each robot whose protocol reads replies. What: call ``heard``, in the event loop, with each
        reply, and with no bytes if the robot was asked and did not reply in time. Add the time of a reply on the air to
        what ``transmit`` returns for the packet that asks.
        """


class AdjustableDriver(Protocol):
    """A driver that can apply changed options and RC parameters at run time."""

    def adjust(self, site: DriverSite) -> None:
        """Apply ``site.parameters``, whose options are checked, from the next packet or picture on.

        Raises:
            Refusal: The driver cannot; nothing is changed.
        """


@dataclass(frozen=True)
class Picture:
    """One picture of a grabber.

    Attributes:
        captured_s: Mission time; the RC drops pictures that are older than the tuning or the last picture.
        pixels: Grey levels 0 to 255 as bytes, row by row from the top, contiguous; others end the RC.
        width_px: Columns.
        height_px: Rows.
        transmitters: Number of transmitters on the frequency; -1: unknown to the hardware.
        robot: The transmitting robot, if there is exactly one and the hardware knows it; else empty.
        kind: Worst fault of the picture (``clean``, ``torn``, …), for statistics only; empty: unknown.
    """

    captured_s: float
    pixels: memoryview
    width_px: int
    height_px: int
    transmitters: int = -1
    robot: str = ""
    kind: str = ""


class FramegrabberDriver(Protocol):
    """A receiver with a digitizer."""

    async def open(self) -> None:
        """Open the device and slow resources; see ``RadioDriver.open``."""

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        """Receive this frequency from now on; deliver each picture in the event loop. Replaces an earlier tuning."""

    def stop(self) -> None:
        """Stop the delivery of pictures. When: at the end of each hold. Idempotent."""

    async def close(self) -> None:
        """Close the device. When: once, last."""


class YieldingDriver(Protocol):
    """A framegrabber driver that delivers fewer pictures while its host is busy, and reports it by ``remark``."""

    def allowed_hz(self) -> float:
        """Return the present limit of its picture rate, Hz."""


class RobotProtocol(Protocol):
    """Encodes commands to one kind of robot as packets. Raise ``HardwareFault`` for commands that the robot lacks."""

    def halt(self) -> bytes:
        """Return the packet that stops all motion."""

    def transmitter(self, on: bool, frequency: str) -> bytes:
        """Return the packet that switches the video transmitter on at this frequency, or off."""

    def safe(self) -> bytes:
        """Return the packet after which the robot neither moves nor transmits."""


class MalformedReply(Refusal):
    """The bytes are not a reply of this kind of robot."""

    code = "driver.malformed_reply"
    remedy = "Check that robot and protocol are of one kind, and that no two robots have the same network id."


class ReplyReader(Protocol):
    """A robot's protocol that reads the robot's replies."""

    def read(self, payload: bytes) -> msgspec.Struct:
        """Return the reply as the struct that the RC's class declares in ``reports``.

        Raises:
            MalformedReply: The bytes are not a reply of this kind of robot.
        """


class ScoutReports(msgspec.Struct, frozen=True):
    """State of a Scout.

    Attributes:
        battery_share: Charge of its battery, 0 to 1.
        tilt_rad: Angle between its up axis and the vertical; pi: the Scout lies on its back.
        motor_load_share: Load of its motors, 0 to 1.
    """

    battery_share: Share
    tilt_rad: Annotated[float, msgspec.Meta(ge=0, le=math.pi)]
    motor_load_share: Share


class ScoutProtocol(RobotProtocol, Protocol):
    """The commands of a Scout."""

    def clip_wheel_speed(self, speed_rad_s: float) -> float:
        """Return the speed within the robot's limits, rad/s."""

    def drive(self, left_rad_s: float, right_rad_s: float) -> bytes:
        """Return the packet for these wheel speeds."""

    def jump(self) -> bytes:
        """Return the packet for a jump."""


BUILT_IN: Mapping[str, Mapping[str, str]] = {
    "radio": {
        "simulated": "resource_pool.drivers.simulated:SimulatedRadio",
        "serial_radio": "resource_pool.drivers.serial_radio:SerialRadio",
    },
    "robot": {"simulated": "resource_pool.drivers.simulated:SimulatedScoutProtocol"},
    "video_frequency": {"simulated": "resource_pool.drivers.interface:NoDevice"},
    "framegrabber": {
        "simulated": "resource_pool.drivers.simulated_video:SimulatedFramegrabber",
        "video_device": "resource_pool.drivers.video_device:VideoDevice",
        "recorded": "resource_pool.drivers.recorded:RecordedCamera",
    },
}


class NoDevice:
    """For resources without a device, such as the right to use a frequency."""

    def __init__(self, site: DriverSite) -> None:
        self._site = site


def driver_path(kind: str, name: str, resource: str) -> str:
    """Return the class path of the driver of this name.

    Raises:
        UnknownDriver: No driver has this name.
    """
    built_in = BUILT_IN.get(kind, {})
    path = built_in.get(name, name)
    if ":" not in path:
        raise UnknownDriver(f"{resource}: no {kind} driver {name!r}; built in: {', '.join(built_in) or 'none'}")
    return path


def driver_class(path: str, resource: str, protocol: type = object) -> Callable[[DriverSite], Any]:
    """Return the class at ``package.module:Class``; imports its file.

    Raises:
        UnknownDriver: There is no such class, or its constructor or methods are not those of this protocol.
    """
    try:
        found: Callable[[DriverSite], Any] = object_at(path)
    except (ImportError, AttributeError, ValueError) as error:
        told, remedy = import_fault(path, error)
        raise UnknownDriver(f"{resource}: {told}", remedy=remedy, class_path=path) from error
    if not callable(found):
        raise UnknownDriver(f"{resource}: {path} is no class")
    is_judged = isinstance(found, type) and not hasattr(found, "__getattr__")  # which may pass calls on to another
    if is_judged and (lacking := methods_of(protocol) - methods_of(found)):
        raise UnknownDriver(f"{resource}: {path} lacks {', '.join(sorted(lacking))}")
    if is_judged and (faults := [*_faults_of(cast(type, found), protocol)]):
        raise UnknownDriver(f"{resource}: {path}: {'; '.join(faults)}")
    return found


def _faults_of(driver: type, protocol: type) -> Iterator[str]:
    """Yield a sentence for each call of the RC that does not suit the driver, whose methods are all there."""
    try:
        inspect.signature(driver).bind("site")
    except TypeError as error:
        yield f"{error}; its constructor gets one argument, the DriverSite"
    for kind in (protocol, AdjustableDriver):  # an RC adjusts each driver that can be adjusted
        for name in sorted(methods_of(kind) & methods_of(driver)):
            yield from fault_of_method(name, getattr(driver, name), getattr(kind, name), kind.__name__)


def methods_of(driver: object) -> set[str]:
    """Return the names of the driver's methods that an RC may call."""
    found = inspect.getmembers(driver if isinstance(driver, type) else type(driver), callable)
    return {name for name, method in found if not name.startswith("_") and not isinstance(method, type)}


def build_driver(kind: str, name: str, site: DriverSite, protocol: type = object) -> Any:
    """Return the driver of this name, not open yet. Only this function imports its module, in the RC that needs it.

    A driver class gets the site. If it has a class variable ``options_type`` (a msgspec struct), it also gets
    ``site.options(options_type)``; else no options are allowed.

    Raises:
        UnknownDriver: No driver has this name, or it lacks methods of the protocol.
        WrongParameter: The driver refuses its options.
    """
    found = driver_class(driver_path(kind, name, site.resource), site.resource, protocol)
    site.options(getattr(found, "options_type", NoOptions))
    return found(site)


async def open_device(driver: RadioDriver | FramegrabberDriver, resource: str) -> None:
    """Open the device of a resource.

    Raises:
        HardwareFault: It hangs; otherwise its RC would be about to start for ever, without a reason.
    """
    try:
        async with asyncio.timeout(OPENS_WITHIN_S) as limit:
            await driver.open()
    except TimeoutError:
        if not limit.expired():
            raise
        raise HardwareFault(f"the driver of {resource} did not open the device within {OPENS_WITHIN_S:g} s") from None


def options_of_drivers(kind: str, named: str = "", protocol: type = object) -> dict[str, type[msgspec.Struct]]:
    """Return for each built-in driver of a kind that has the protocol's methods, and for a named one, its options.

    Imports their modules.

    Raises:
        UnknownDriver: No driver has this name, or it lacks methods of the protocol.
    """
    what = f"{kind} driver"
    found = {name: driver_class(path, what) for name, path in BUILT_IN.get(kind, {}).items()}
    found = {name: one for name, one in found.items() if methods_of(protocol) <= methods_of(one)}
    if named:
        found[named] = driver_class(driver_path(kind, named, what), what, protocol)
    return {name: getattr(one, "options_type", NoOptions) for name, one in found.items()}
