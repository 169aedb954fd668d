"""A complete RC on a complete driver, to be copied: a lamp that is dark without a holder."""

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
    """Shine this brightly, 0 (dark) to 1."""

    brightness: Share


class PaintedLamp:
    """The driver of a lamp that exists only as a line of text."""

    class options_type(msgspec.Struct, frozen=True, forbid_unknown_fields=True):  # noqa: N801
        """Options of this driver in the mission file."""

        color: str = "white"

    def __init__(self, site: DriverSite) -> None:
        self._site, self._color = site, site.options(self.options_type).color

    async def set_brightness(self, share: float) -> None:
        """Return when the lamp has this brightness, 0 to 1; a real driver raises ``HardwareFault`` if it has not."""
        self._site.tell(f"shines {self._color} at {share:.0%}" if share else "is dark")


class Lamp(ResourceController[RcParameters]):
    """The RC: carry out a command, return the applied values; and know the safe state."""

    commands, driver_kind = Shine, "lamp"

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._driver: PaintedLamp = self.make_driver()
        self._share = 0.0

    async def make_safe(self, hold: Hold) -> None:  # noqa: ARG002
        """Go dark."""
        self._share = 0.0
        await self._driver.set_brightness(0.0)

    async def driver_exchanged(self) -> None:
        """Shine on with another driver, or with the old one again."""
        await self._driver.set_brightness(self._share)

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Shine."""
        if not isinstance(order, Shine):
            return await super().obey(hold, order)
        self._share = min(1.0, max(0.0, order.brightness))
        await self._driver.set_brightness(self._share)
        return {"brightness": self._share}
