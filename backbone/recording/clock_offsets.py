"""Offsets between the clocks of a mission's hosts, computed from the causes of recorded messages. Pure.

No message is sent before the message that led to it. If a message of host B has a cause of host A, then the clock of B
is ahead of that of A by at most the difference of the two stamps. A cause in the other direction bounds the offset from
below. Such bounds form a difference constraint graph, and shortest paths in it give the tightest bounds of each clock.

Source: R. Dechter, I. Meiri, J. Pearl, "Temporal constraint networks", Artificial Intelligence 49 (1991): a simple
temporal network, whose minimal network is solved without backtracking.
"""

from __future__ import annotations

import itertools
import math
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from backbone.addresses import NAMESERVER
from backbone.naming import Subsystem
from backbone.recording.reader import Recorded

MOST_REMEMBERED = 100_000  # chosen: the messages of a busy mission in a minute; effects follow their causes sooner
EXACT_S = 1e-6  # chosen: no two messages are so close, and stamps of a year are exact to 4 ns
MOST_OFFSET_S = 60.0  # as ``writer.MOST_AHEAD_S``: beyond it an id is that of another life of its sender

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Offset:
    """How far the clock of a host is ahead of the reference's; behind it, if negative.

    Attributes:
        at_least_s: Lower bound; minus infinity: no cause bounds it.
        at_most_s: Upper bound; infinity: no cause bounds it.
        taken_s: Offset that agrees with all causes: 0 if possible, else the middle of the range that the other hosts
            leave.
        moved_s: Smallest change of the offset that explains all causes; the bounds are widened by it, half on each
            side. 0: one constant offset explains them.
    """

    at_least_s: float
    at_most_s: float
    taken_s: float
    moved_s: float = 0.0


@dataclass(frozen=True, slots=True)
class ClockOffsets:
    """Offsets of all clocks.

    Attributes:
        reference: Host of the nameserver, whose clock is the mission's time.
        hosts: Sender → its host; a sender with an unknown or changing host counts as a host of its own.
        offsets: Host → offset, in the order in which they were computed; without the reference.
    """

    reference: str = NAMESERVER
    hosts: Mapping[str, str] = field(default_factory=dict)
    offsets: Mapping[str, Offset] = field(default_factory=dict)

    def of(self, source: str) -> float:
        """Return how far the stamps of this sender are ahead of the reference's clock, seconds."""
        found = self.offsets.get(self.hosts.get(source, source))
        return found.taken_s if found is not None else 0.0

    @property
    def wrong(self) -> dict[str, Offset]:
        """Offsets of the clocks that were certainly wrong at some time."""
        return {host: offset for host, offset in self.offsets.items() if offset.taken_s or offset.moved_s}


class ClockObserver:
    """Computes the offsets of clocks from messages, given in the order of sending.

    Messages of senders that restarted do not count as causes, because an id is unique only while its sender lives.
    """

    def __init__(self) -> None:
        self._named: dict[str, set[str]] = {}
        self._last: dict[str, tuple[int, float]] = {}
        self._restarted: set[str] = set()
        self._sent: OrderedDict[str, float] = OrderedDict()
        self._awaited: OrderedDict[str, dict[str, float]] = OrderedDict()
        self._gaps: dict[tuple[str, str], float] = {}

    def watched(self, messages: Iterable[Recorded]) -> Iterator[Recorded]:
        """Yield the messages unchanged, and use each for the offsets."""
        for message in messages:
            self.take(message)
            yield message

    def take(self, message: Recorded) -> None:
        """Use a message for the offsets; ignore it if its sender or stamp is not credible."""
        source, at_s = message.source, message.at_s
        if not message.schema or not source or abs(message.stamp_s - at_s) > MOST_OFFSET_S:
            return
        self._note_host(source, message.schema, message.body)
        sequence, last_s = self._last.get(source, (0, -math.inf))
        if message.sequence < sequence and at_s > last_s:
            self._restarted.add(source)
        self._last[source] = message.sequence, at_s
        for effect, effect_s in self._awaited.pop(message.id, {}).items():
            self._note_gap(source, effect, effect_s - at_s)
        _remember(self._sent, message.id, at_s)
        cause = message.cause.rpartition("#")[0]
        if not cause or cause == source:
            return
        if message.cause in self._sent:
            self._note_gap(cause, source, at_s - self._sent[message.cause])
        else:
            earliest = self._awaited.get(message.cause, {})
            earliest.setdefault(source, at_s)
            _remember(self._awaited, message.cause, earliest)

    def offsets(self) -> ClockOffsets:
        """Return the offsets as known so far."""
        hosts = {source: next(iter(named)) for source, named in self._named.items() if len(named) == 1}
        reference = hosts.get(NAMESERVER, NAMESERVER)
        gaps: dict[tuple[str, str], float] = {}
        for (cause, effect), gap_s in self._gaps.items():
            pair = hosts.get(cause, cause), hosts.get(effect, effect)
            if pair[0] != pair[1] and cause not in self._restarted:
                gaps[pair] = min(gap_s, gaps.get(pair, math.inf))
        known = set(hosts.values())
        order = sorted(
            {host for pair in gaps for host in pair} - {reference}, key=lambda host: (host not in known, host)
        )
        return ClockOffsets(reference, hosts, solved(gaps, [reference, *order]))

    def _note_host(self, source: str, schema: str, body: Any) -> None:
        """Record a component's host; a console keeps its own mission time, so it counts as a host of its own."""
        if schema.startswith("ComponentState/") and isinstance(body, dict) and body.get("address") == source:
            own = source.startswith(f"{Subsystem.UI_CONSOLE}/")
            self._named.setdefault(source, set()).add(source if own else str(body.get("host") or source))

    def _note_gap(self, cause: str, effect: str, gap_s: float) -> None:
        if gap_s >= -MOST_OFFSET_S:
            self._gaps[cause, effect] = min(gap_s, self._gaps.get((cause, effect), math.inf))


def solved(gaps: Mapping[tuple[str, str], float], hosts: list[str]) -> dict[str, Offset]:
    """Return the offset of each host but the first, which is the reference.

    Args:
        gaps: (Host, other host) → upper bound of how far the other's clock is ahead of the host's, seconds.
        hosts: The reference first; if a host contradicts the hosts before it, its clock has moved.
    """
    most = {(hosts[0], hosts[0]): 0.0}
    moved: dict[str, float] = {}
    for number, host in enumerate(hosts[1:], 1):
        before = hosts[:number]
        to = {one: min(most[one, via] + gaps.get((via, host), math.inf) for via in before) for one in before}
        back = {one: min(gaps.get((host, via), math.inf) + most[via, one] for via in before) for one in before}
        lacks_s = max(-to[one] - back[one] for one in before)
        moved[host] = lacks_s if lacks_s > EXACT_S else 0.0
        for one in before:
            most[one, host], most[host, one] = to[one] + moved[host] / 2, back[one] + moved[host] / 2
        for one, other in itertools.product(before, before):
            most[one, other] = min(most[one, other], most[one, host] + most[host, other])
        most[host, host] = 0.0
    return _taken(most, moved, hosts)


def _taken(most: Mapping[tuple[str, str], float], moved: Mapping[str, float], hosts: list[str]) -> dict[str, Offset]:
    """Return an offset for each host but the first; in a minimal network each choice allows one for the next host."""
    taken = {hosts[0]: 0.0}
    offsets = {}
    for host in hosts[1:]:
        at_least_s = max(offset_s - most[host, one] for one, offset_s in taken.items())
        at_most_s = min(offset_s + most[one, host] for one, offset_s in taken.items())
        taken[host] = _nearest_to_right(at_least_s, at_most_s)
        offsets[host] = Offset(-most[host, hosts[0]], most[hosts[0], host], taken[host], moved[host])
    return offsets


def _nearest_to_right(at_least_s: float, at_most_s: float) -> float:
    if at_least_s <= EXACT_S and at_most_s >= -EXACT_S:
        return 0.0
    if math.isfinite(at_least_s) and math.isfinite(at_most_s):
        return (at_least_s + at_most_s) / 2
    return at_least_s if math.isfinite(at_least_s) else at_most_s


def _remember(remembered: OrderedDict[str, Value], name: str, value: Value) -> None:
    remembered[name] = value
    if len(remembered) > MOST_REMEMBERED:
        remembered.popitem(last=False)
