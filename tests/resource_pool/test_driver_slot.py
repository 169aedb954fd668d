"""A driver's methods may have any public name: the slot's own names are not in their way."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import at, connect

from backbone.bus.clock import run_virtual
from resource_pool.commands import Command
from resource_pool.driver_slot import DriverSlot, always, as_returned
from resource_pool.drivers.interface import DriverSite
from resource_pool.holds import Hold
from resource_pool.messages import Applied
from resource_pool.rcs.skeleton import Lamp, PaintedLamp, Shine


def slot_of(driver: object) -> DriverSlot:
    def fail(fault: BaseException) -> None:
        raise fault

    return DriverSlot(driver, as_returned, always, fail)


OWN_NAMES = sorted(name for name in vars(slot_of(object())).keys() | vars(DriverSlot) if not name.startswith("_"))


@pytest.mark.parametrize("name", OWN_NAMES)
def test_a_method_with_a_name_of_the_slot_reaches_the_driver(name: str) -> None:
    slot = slot_of(type("Door", (), {name: lambda _self, way_m: f"{name} {way_m}"})())
    assert getattr(slot.proxy, name)(0.5) == f"{name} 0.5"
    assert slot.calls == 1


@pytest.mark.parametrize("name", OWN_NAMES)
def test_an_asynchronous_one_waits_while_the_gate_is_shut(name: str) -> None:
    async def method(_self: object, way_m: float) -> str:
        return f"{name} {way_m}"

    async def main() -> None:
        slot = slot_of(type("Door", (), {name: method})())
        slot.shut()
        called = asyncio.create_task(getattr(slot.proxy, name)(0.5))
        await asyncio.sleep(0)
        assert not called.done()
        slot.open_gate()
        assert await called == f"{name} 0.5"

    asyncio.run(main())


@pytest.mark.parametrize("name", OWN_NAMES)
def test_a_value_with_a_name_of_the_slot_is_the_drivers(name: str) -> None:
    assert getattr(slot_of(type("Door", (), {name: 0.5})()).proxy, name) == 0.5


@pytest.mark.parametrize("name", [*OWN_NAMES, "motion"])
def test_a_value_that_is_set_is_the_drivers(name: str) -> None:
    driver = type("Door", (), {name: 0.5})()
    setattr(slot_of(driver).proxy, name, 1.0)
    assert getattr(driver, name) == 1.0


class Bell(PaintedLamp):
    """A driver for a lamp that also calls people."""

    called: tuple[float, ...] = ()

    def __init__(self, site: DriverSite) -> None:
        super().__init__(site)
        Bell.called = ()

    def call(self, share: float) -> None:
        Bell.called += (share,)


class CallingLamp(Lamp):
    """A lamp that calls people with its light."""

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        applied = await super().obey(hold, order)
        driver: Any = self._driver
        driver.call(applied["brightness"])
        return applied


def test_an_rc_calls_a_method_named_call(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            await pool.start(CallingLamp, "lamp1", {"driver": f"{__name__}:Bell"})
            await connect(pool, "lamp1", "one", 1)
            await pool.voice("one").ask(at("lamp1"), Shine(0.5).under("one", 1), Applied, within_s=1)
            assert Bell.called == (0.5,)

    run_virtual(main())
