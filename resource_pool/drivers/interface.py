"""What an RC expects of its hardware. A driver knows one device; it knows no ARC, no epoch, no bus of ours.

The simulated drivers, a radio on a serial port and a grabber behind V4L2 all fit these protocols. A
mission names a driver: one of ``BUILT_IN`` for its kind, or ``package.module:Class``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import WrongParameter
from backbone.errors import Refusal

Options = TypeVar("Options", bound=msgspec.Struct)


class UnknownDriver(Refusal):
    """No driver of this name exists for this kind of resource."""

    code = "driver.unknown"
    remedy = "Name a built-in driver, or a class as package.module:Class."


@dataclass(frozen=True)
class DriverSite:
    """Where a driver is built in: what it may use.

    Attributes:
        resource: Name of the resource.
        bus: For drivers whose hardware is reached over it (the simulated ones).
        clock: The mission's time.
        parameters: The RC's parameters; the driver's own are in ``options``, checked by its ``options_type``.
        tell: Says one line to the people who watch the mission.
        fail: Ends the RC because of this bug or fault; its creator starts it anew, with the device reopened.
        folder: Of this mission on this machine, for what need be found out only once; None: there is none.
    """

    resource: str
    bus: Bus
    clock: Clock
    parameters: Any
    tell: Callable[[str], None]
    fail: Callable[[BaseException], None]
    folder: Path | None = None

    def options(self, kind: type[Options]) -> Options:
        """Return what the mission says to this driver alone.

        Raises:
            WrongParameter: It says something ``kind`` does not have, or not as it should be.
        """
        try:
            return msgspec.convert(self.parameters.options, kind)
        except msgspec.ValidationError as error:
            raise WrongParameter(f"{self.resource}: {error}") from None


class NoOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """For drivers that need to be told nothing."""


class RadioDriver(Protocol):
    """A transmitter of command packets."""

    async def open(self) -> None:
        """Get hold of the device. When: once, before readiness. Raise ``HardwareFault`` if it is not there."""

    async def transmit(
        self, network_id: int, payload: bytes, *, arc: str, robot_epoch: int, robot_stop: int = 0
    ) -> float | None:
        """Return when the packet is on the air. Not: queue it. All behind ``payload`` is for audits only.

        Returns:
            How long it really occupies the air from the call on, mission seconds; None: as long as this call took.

        Raises:
            HardwareFault: It was not sent.
        """

    async def close(self) -> None:
        """Let go of the device. When: once, last."""


@runtime_checkable
class AdjustableDriver(Protocol):
    """A driver that need not be built anew when its options, or those parameters of its RC it uses, change."""

    def adjust(self, site: DriverSite) -> None:
        """Take over ``site.parameters``, whose options were checked, from the next packet or picture on.

        Raises:
            Refusal: It cannot; nothing has changed.
        """


@dataclass(frozen=True)
class Picture:
    """What a grabber took.

    Attributes:
        captured_s: Mission time.
        pixels: Grey levels 0 to 255 as bytes, row by row from the top.
        width_px: Columns.
        height_px: Rows.
        transmitters: How many transmitters were heard on the frequency; -1 where the hardware cannot tell.
        robot: The one that was heard, if exactly one and the hardware can tell; else empty.
        kind: What is worst about the picture, where that is known, for counts only: ``clean``, ``torn``, …; else empty.
    """

    captured_s: float
    pixels: memoryview
    width_px: int
    height_px: int
    transmitters: int = -1
    robot: str = ""
    kind: str = ""


class FramegrabberDriver(Protocol):
    """A receiver with a digitizer behind it."""

    async def open(self) -> None:
        """Get hold of the device and whatever is slow to get; see ``RadioDriver.open``."""

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        """Receive this frequency from now on; hand each picture over in the event loop. Replaces an earlier tuning."""

    def stop(self) -> None:
        """Hand nothing over any more. When: at the end of each hold. Calling it twice is allowed."""

    async def close(self) -> None:
        """Let go of the device. When: once, last."""


class RobotProtocol(Protocol):
    """How commands to one kind of robot are spelt in packets. Raise ``HardwareFault`` for what it cannot do."""

    def clip_wheel_speed(self, speed_rad_s: float) -> float:
        """Return the speed the robot really takes, rad/s."""

    def drive(self, left_rad_s: float, right_rad_s: float) -> bytes:
        """Return the packet for these wheel speeds."""

    def halt(self) -> bytes:
        """Return the packet that stops the wheels."""

    def jump(self) -> bytes:
        """Return the packet for a jump."""

    def transmitter(self, on: bool, frequency: str) -> bytes:
        """Return the packet that turns the video transmitter on at this frequency, or off."""

    def safe(self) -> bytes:
        """Return the packet after which the robot neither moves nor transmits."""


BUILT_IN: Mapping[str, Mapping[str, str]] = {
    "radio": {"simulated": "resource_pool.drivers.simulated:SimulatedRadio"},
    "robot": {"simulated": "resource_pool.drivers.simulated:SimulatedScoutProtocol"},
    "video_frequency": {"simulated": "resource_pool.drivers.interface:NoDevice"},
    "framegrabber": {"simulated": "resource_pool.drivers.simulated_video:SimulatedFramegrabber"},
}


class NoDevice:
    """For resources that are a right and no device: there is nothing to drive."""

    def __init__(self, site: DriverSite) -> None:
        self._site = site


def build_driver(kind: str, name: str, site: DriverSite) -> Any:
    """Return the driver of this name, not yet open. Its module is imported only here, in the RC that needs it.

    A driver class takes the site; if it has a class variable ``options_type`` (a msgspec struct), it takes
    ``site.options(options_type)``, else no options are allowed.

    Raises:
        UnknownDriver: There is none.
        WrongParameter: It does not understand its options.
    """
    built_in = BUILT_IN.get(kind, {})
    path = built_in.get(name, name)
    module_name, colon, class_name = path.partition(":")
    if not colon:
        raise UnknownDriver(f"{site.resource}: no {kind} driver {name!r}; built in: {', '.join(built_in) or 'none'}")
    try:
        driver_class = getattr(importlib.import_module(module_name), class_name)
    except (ImportError, AttributeError) as error:
        raise UnknownDriver(f"{site.resource}: {path}: {error}") from error
    site.options(getattr(driver_class, "options_type", NoOptions))
    return driver_class(site)


def options_of_drivers(kind: str) -> dict[str, type[msgspec.Struct]]:
    """Return for each built-in driver of a kind the struct of its options; imports their modules."""
    found: dict[str, type[msgspec.Struct]] = {}
    for name, path in BUILT_IN.get(kind, {}).items():
        module_name, _, class_name = path.partition(":")
        driver_class = getattr(importlib.import_module(module_name), class_name)
        found[name] = getattr(driver_class, "options_type", NoOptions)
    return found
