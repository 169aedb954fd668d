"""RC of a command radio: sharable, it sends the packets of several ARCs, each at its constant interval.

Source: IROS 2001, section 4.3; RAM 2002, "Sharable Resources".
"""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.wire import Envelope, Message
from resource_pool.drivers.interface import RadioDriver, build_driver
from resource_pool.holds import Hold
from resource_pool.messages import LoadPacket, PacketLoaded
from resource_pool.packet_schedule import Packet, PacketSchedule
from resource_pool.resource_controller import RcParameters, ResourceController


class CommandRadio(ResourceController[RcParameters]):
    """Interleaves packets by network id; when an ARC is disconnected its robots hear a last, safe packet."""

    commands = LoadPacket

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        site = self.driver_site()
        self._driver: RadioDriver = build_driver("radio", self.parameters.driver, site)
        self._schedule = PacketSchedule()
        self._air = asyncio.Lock()
        self._loaded = asyncio.Event()
        self._overruns = self._sent = 0

    async def connect(self) -> None:
        """Open the device and begin to send."""
        await super().connect()
        await self._driver.open()

    async def serve(self) -> None:
        """Send what is due, and end holds whose lease is over."""
        async with asyncio.TaskGroup() as both:
            both.create_task(super().serve())
            both.create_task(self._send_when_due())

    async def drain(self) -> None:
        """Send every robot its safe packet and close the device."""
        await super().drain()
        await self._driver.close()

    async def connected(self, hold: Hold) -> None:
        """Give the ARC its streams."""
        self._schedule.connect(hold.arc, hold.use.streams, hold.rank, self.clock.now_s())

    async def make_safe(self, hold: Hold) -> None:
        """Drop what the ARC loaded; the last its robots hear is the safe packet."""
        sent, overruns = self._schedule.counts().get(hold.arc, (0, 0))
        if overruns:
            self.story.note(hold.arc, f"{overruns} of {sent + overruns} packets came too late to be sent")
        self._overruns += overruns
        async with self._air:
            for packet in self._schedule.disconnect(hold.arc):
                await self._transmit(packet)

    async def command(self, asked: Envelope[Any]) -> Message:
        """Load a packet, or send it at once."""
        order: LoadPacket = asked.body
        self.admit(order.arc, order.epoch)
        packet = Packet(order.arc, order.network_id, order.payload, order.safe_payload, order.robot_epoch)
        if order.at_once:
            async with self._air:
                self.holds.admit(order.arc, order.epoch)  # it may have lost the radio while the air was busy
                self._schedule.touch(packet)
                await self._transmit(packet)
            packet = replace(packet, payload=order.afterwards)
        if packet.payload:
            self.holds.admit(order.arc, order.epoch)
            self._schedule.load(packet)
            self._loaded.set()
        return PacketLoaded()

    def statistics(self) -> dict[str, float]:
        """Count packets and overruns, in all and of the ARCs now connected."""
        counts = self._schedule.counts()
        late = {f"overruns_{arc}": float(overruns) for arc, (_, overruns) in counts.items()}
        overruns = self._overruns + sum(overruns for _, overruns in counts.values())
        return {**super().statistics(), "packets_sent": self._sent, "overruns": overruns, **late}

    async def _send_when_due(self) -> None:
        while True:
            self._loaded.clear()
            due_s = self._schedule.next_due_s()
            if due_s is None:
                await self._loaded.wait()
                continue
            await self.clock.sleep_until_s(due_s)
            async with self._air:
                sending = self._schedule.take(self.clock.now_s())
                if sending is not None:
                    await self._transmit(sending.packet)
                    await self.clock.sleep_s(sending.air_time_s)

    async def _transmit(self, packet: Packet) -> None:
        self._sent += 1
        await self._driver.transmit(packet.network_id, packet.payload, arc=packet.arc, robot_epoch=packet.robot_epoch)
