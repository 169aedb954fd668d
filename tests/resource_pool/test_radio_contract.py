"""The shipped radio keeps the contract of radios, and the check of the contract finds drivers that break it."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from radio_contract import assert_keeps_nothing

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.keys import Conversation
from resource_pool.drivers.interface import DriverSite
from resource_pool.drivers.simulated import SimulatedRadio
from resource_pool.drivers.world_messages import RadioPacket
from resource_pool.rc_parameters import RcParameters


class Plain:
    """A radio that sends after a while, within its call."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    async def open(self) -> None:
        pass

    async def transmit(
        self, network_id: int, payload: bytes, *, arc: str, robot_epoch: int, robot_stop: int = 0
    ) -> float | None:
        await asyncio.sleep(0.01)
        self.sent.append(payload)
        return None

    async def close(self) -> None:
        pass


class Queueing(Plain):
    """Returns at once, and sends later."""

    async def transmit(self, network_id: int, payload: bytes, **_of: Any) -> float | None:
        asyncio.get_running_loop().call_later(0.05, self.sent.append, payload)
        return None


class Shielded(Plain):
    """Sends even if its call is cut off."""

    async def transmit(self, network_id: int, payload: bytes, **of: Any) -> float | None:
        return await asyncio.shield(asyncio.ensure_future(super().transmit(network_id, payload, **of)))


def test_a_radio_that_sends_within_its_call_keeps_the_contract() -> None:
    radio = Plain()
    run_virtual(assert_keeps_nothing(radio, lambda: radio.sent))


@pytest.mark.parametrize("kind", [Queueing, Shielded])
def test_a_radio_that_sends_after_its_call_breaks_it(kind: type[Plain]) -> None:
    radio = kind()
    with pytest.raises(AssertionError, match="on the air"):
        run_virtual(assert_keeps_nothing(radio, lambda: radio.sent))


class Air:
    """A bus that hands a packet to the world at once."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def publish(self, _address: str, _conversation: Conversation, packet: RadioPacket) -> None:
        self.sent.append(packet.payload)


def test_the_simulated_radio_keeps_the_contract() -> None:
    air: Any = Air()
    site = DriverSite("radio", air, VirtualClock(), RcParameters(), lambda _line: None, lambda _bug: None)
    run_virtual(assert_keeps_nothing(SimulatedRadio(site), lambda: air.sent))
