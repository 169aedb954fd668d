"""Packet schedule: the next packet of a radio, from periodic streams of several ARCs on one channel.

Rules of this file:

* A packet is never interrupted (non-preemptive).
* Packets are ordered by user priority of the ARC, then by shorter period, then by name.
* A repeated packet that is not loaded again in time is replaced by its ``afterwards``.
* Each kind of packet is a stream of its own with a constant interval from its first packet on. An urgent packet takes
  the next turn of its stream. So no stream sends more than was admitted, and no other stream is late.
* A packet that is not finished by its deadline is an overrun; a packet that has not begun by then is lost. The deadline
  is the next release unless the ARC stated another.
* An ARC's packets go only to the robots for which it loaded packets; if it has several robots, they take turns.
* If a packet moves a robot and was made before the robot's last stop, it is not sent, whether it already waits or
  arrives later.

Pure; times are mission seconds.

Source: RAM 2002, "Sharable Resources"; IROS 2001, section 4.3 (rate monotonic below user priority).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace

from backbone.scheduling.requests import Usage

MAIN_KIND = "drive"  # chosen: the stream whose packets keep a robot running
INSTANT_S = 1e-9  # chosen: far above the rounding of mission times, far below a packet
REPORTS_KEPT = 1000  # chosen: the ARCs of a busy day; a fault of an earlier one is news again


@dataclass(frozen=True, slots=True)
class Packet:
    """Bytes for one robot.

    Attributes:
        arc: The ARC that commands the robot.
        payload: Bytes of the robot's protocol.
        safe_payload: The robot's last packet.
        robot_epoch: Epoch of the robot RC's connection.
        until_s: Mission time from which ``afterwards`` is sent in its place.
        afterwards: See ``until_s``; empty: ``safe_payload``. For a packet that is sent once: the packet that the ARC's
            main stream repeats from then on; empty: the one before.
        kind: Kind of its stream; the ARC's first stream if the ARC has none of this kind.
        ticket: Id of a packet that is sent once; 0: it is repeated.
        moves: True if it moves the robot.
        robot_stop: Number of the robot's last stop when it was made.
    """

    arc: str
    network_id: int
    payload: bytes
    safe_payload: bytes
    robot_epoch: int
    until_s: float = math.inf
    afterwards: bytes = b""
    kind: str = ""
    ticket: int = 0
    moves: bool = False
    robot_stop: int = 0

    def at(self, now_s: float) -> Packet:
        """Return the packet to send at this time: this packet, or its ``afterwards``."""
        if now_s < self.until_s:
            return self
        return replace(self, payload=self.afterwards or self.safe_payload, until_s=math.inf, moves=False)


@dataclass(slots=True)
class _Stream:
    """Packets of one kind of one ARC; ``first_s`` is None while there is no packet."""

    usage: Usage
    first_s: float | None = None
    releases: int = 0
    earliest_s: float = -math.inf
    packets: dict[int, Packet] = field(default_factory=dict)
    urgent: deque[Packet] = field(default_factory=deque)
    turn: int = 0
    sent: int = 0
    overruns: int = 0

    @property
    def deadline_s(self) -> float:
        return self.usage.deadline_s or self.usage.period_s

    @property
    def next_release_s(self) -> float:
        return math.inf if self.first_s is None else self.first_s + self.releases * self.usage.period_s

    def begin(self, now_s: float) -> None:
        """Release packets from now on, but not before a period has passed since the last release."""
        if self.first_s is None:
            self.first_s, self.releases = max(now_s, self.earliest_s), 0

    def take(self, now_s: float) -> tuple[Packet, float]:
        """Return the packet of the due release and the time of the release; earlier releases are lost."""
        period_s = self.usage.period_s
        longest_s = max(self.deadline_s, period_s)
        lost = max(0, math.floor((now_s - self.next_release_s - longest_s + INSTANT_S) / period_s) + 1)
        self.overruns += lost
        self.releases += lost
        release_s = self.next_release_s
        self.releases += 1
        self.sent += 1
        self.earliest_s = self.next_release_s
        packet = self._next_packet(now_s)
        if not self.packets and not self.urgent:
            self.first_s = None
        return packet, release_s

    def stopped(self, network_id: int, stop: int) -> list[int]:
        """Drop packets that move the robot, and mark the others as made after the stop; return the dropped tickets."""
        dropped = [once.ticket for once in self.urgent if once.network_id == network_id and once.moves]
        self.urgent = deque(
            replace(once, robot_stop=stop) if once.network_id == network_id else once
            for once in self.urgent
            if once.network_id != network_id or not once.moves
        )
        repeated = self.packets.get(network_id)
        if repeated is not None:
            still = repeated.at(math.inf) if repeated.moves else repeated
            self.packets[network_id] = replace(still, robot_stop=stop)
        if not self.packets and not self.urgent:
            self.first_s = None
        return dropped

    def _next_packet(self, now_s: float) -> Packet:
        if self.urgent:
            return self.urgent.popleft()
        robots = sorted(self.packets)
        robot = robots[self.turn % len(robots)]
        self.turn += 1
        packet = self.packets[robot] = self.packets[robot].at(now_s)
        return packet


@dataclass(slots=True)
class _Sender:
    """One ARC on the radio."""

    rank: int
    streams: list[_Stream]
    touched: dict[int, Packet] = field(default_factory=dict)
    stops: dict[int, int] = field(default_factory=dict)
    worst_packet_s: float = 0.0

    def stream_of(self, kind: str) -> _Stream:
        return next((stream for stream in self.streams if stream.usage.kind == kind), self.streams[0])

    @property
    def main(self) -> _Stream:
        return self.stream_of(MAIN_KIND)


@dataclass(frozen=True, slots=True)
class Sending:
    """A packet that is due.

    Attributes:
        air_time_s: Its admitted time on the air.
        kind: Kind of its stream, as the ARC's request names it.
        number: Number of its stream; -1: no stream, because it is a safe packet.
        release_s: Mission time of its release.
    """

    packet: Packet
    air_time_s: float
    number: int = -1
    release_s: float = math.inf
    kind: str = ""


@dataclass(frozen=True, slots=True)
class ArcCount:
    """Counts of one ARC since its connection.

    Attributes:
        sent: Packets sent in its turns.
        overruns: Requests late or lost.
        worst_packet_s: Longest measured time of one of its packets on the air.
    """

    sent: int
    overruns: int
    worst_packet_s: float


class PacketSchedule:
    """The streams of one radio."""

    def __init__(self) -> None:
        self._senders: dict[str, _Sender] = {}
        self._reported: dict[tuple[str, int, str], None] = {}

    def connect(self, arc: str, streams: list[Usage], rank: int) -> None:
        """Add the ARC's streams; each begins with its first packet.

        Raises:
            ValueError: The list is empty, or a period or packet time is not above 0 and finite; nothing is changed.
        """
        if not streams:
            raise ValueError(f"{arc}: no stream of packets")
        for usage in streams:
            if not (0 < usage.period_s < math.inf and 0 < usage.packet_time_s < math.inf):
                raise ValueError(f"{arc}: packets of {usage.packet_time_s} s every {usage.period_s} s")
            if not 0 <= usage.deadline_s < math.inf:
                raise ValueError(f"{arc}: a deadline of {usage.deadline_s} s")
        self._senders[arc] = _Sender(rank, [_Stream(usage) for usage in streams])

    def rank(self, arc: str, rank: int) -> None:
        """Set the ARC's place by user priority, if it is connected; 0 is first."""
        if arc in self._senders:
            self._senders[arc].rank = rank

    def disconnect(self, arc: str) -> list[Sending]:
        """Remove the ARC and its packets; return the last packet for each of its robots."""
        sender = self._senders.pop(arc, None)
        if sender is None:
            return []
        air_time_s = max(stream.usage.packet_time_s for stream in sender.streams)
        return [
            Sending(
                Packet(p.arc, p.network_id, p.safe_payload, p.safe_payload, p.robot_epoch, robot_stop=p.robot_stop),
                air_time_s,
            )
            for _, p in sorted(sender.touched.items())
        ]

    def is_overtaken(self, packet: Packet) -> bool:
        """Return whether the packet moves its robot and was made before a known stop."""
        sender = self._senders.get(packet.arc)
        return packet.moves and sender is not None and packet.robot_stop < sender.stops.get(packet.network_id, 0)

    def hear_stop(self, packet: Packet) -> list[int]:
        """Record the stop before which the packet was not made; return the tickets of packets that are now dropped."""
        sender = self._senders[packet.arc]
        if packet.robot_stop <= sender.stops.get(packet.network_id, 0):
            return []
        sender.stops[packet.network_id] = packet.robot_stop
        return [ticket for stream in sender.streams for ticket in stream.stopped(packet.network_id, packet.robot_stop)]

    def load(self, packet: Packet, now_s: float) -> None:
        """Send this packet at its stream's rate from now on."""
        sender = self._senders[packet.arc]
        sender.touched[packet.network_id] = packet
        stream = sender.stream_of(packet.kind)
        stream.packets[packet.network_id] = packet
        stream.begin(now_s)
        if stream is sender.main:  # this packet is newer than the ``afterwards`` of a waiting packet
            for other in sender.streams:
                for place, once in enumerate(other.urgent):
                    if once.network_id == packet.network_id:
                        other.urgent[place] = replace(once, afterwards=b"")

    def send_once(self, packet: Packet, now_s: float) -> None:
        """Send this packet in the next turn of its stream, before the repeated packet."""
        sender = self._senders[packet.arc]
        sender.touched[packet.network_id] = packet
        stream = sender.stream_of(packet.kind)
        stream.urgent.append(packet)
        stream.begin(now_s)

    def next_turn_s(self, arc: str, kind: str, now_s: float) -> float:
        """Return the time of the next turn for a packet of this kind that is sent once."""
        stream = self._senders[arc].stream_of(kind)
        if stream.first_s is None:
            return max(now_s, stream.earliest_s)
        return stream.next_release_s + len(stream.urgent) * stream.usage.period_s

    def next_due_s(self) -> float | None:
        """Return the earliest release of all streams with packets; None without a packet."""
        earliest_s = min((s.next_release_s for one in self._senders.values() for s in one.streams), default=math.inf)
        return earliest_s if earliest_s < math.inf else None

    def take(self, now_s: float) -> Sending | None:
        """Return the due packet and count it as sent; None if no packet is due."""
        due = [
            (sender.rank, stream.usage.period_s, arc, number)
            for arc, sender in self._senders.items()
            for number, stream in enumerate(sender.streams)
            if stream.next_release_s <= now_s + INSTANT_S
        ]
        if not due:
            return None
        _, _, arc, number = min(due)
        sender = self._senders[arc]
        stream = sender.streams[number]
        packet, release_s = stream.take(now_s)
        if packet.ticket and packet.afterwards:  # the previously repeated packet might cancel it
            repeated = replace(packet, payload=packet.afterwards, afterwards=b"", kind=MAIN_KIND, ticket=0)
            sender.main.packets[packet.network_id] = repeated
            sender.main.begin(now_s)
        return Sending(packet, stream.usage.packet_time_s, number, release_s, stream.usage.kind)

    def sent(self, sending: Sending, begun_s: float, took_s: float) -> list[str]:
        """Record the packet's measured time on the air.

        Args:
            sending: As returned by ``take``.
            begun_s: Mission time of its begin.

        Returns:
            Faults that this stream has for the first time, as text for people.
        """
        arc, number = sending.packet.arc, sending.number
        sender = self._senders.get(arc)
        if sender is None or not 0 <= number < len(sender.streams):
            return []  # the ARC was disconnected meanwhile
        sender.worst_packet_s = max(sender.worst_packet_s, took_s)
        stream = sender.streams[number]
        what = f"{stream.usage.kind or 'its'} packets"
        if begun_s + max(took_s, sending.air_time_s) > sending.release_s + stream.deadline_s + INSTANT_S:
            stream.overruns += 1
        news = []
        if took_s > sending.air_time_s + INSTANT_S:
            declared = f"{took_s * 1e3:.3g} ms on the air, {sending.air_time_s * 1e3:.3g} ms were declared"
            news.append(("slow", f"{what} take {declared}: no deadline on this radio is certain"))
        if stream.overruns:
            news.append(("late", f"{what} are not always done within {stream.deadline_s:g} s of their release"))
        found = [(fault, line) for fault, line in news if (arc, number, fault) not in self._reported]
        self._reported |= {(arc, number, fault): None for fault, _ in found}
        while len(self._reported) > REPORTS_KEPT:
            del self._reported[next(iter(self._reported))]
        return [line for _, line in found]

    def counts(self) -> dict[str, ArcCount]:
        """Return the counts of each connected ARC."""
        return {
            arc: ArcCount(
                sum(s.sent for s in sender.streams), sum(s.overruns for s in sender.streams), sender.worst_packet_s
            )
            for arc, sender in self._senders.items()
        }
