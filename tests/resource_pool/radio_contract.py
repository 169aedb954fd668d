"""The contract of a radio's driver that an RC cannot check: no packet is on the air after its call."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from resource_pool.drivers.interface import RadioDriver

PACKETS = 20  # more than the buffer of a driver that keeps a few
LATER_S = 1.0  # a driver that keeps packets has sent them by then


async def assert_keeps_nothing(driver: RadioDriver, on_the_air: Callable[[], Sequence[bytes]]) -> None:
    """Send packets, and cut off one after the other at each of its first steps.

    Args:
        driver: An open driver.
        on_the_air: Returns the payloads that the device has put on the air so far.
    """
    for number in range(PACKETS):
        payload = bytes([number])
        await driver.transmit(1, payload, arc="a", robot_epoch=1)
        sent = [*on_the_air()]
        assert sent[-1:] == [payload], f"packet {number} is not on the air when transmit returns"
    await asyncio.sleep(LATER_S)
    assert [*on_the_air()] == sent, "a packet is on the air after transmit has returned"
    for steps in range(PACKETS):
        call = asyncio.ensure_future(driver.transmit(1, b"cut off", arc="a", robot_epoch=1))
        for _ in range(steps):
            await asyncio.sleep(0)
        call.cancel()
        await asyncio.wait({call})
        sent = [*on_the_air()]
        await asyncio.sleep(LATER_S)
        assert [*on_the_air()] == sent, f"a packet that was cut off after {steps} steps is on the air later"
