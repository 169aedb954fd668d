"""Drivers of simulated hardware that need neither renderer nor arrays: the radio, and the Scout's protocol."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Annotated

import msgspec

from backbone.bus.interface import Subscription
from backbone.component.asking import ask_until_answered
from backbone.errors import LinkError
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.wire import Envelope
from resource_pool.drivers.interface import DriverSite, HardwareFault, MalformedReply, ScoutReports
from resource_pool.drivers.reply_turns import ReplyTurns
from resource_pool.drivers.world_messages import AskWorld, RadioPacket, ReplyOnAir, WorldModel
from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.scout import clip_wheel_speed

REPLY_EVERY_S = 0.5  # chosen: a person reads a gauge no faster; mission seconds, machine seconds if the clock is faster
FIRST_REPLY_BITS = radio_link.packet_bits(bytes(4))  # chosen: a Scout's; later the last reply's length is known
WORLD_START_S = 50.0  # chosen: 250 Scouts beside other work took over 20; less than an RC waits for its driver


async def meet_world(site: DriverSite) -> WorldModel:
    """Ask the world for its model, and ask again until it answers.

    Raises:
        HardwareFault: The world did not answer within ``WORLD_START_S``.
    """
    try:
        return await ask_until_answered(
            site.bus, site.clock, world_of(site), AskWorld(), WorldModel, each_s=2.0, within_s=WORLD_START_S
        )
    except LinkError as error:
        raise HardwareFault(
            f"{site.resource}: no simulated world {site.parameters.world!r}: {error}",
            remedy="See the state of the world with 'scout-backbone status'; a large one on a busy host takes long.",
        ) from error


def world_of(site: DriverSite) -> str:
    """Return the address of the world that simulates this hardware."""
    return address(Subsystem.RESOURCE_POOL, site.parameters.world)


class RadioOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a simulated radio.

    Attributes:
        bits_per_s: Its bit rate. If a packet takes longer than its ARC declared, the radio raises an alarm and the RC
            manager plans with the longer time.
    """

    bits_per_s: Annotated[float, msgspec.Meta(gt=0)] = 115_200.0


class SimulatedRadio:
    """A radio that sends its packets to the simulated world, in order."""

    opens_beside = True
    options_type = RadioOptions

    def __init__(self, site: DriverSite) -> None:
        self._site, self._world = site, world_of(site)
        self._bits_per_s = site.options(RadioOptions).bits_per_s
        self._numbers = itertools.count()
        self._turns = ReplyTurns(REPLY_EVERY_S * max(1.0, site.clock.rate))
        self._hearing: dict[int, Callable[[bytes], None]] = {}
        self._reply_bits: dict[int, int] = {}
        self._replies: Subscription | None = None

    def adjust(self, site: DriverSite) -> None:
        """Send at the new rate from the next packet on."""
        self._bits_per_s = site.options(RadioOptions).bits_per_s

    async def open(self) -> None:
        """Return at once: packets to a missing world are lost, as on the air."""

    async def transmit(
        self, network_id: int, payload: bytes, *, arc: str, robot_epoch: int, robot_stop: int = 0
    ) -> float | None:
        """Send the packet without an acknowledgment, as on the air.

        Return the time of its bytes on the air. If it asks for a reply, add the time of a reply as long as the robot's
        last.
        """
        air_time_s = radio_link.packet_bits(payload) / self._bits_per_s
        asks = network_id in self._hearing and self._ask(network_id)
        packet = RadioPacket(
            self._site.resource,
            network_id,
            payload,
            arc,
            robot_epoch,
            number=next(self._numbers),
            air_time_s=air_time_s,
            robot_stop=robot_stop,
            asks=asks,
        )
        self._site.bus.publish(self._world, Conversation.COMMAND, packet)
        reply_bits = self._reply_bits.get(network_id, FIRST_REPLY_BITS) if asks else 0
        return air_time_s + reply_bits / self._bits_per_s

    def hear(self, network_id: int, heard: Callable[[bytes], None]) -> None:
        """Ask this robot for a reply every ``REPLY_EVERY_S``; a reply that has not arrived by then is lost."""
        self._hearing[network_id] = heard
        if self._replies is None:
            own = address(Subsystem.RESOURCE_POOL, self._site.resource)
            self._replies = self._site.bus.subscribe(own, Conversation.COMMAND, ReplyOnAir, self._heard)

    async def close(self) -> None:
        """Stop receiving replies, until ``hear`` is called again."""
        if self._replies is not None:
            self._replies.close()
            self._replies = None

    def _ask(self, network_id: int) -> bool:
        turn = self._turns.take(network_id, self._site.clock.now_s())
        if turn.is_lost:
            self._hearing[network_id](b"")
        return turn.asks

    def _heard(self, envelope: Envelope[ReplyOnAir]) -> None:
        reply = envelope.body
        heard = self._hearing.get(reply.network_id)
        if heard is None or not reply.payload:
            return
        self._turns.heard(reply.network_id)
        self._reply_bits[reply.network_id] = radio_link.packet_bits(reply.payload)
        heard(reply.payload)


class SimulatedRobotProtocol:
    """Encodes the packets that every simulated robot understands; derive and add the packets of your kind of robot."""

    def __init__(self, site: DriverSite) -> None:
        self._site = site

    def halt(self) -> bytes:
        """Return the packet that stops all motion."""
        return radio_link.encode_halt()

    def transmitter(self, on: bool, frequency: str) -> bytes:
        """Return the packet that switches the transmitter on or off."""
        if not on:
            return radio_link.encode_transmitter_off()
        try:
            return radio_link.encode_transmitter_on(frequency)
        except MalformedPacket as error:
            raise HardwareFault(f"{self._site.resource}: {error}") from error

    def safe(self) -> bytes:
        """Return the packet after which the robot neither moves nor transmits."""
        return radio_link.encode_safe()


class SimulatedScoutProtocol(SimulatedRobotProtocol):
    """Encodes packets for the simulated Scout's firmware."""

    def clip_wheel_speed(self, speed_rad_s: float) -> float:
        """Return the speed within the motor's limits, rad/s."""
        return clip_wheel_speed(speed_rad_s)

    def drive(self, left_rad_s: float, right_rad_s: float) -> bytes:
        """Return the packet for these wheel speeds."""
        return radio_link.encode_drive(left_rad_s, right_rad_s)

    def jump(self) -> bytes:
        """Return the packet for a jump."""
        return radio_link.encode_jump()

    def read(self, payload: bytes) -> ScoutReports:
        """Return a Scout's reply; see ``ReplyReader``."""
        try:
            reply = radio_link.decode_reply(payload)
        except MalformedPacket as error:
            raise MalformedReply(f"{self._site.resource}: {error}") from error
        return ScoutReports(reply.battery, reply.tilt_rad, reply.load)
