"""Which packet the radio sends next: periodic streams of several ARCs on one channel.

Rules of this file:

* A packet once begun is sent (non-preemptive).
* First the ARC of higher user priority, then the shorter period, then the name.
* What is repeated has an age: a packet that is not loaded anew in time gives way to what comes after it.
* Each stream has a constant interval from the first packet on; a release not served before the next one is
  an overrun and lost.
* An ARC's packets reach only the robots it loaded packets for; several of its robots take turns.

Pure; times are mission seconds.

Source: RAM 2002, "Sharable Resources"; IROS 2001, section 4.3 (rate monotonic below user priority).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from backbone.rc_manager.messages import Usage


@dataclass(frozen=True, slots=True)
class Packet:
    """Bytes for one robot.

    Attributes:
        arc: On whose behalf.
        network_id: Of the robot.
        payload: Bytes of the robot's protocol.
        safe_payload: What is to be sent to it last of all.
        robot_epoch: Of the robot RC's connection.
        until_s: Mission time from which ``afterwards`` is sent in its place.
        afterwards: See ``until_s``; empty: ``safe_payload``.
    """

    arc: str
    network_id: int
    payload: bytes
    safe_payload: bytes
    robot_epoch: int
    until_s: float = math.inf
    afterwards: bytes = b""

    def at(self, now_s: float) -> Packet:
        """Return what is to be sent at this time: itself, or what comes after it."""
        if now_s < self.until_s:
            return self
        return replace(self, payload=self.afterwards or self.safe_payload, until_s=math.inf)


@dataclass(slots=True)
class _Stream:
    usage: Usage
    first_s: float
    releases: int = 0
    overruns: int = 0
    sent: int = 0

    @property
    def next_release_s(self) -> float:
        return self.first_s + self.releases * self.usage.period_s


@dataclass(slots=True)
class _Sender:
    """One ARC on the radio."""

    rank: int
    streams: list[_Stream]
    packets: dict[int, Packet] = field(default_factory=dict)
    touched: dict[int, Packet] = field(default_factory=dict)
    turn: int = 0


@dataclass(frozen=True, slots=True)
class Sending:
    """One packet and how long it occupies the air, seconds."""

    packet: Packet
    air_time_s: float


class PacketSchedule:
    """The streams of one radio."""

    def __init__(self) -> None:
        self._senders: dict[str, _Sender] = {}

    def connect(self, arc: str, streams: list[Usage], rank: int, now_s: float) -> None:
        """Give the ARC its streams; their first releases come with its first packet.

        Raises:
            ValueError: A period or packet time is no span of time above 0; nothing has changed.
        """
        for usage in streams:
            if not (0 < usage.period_s < math.inf and 0 < usage.packet_time_s < math.inf):
                raise ValueError(f"{arc}: packets of {usage.packet_time_s} s every {usage.period_s} s")
        self._senders[arc] = _Sender(rank, [_Stream(usage, now_s) for usage in streams])

    def disconnect(self, arc: str) -> list[Sending]:
        """Forget the ARC and all it loaded; return for each of its robots the packet that must be sent last."""
        sender = self._senders.pop(arc, None)
        if sender is None:
            return []
        air_time_s = _air_time_s(sender)
        return [
            Sending(Packet(p.arc, p.network_id, p.safe_payload, p.safe_payload, p.robot_epoch), air_time_s)
            for _, p in sorted(sender.touched.items())
        ]

    def touch(self, packet: Packet) -> None:
        """Note that the ARC speaks to this robot, so that its safe packet is owed."""
        self._senders[packet.arc].touched[packet.network_id] = packet

    def load(self, packet: Packet, now_s: float) -> None:
        """Send this packet at the ARC's rate from now on."""
        self.touch(packet)
        sender = self._senders[packet.arc]
        if not sender.packets:
            for stream in sender.streams:
                stream.first_s = now_s
        sender.packets[packet.network_id] = packet

    def air_time_s(self, arc: str) -> float:
        """Return how long one of the ARC's packets occupies the air."""
        return _air_time_s(self._senders[arc])

    def next_due_s(self) -> float | None:
        """Return the earliest release of a stream that has something to send; None if there is none."""
        releases = [s.next_release_s for sender in self._senders.values() if sender.packets for s in sender.streams]
        return min(releases, default=None)

    def take(self, now_s: float) -> Sending | None:
        """Return the packet whose turn it is, counted as sent; None if none is due."""
        due = [
            (sender.rank, stream.usage.period_s, arc, number)
            for arc, sender in self._senders.items()
            if sender.packets
            for number, stream in enumerate(sender.streams)
            if stream.next_release_s <= now_s
        ]
        if not due:
            return None
        _, _, arc, number = min(due)
        sender = self._senders[arc]
        stream = sender.streams[number]
        missed = int((now_s - stream.next_release_s) / stream.usage.period_s)
        stream.overruns += missed
        stream.releases += missed + 1
        stream.sent += 1
        robots = sorted(sender.packets)
        robot = robots[sender.turn % len(robots)]
        packet = sender.packets[robot] = sender.packets[robot].at(now_s)
        sender.turn += 1
        return Sending(packet, stream.usage.packet_time_s)

    def counts(self) -> dict[str, tuple[int, int]]:
        """Return packets sent and overruns of each ARC now connected."""
        return {
            arc: (sum(s.sent for s in sender.streams), sum(s.overruns for s in sender.streams))
            for arc, sender in self._senders.items()
        }


def _air_time_s(sender: _Sender) -> float:
    return max((stream.usage.packet_time_s for stream in sender.streams), default=0.0)
