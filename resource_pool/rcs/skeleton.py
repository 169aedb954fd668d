"""A complete RC and driver to copy from: a lamp that is off while no ARC holds it."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.ranges import Share
from resource_pool.commands import Command
from resource_pool.drivers.interface import DriverSite
from resource_pool.holds import Hold
from resource_pool.resource_controller import RcParameters, ResourceController


class Shine(Command, frozen=True):
    """Set the lamp's brightness, 0 (off) to 1."""

    brightness: Share


class PaintedLamp:
    """The driver of a lamp that exists only as a line of text."""

    class options_type(msgspec.Struct, frozen=True, forbid_unknown_fields=True):  # noqa: N801
        """Options of this driver in the mission file."""

        color: str = "white"

    def __init__(self, site: DriverSite) -> None:
        self._site, self._color = site, site.options(self.options_type).color

    async def set_brightness(self, share: float) -> None:
        """Set the brightness, 0 to 1. A real driver raises ``HardwareFault`` if the lamp does not obey."""
        self._site.tell(f"shines {self._color} at {share:.0%}" if share else "is dark")


class Lamp(ResourceController[RcParameters]):
    """The RC: carries out commands, returns the applied values, and defines the safe state."""

    commands, driver_kind = Shine, "lamp"

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._driver: PaintedLamp = self.make_driver()
        self._share = 0.0

    async def make_safe(self, hold: Hold) -> None:  # noqa: ARG002
        """Switch the lamp off."""
        self._share = 0.0
        await self._driver.set_brightness(0.0)

    async def driver_exchanged(self) -> None:
        """Set the present brightness on the driver that works now."""
        await self._driver.set_brightness(self._share)

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Set the brightness."""
        if not isinstance(order, Shine):
            return await super().obey(hold, order)
        self._share = min(1.0, max(0.0, order.brightness))
        await self._driver.set_brightness(self._share)
        return {"brightness": self._share}
