"""RC of a command radio: sharable, it sends the packets of several ARCs, each at its constant interval.

Rules of this file:

* One packet at a time is on the air, and each keeps it for its packet time.
* A robot an ARC spoke to hears a safe packet last. One that could not be sent is owed until it was.
* A radio that fails while it serves its streams ends this RC; its creator starts it anew, with the device reopened.

Source: IROS 2001, section 4.3; RAM 2002, "Sharable Resources".
"""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import replace
from typing import Any

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.wire import Envelope, Message
from resource_pool.drivers.interface import RadioDriver
from resource_pool.holds import Hold
from resource_pool.messages import HardwareFault, ImpossibleUse, LoadPacket, PacketLoaded
from resource_pool.packet_schedule import Packet, PacketSchedule, Sending
from resource_pool.resource_controller import RcParameters, ResourceController

TRANSMIT_WITHIN_S = 1.0  # chosen: hundreds of packet times; a device that takes none for so long hangs; machine seconds


class CommandRadio(ResourceController[RcParameters]):
    """Interleaves packets by network id; when an ARC is disconnected its robots hear a last, safe packet."""

    commands = LoadPacket
    driver_kind = "radio"

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._driver: RadioDriver = self.make_driver()
        self._schedule = PacketSchedule()
        self._owed: deque[Sending] = deque()
        self._air = asyncio.Lock()
        self._air_free_s = 0.0
        self._loaded = asyncio.Event()
        self._overruns = self._sent = 0

    async def connect(self) -> None:
        """Open the device."""
        await super().connect()
        await self._driver.open()

    async def serve(self) -> None:
        """Send what is due, and end holds whose lease is over."""
        self.start_task(self._send_when_due(), "send")
        await super().serve()

    async def drain(self) -> None:
        """Send every robot its safe packet and close the device."""
        await super().drain()
        await self._driver.close()

    async def connected(self, hold: Hold) -> None:
        """Give the ARC its streams."""
        try:
            self._schedule.connect(hold.arc, hold.use.streams, hold.rank, self.clock.now_s())
        except ValueError as error:
            raise ImpossibleUse(f"{self.name}: {error}") from None

    async def make_safe(self, hold: Hold) -> None:
        """Drop what the ARC loaded; the last its robots hear is the safe packet."""
        sent, overruns = self._schedule.counts().get(hold.arc, (0, 0))
        if overruns:
            self.story.note(hold.arc, f"{overruns} of {sent + overruns} packets came too late to be sent")
        self._overruns += overruns
        self._owed += self._schedule.disconnect(hold.arc)
        async with self._air:
            while self._owed:
                await self._transmit(self._owed[0])
                self._owed.popleft()

    async def command(self, asked: Envelope[Any]) -> Message:
        """Load a packet, or send it at once."""
        order: LoadPacket = asked.body
        packet = Packet(order.arc, order.network_id, order.payload, order.safe_payload, order.robot_epoch)
        if order.at_once:
            async with self._air:
                self.admit(order.arc, order.epoch)  # not earlier: it may lose the radio while the air is busy
                self._schedule.touch(packet)
                await self._transmit(Sending(packet, self._schedule.air_time_s(order.arc)))
                if order.afterwards and self.holds.has(order.arc, order.epoch):
                    self._load(replace(packet, payload=order.afterwards))
        else:
            self.admit(order.arc, order.epoch)
            if order.lasts_s > 0:
                packet = replace(packet, until_s=self.clock.now_s() + order.lasts_s, afterwards=order.afterwards)
            self._load(packet)
        return PacketLoaded()

    def statistics(self) -> dict[str, float]:
        """Count packets and overruns, in all and of the ARCs now connected."""
        counts = self._schedule.counts()
        late = {f"overruns_{arc}": float(overruns) for arc, (_, overruns) in counts.items()}
        overruns = self._overruns + sum(overruns for _, overruns in counts.values())
        return {**super().statistics(), "packets_sent": self._sent, "overruns": overruns, **late}

    def _load(self, packet: Packet) -> None:
        self._schedule.load(packet, self.clock.now_s())
        self._loaded.set()

    async def _send_when_due(self) -> None:
        while True:
            self._loaded.clear()
            due_s = self._schedule.next_due_s()
            if due_s is None:
                await self._loaded.wait()
            elif due_s > self.clock.now_s():
                await self._wait_loaded_or(due_s)
            else:
                await self._send_next()

    async def _wait_loaded_or(self, due_s: float) -> None:
        """Return at this time, or earlier if there is something new to send."""
        try:
            async with asyncio.timeout((due_s - self.clock.now_s()) / self.clock.rate):
                await self._loaded.wait()
        except TimeoutError:
            return

    async def _send_next(self) -> None:
        async with self._air:
            await self.clock.sleep_until_s(self._air_free_s)  # before the choice: who joins meanwhile may go first
            sending = self._schedule.take(self.clock.now_s())
            if sending is not None:
                await self._transmit(sending)

    async def _transmit(self, sending: Sending) -> None:
        """Send the packet as soon as the air is free; the caller holds the air.

        Raises:
            HardwareFault: It was not sent.
        """
        await self.clock.sleep_until_s(self._air_free_s)
        self._air_free_s = self.clock.now_s() + sending.air_time_s
        packet = sending.packet
        try:
            async with asyncio.timeout(TRANSMIT_WITHIN_S):
                await self._driver.transmit(
                    packet.network_id, packet.payload, arc=packet.arc, robot_epoch=packet.robot_epoch
                )
        except TimeoutError:
            raise HardwareFault(f"{self.name} took no packet within {TRANSMIT_WITHIN_S} s") from None
        self._sent += 1
