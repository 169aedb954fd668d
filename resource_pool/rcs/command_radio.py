"""RC of a command radio: sharable, it sends the packets of several ARCs, each at its constant interval.

Rules of this file:

* Only one packet at a time is on the air. It occupies the air for its packet time, or longer if it really takes longer.
* All packets except safe packets are sent in admitted turns. If a packet takes longer than its ARC declared, the radio
  logs that. If the driver reports times on the air, the radio also reports the longest time to the RC manager. The
  duration of a driver call is not reported, because it includes pauses of this process.
* The last packet to each robot of an ARC is its safe packet. The radio repeats a failed safe packet until it is sent.
* A reply is published unchanged. Three lost replies in a row make one warning, the next reply makes one notice.
* If the radio fails while it serves its streams, this RC ends. Its creator restarts it, and the new process opens the
  device again.

Source: IROS 2001, section 4.3; RAM 2002, "Sharable Resources".
"""

from __future__ import annotations

import asyncio
import functools
import itertools
import logging
import math
from collections import deque
from dataclasses import dataclass, replace
from typing import ClassVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.errors import Refusal
from backbone.exchange import SwapClass
from backbone.keys import Conversation
from backbone.naming import Subsystem, address, component_of
from backbone.ranges import MOST_PAYLOAD_BYTES
from backbone.rc_manager.messages import LONGEST_PACKET_S, AskRc, Connect, Disconnect, RcState, StaleEpoch
from backbone.waiting import set_within
from backbone.wire import Accepts, Envelope, Message
from resource_pool.drivers.interface import HardwareFault, RadioDriver, open_device
from resource_pool.holds import Hold
from resource_pool.link_watch import LinkNews, LinkWatch
from resource_pool.messages import (
    COMMAND_TIMEOUT_S,
    DEFAULT_DRIVE_USAGE,
    ImpossibleUse,
    LoadPacket,
    NoTurnSoon,
    PacketLoaded,
    Reply,
)
from resource_pool.packet_schedule import Packet, PacketSchedule, Sending
from resource_pool.published_motions import AskLastMove, LastMove
from resource_pool.resource_controller import RcParameters, ResourceController
from resource_pool.returned_numbers import number_between
from resource_pool.slow_packets import EVERY_S, SlowPackets
from resource_pool.stop_messages import GivenBeforeStop

log = logging.getLogger(__name__)

ONCE_WITHIN_S = 0.3  # chosen: a robot RC waits half a second for its packet to be sent; machine seconds
TRANSMIT_WITHIN_S = 1.0  # chosen: hundreds of packet times; a slower device hangs; machine seconds


@dataclass(frozen=True, slots=True)
class _Once:
    """A packet that is sent once, and the future of its outcome."""

    arc: str
    on_air: asyncio.Future[None]


class CommandRadio(ResourceController[RcParameters]):
    """Interleaves packets by network id; when an ARC is disconnected, its robots get a last, safe packet."""

    commands = LoadPacket
    accepts: ClassVar[Accepts | None] = Connect | Disconnect | AskRc | SwapClass | LoadPacket | AskLastMove
    driver_kind, driver_protocol = "radio", RadioDriver
    outlasts_s = COMMAND_TIMEOUT_S  # robots without packets stop and switch off after this time

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._driver: RadioDriver = self.make_driver(judge=self._credible, again=self._is_still_wanted)
        self._schedule = PacketSchedule()
        self._slow = SlowPackets(EVERY_S * max(1.0, clock.rate))
        self._owed: deque[Sending] = deque()
        self._air = asyncio.Lock()
        self._air_free_s = 0.0
        self._in_the_air: Packet | None = None
        self._loaded = asyncio.Event()
        self._tickets = itertools.count(1)
        self._waiting: dict[int, _Once] = {}
        self._overruns = self._sent = 0
        self._worst_packet_s = self._on_air_s = 0.0
        self._links = LinkWatch()
        self._heard_robots: set[int] = set()
        self._moved_s: dict[int, float] = {}

    async def connect(self) -> None:
        """Open the device."""
        await super().connect()
        await open_device(self._driver, self.name)

    async def serve(self) -> None:
        """Send due packets, and end holds whose leases have expired."""
        self.start_task(self._send_when_due(), "send")
        await super().serve()

    async def drain(self) -> None:
        """Send every robot its safe packet and close the device."""
        await super().drain()
        await self._driver.close()

    async def connected(self, hold: Hold) -> None:
        """Add the ARC's streams."""
        try:
            self._schedule.connect(hold.arc, hold.use.streams or [DEFAULT_DRIVE_USAGE], hold.rank)
        except ValueError as error:
            raise ImpossibleUse(f"{self.name}: {error}") from None
        self._slow.forget(hold.arc)  # of an earlier connection whose last packet was still being sent when it ended

    async def make_safe(self, hold: Hold) -> None:
        """Drop the ARC's packets, and send its robots their safe packets last."""
        count = self._schedule.counts().get(hold.arc)
        if count is not None and count.overruns:
            self.publish_event(
                hold.arc, f"{count.overruns} of its packets on {self.name} were late or lost, {count.sent} sent"
            )
            self._overruns += count.overruns
        self._owed += self._schedule.disconnect(hold.arc)
        self._slow.forget(hold.arc)
        for waiting in [one for one in self._waiting.values() if one.arc == hold.arc]:
            self._settle(waiting, StaleEpoch(f"{hold.arc} lost {self.name} before its packet's turn", epoch=hold.epoch))
        async with self._air:
            while self._owed:
                await self._transmit(self._owed[0])
                self._owed.popleft()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Also answer when a robot was moved last, for its next RC."""
        if isinstance(asked.body, AskLastMove):
            return LastMove(self._born_s, self._moved_s.get(asked.body.network_id))
        return await super().answer(asked)

    async def command(self, asked: Envelope[Message]) -> Message:
        """Load a packet, or send it once and soon."""
        order = asked.body
        if not isinstance(order, LoadPacket):
            return await super().command(asked)
        self.admit(order.arc, order.epoch)
        if order.answers:
            self._listen(order.network_id, component_of(asked.source))
        now_s = self.clock.now_s()
        packet = _packet(order, now_s)
        if self._schedule.is_overtaken(packet):
            self.applied -= 1
            raise self._overtaken(packet)
        if order.moves:
            self._moved_s[order.network_id] = now_s
        for ticket in self._schedule.hear_stop(packet):
            self._settle(self._waiting.get(ticket), self._overtaken(packet))
        if order.at_once:
            await self._send_once(packet)
        else:
            self._schedule.load(packet, now_s)
            self._loaded.set()
            await self._wait_overtaken(packet.network_id)
        return PacketLoaded()

    def ranked(self, arc: str, epoch: int) -> None:
        """Order the ARCs' packets by their new ranks."""
        hold = self.holds.find(arc, epoch)
        if hold is not None:
            self._schedule.rank(arc, hold.rank)

    def may_command(self, source: str, hold: Hold, order: Message) -> bool:
        """Return whether the source is a robot that is connected to the same ARC as the radio."""
        robot = component_of(source)
        return (
            isinstance(order, LoadPacket)
            and source == address(Subsystem.RESOURCE_POOL, robot)
            and hold.companions.get(robot) == order.robot_epoch
        )

    def rc_state(self) -> RcState:
        """Return also the packet times that are longer than declared."""
        measured = self._slow.told([hold.arc for hold in self.holds.holds()])
        return msgspec.structs.replace(super().rc_state(), measured=measured)

    def statistics(self) -> dict[str, float]:
        """Count packets, overruns and replies, in all and of the ARCs now connected, and measure times on the air."""
        counts = self._schedule.counts()
        late = {f"overruns_{arc}": float(count.overruns) for arc, count in counts.items()}
        worst = {f"worst_packet_s_{arc}": count.worst_packet_s for arc, count in counts.items()}
        return {
            **super().statistics(),
            "packets_sent": self._sent,
            "overruns": self._overruns + sum(count.overruns for count in counts.values()),
            "worst_packet_s": self._worst_packet_s,
            "on_air_s": self._on_air_s,
            **self._links.counts(),
            **late,
            **worst,
        }

    async def _send_once(self, packet: Packet) -> None:
        """Return when the packet is on the air.

        Raises:
            NoTurnSoon: Its stream is too slow; the packet is not sent.
            StaleEpoch: The ARC lost the radio before the packet's turn; the packet was not sent.
            GivenBeforeStop: The robot was stopped before the packet's turn; the packet was not sent.
            HardwareFault: The radio did not send the packet.
        """
        wait_s = self._schedule.next_turn_s(packet.arc, packet.kind, self.clock.now_s()) - self.clock.now_s()
        if wait_s > ONCE_WITHIN_S * self.clock.rate:
            raise NoTurnSoon(f"{self.name}: the next turn of {packet.arc} is in {wait_s:.1f} s", wait_s=wait_s)
        ticket = next(self._tickets)
        waiting = self._waiting[ticket] = _Once(packet.arc, asyncio.get_running_loop().create_future())
        self._schedule.send_once(replace(packet, ticket=ticket, until_s=math.inf), self.clock.now_s())
        self._loaded.set()
        try:
            await waiting.on_air
        except StaleEpoch:
            self.applied -= 1
            self.refused_stale += 1
            raise
        except GivenBeforeStop:
            self.applied -= 1
            raise
        finally:
            del self._waiting[ticket]

    async def _wait_overtaken(self, network_id: int) -> None:
        """Wait until a packet that the robot's last stop overtook in the driver is done, so that none follows."""
        last = self._in_the_air
        if last is not None and last.network_id == network_id and self._schedule.is_overtaken(last):
            async with self._air:
                await self.clock.sleep_until_s(self._air_free_s)

    def _overtaken(self, packet: Packet) -> GivenBeforeStop:
        return GivenBeforeStop(f"{self.name}: robot {packet.network_id} was stopped after this packet was made")

    def _settle(self, waiting: _Once | None, fault: Refusal | None = None) -> None:
        """Set the outcome of a packet that is sent once."""
        if waiting is None or waiting.on_air.done():
            return
        if fault is None:
            waiting.on_air.set_result(None)
        else:
            waiting.on_air.set_exception(fault)

    def _listen(self, network_id: int, robot: str) -> None:
        """Receive this robot's replies, if the radio can."""
        if hasattr(self._driver, "hear") and self._links.add(network_id, robot):
            self._heard_robots.add(network_id)
            self._driver.hear(network_id, functools.partial(self._heard, network_id))

    async def driver_exchanged(self) -> None:
        """Receive replies of the same robots with the new driver."""
        if hasattr(self._driver, "hear"):
            for network_id in sorted(self._heard_robots):
                self._driver.hear(network_id, functools.partial(self._heard, network_id))

    def _heard(self, network_id: int, payload: object) -> None:
        """Publish a reply; if there are no bytes, count a lost reply.

        Raises:
            HardwareFault: The driver delivers something else.
        """
        if not isinstance(payload, bytes | bytearray | memoryview) or len(payload) > MOST_PAYLOAD_BYTES:
            raise HardwareFault(f"the driver of {self.name} delivers {payload!r:.40}, no reply of a robot")
        if payload:
            self.bus.publish(self.address, Conversation.REPLIES, Reply(network_id, bytes(payload)))
        news = self._links.heard(network_id) if payload else self._links.lost(network_id)
        if news is not LinkNews.NONE:
            level = LogLevel.WARNING if news is LinkNews.SILENT else LogLevel.NOTICE
            self.publish_event(self._links.name_of(network_id), f"{news.value} on {self.name}", level)

    async def _send_when_due(self) -> None:
        while True:
            self._loaded.clear()
            due_s, now_s = self._schedule.next_due_s(), self.clock.now_s()
            if due_s is None or due_s > now_s:
                await set_within(self._loaded, None if due_s is None else (due_s - now_s) / self.clock.rate)
            else:
                await self._send_next()

    async def _send_next(self) -> None:
        async with self._air:
            await self.clock.sleep_until_s(self._air_free_s)  # first, because a later packet may precede in order
            sending = self._schedule.take(self.clock.now_s())
            if sending is None:
                return
            waiting = self._waiting.get(sending.packet.ticket)
            try:
                await self._transmit(sending)
            except GivenBeforeStop as overtaken:
                self._settle(waiting, overtaken)
            except HardwareFault as fault:
                if waiting is None:
                    raise
                self._settle(waiting, fault)
            else:
                self._settle(waiting)

    async def _transmit(self, sending: Sending) -> None:
        """Send the packet as soon as the air is free; the caller holds the air.

        Raises:
            HardwareFault: The radio did not send the packet, or its driver reports an impossible time on the air.
            GivenBeforeStop: The robot was stopped while the packet waited for the air or a driver; it was not sent.
        """
        await self.clock.sleep_until_s(self._air_free_s)
        if self._schedule.is_overtaken(sending.packet):
            raise self._overtaken(sending.packet)
        begun_s = self.clock.now_s()
        self._air_free_s = begun_s + sending.air_time_s
        packet = self._in_the_air = sending.packet
        try:
            async with asyncio.timeout(TRANSMIT_WITHIN_S):
                reported_s = await self._driver.transmit(
                    packet.network_id,
                    packet.payload,
                    arc=packet.arc,
                    robot_epoch=packet.robot_epoch,
                    robot_stop=packet.robot_stop,
                )
        except TimeoutError:
            raise HardwareFault(f"{self.name} accepted no packet within {TRANSMIT_WITHIN_S} s") from None
        took_s = self.clock.now_s() - begun_s if reported_s is None else reported_s
        self._air_free_s = max(self._air_free_s, begun_s + took_s)
        self._sent += 1
        self._on_air_s += took_s
        self._worst_packet_s = max(self._worst_packet_s, took_s)
        if sending.number >= 0 and reported_s is not None:
            self._measured(sending, took_s)
        for news in self._schedule.sent(sending, begun_s, took_s):
            log.warning("%s: %s", packet.arc, news)
            self.publish_event(packet.arc, f"on {self.name}: {news}")

    def _is_still_wanted(self, _method: str) -> None:
        """Refuse to repeat a packet whose robot was stopped while the new driver failed."""
        if self._in_the_air is not None and self._schedule.is_overtaken(self._in_the_air):
            raise self._overtaken(self._in_the_air)

    def _credible(self, method: str, returned: object) -> object:
        """Refuse a time on the air that is no number or would block the air for no real reason."""
        if method != "transmit" or returned is None:
            return returned
        fault = f"the driver of {self.name} reports {{}} s on the air for one packet"
        return number_between(0.0, LONGEST_PACKET_S, returned, fault)

    def _measured(self, sending: Sending, took_s: float) -> None:
        """Publish the longest time of these packets if it is new and longer than declared."""
        if self._slow.took(sending.packet.arc, sending.kind, sending.air_time_s, took_s, self.clock.now_s()):
            self.changed()


def _packet(order: LoadPacket, now_s: float) -> Packet:
    return Packet(
        order.arc,
        order.network_id,
        order.payload,
        order.safe_payload,
        order.robot_epoch,
        until_s=now_s + order.lasts_s if order.lasts_s > 0 else math.inf,
        afterwards=order.afterwards,
        kind=order.kind,
        moves=order.moves,
        robot_stop=order.robot_stop,
    )
