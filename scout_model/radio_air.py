"""The command radio's air: decides which packets reach their robots, and when.

A packet arrives whole or not at all.  It is lost with a probability that grows with its length and the
robot's distance. Besides that, a loss depends only on seed, radio and the packet's number, so an additional packet on
one radio affects no packet on another. Replies have their own random numbers, so a reply affects no packet.

IROS 2001, section 2: each robot has a network id of its own, which lets one radio serve many.
"""

from __future__ import annotations

import heapq
import itertools
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from scout_model.air import LIGHT_M_PER_S, counted_distance_m, key_of, packet_loss
from scout_model.description import AirDescription
from scout_model.dimensions import COMMAND_TIMEOUT_S
from scout_model.radio_link import packet_bits


@dataclass(frozen=True, slots=True)
class Sent:
    """A packet as it leaves a radio.

    Attributes:
        number: Number of the packet on its radio, 0 or more.
        network_id: Network id of the receiving robot.
        payload: As ``scout_model.radio_link`` encodes it.
        begun_s: Time of its first bit.
        air_time_s: Duration of its bits, 0 or more.
        asks: Whether it asks its robot for a reply.
    """

    radio: str
    number: int
    network_id: int
    payload: bytes
    begun_s: float
    air_time_s: float
    asks: bool = False


class RadioAir:
    """Packets in one direction between the base's antenna and the robots.

    Args:
        air: Delays and losses of packets.
        way: Name of the direction; each has its own random numbers. Empty: to the robots.
    """

    def __init__(self, seed: int, air: AirDescription, way: str = "") -> None:
        self._seed, self._air, self._way = abs(seed), air, way
        self._flying: list[tuple[float, int, Sent]] = []
        self._order = itertools.count()
        self._last_s: dict[int, float] = {}  # network id → arrival of its last packet: no packet overtakes another
        self._delivered: Counter[int] = Counter()
        self._lost: Counter[int] = Counter()
        self.for_no_robot = 0
        """Number of packets to ids without a robot."""

    @property
    def delivered(self) -> Mapping[int, int]:
        """Network id → packets that arrived."""
        return MappingProxyType(self._delivered)

    @property
    def lost(self) -> Mapping[int, int]:
        """Network id → packets that will never arrive."""
        return MappingProxyType(self._lost)

    def send(self, sent: Sent, away_m: float | None) -> None:
        """Put a packet on the air.

        Args:
            away_m: Distance of its robot from the antenna, above 0; None: no robot has the id.
        """
        if away_m is None:
            self.for_no_robot += 1
        elif self._is_lost(sent, away_m):
            self._lost[sent.network_id] += 1
        else:
            at_s = sent.begun_s + sent.air_time_s + away_m / LIGHT_M_PER_S + self._air.radio_delay_s
            last_s = self._last_s.get(sent.network_id, at_s)
            if at_s < last_s <= at_s + COMMAND_TIMEOUT_S:  # after a longer wait a robot has stopped by itself
                at_s = last_s
            self._last_s[sent.network_id] = at_s
            heapq.heappush(self._flying, (at_s, next(self._order), sent))

    def arrived(self, now_s: float) -> list[Sent]:
        """Return the packets that have arrived since the last call, in order of arrival."""
        arrived = []
        while self._flying and self._flying[0][0] <= now_s:
            _, _, sent = heapq.heappop(self._flying)
            self._delivered[sent.network_id] += 1
            arrived.append(sent)
        return arrived

    def _is_lost(self, sent: Sent, away_m: float) -> bool:
        by_distance = packet_loss(counted_distance_m(away_m, self._air.weak_signal), packet_bits(sent.payload))
        lost = 1.0 - (1.0 - by_distance) * (1.0 - self._air.radio_loss)
        if lost == 0.0:
            return False
        dice = np.random.default_rng((self._seed, key_of(self._way + sent.radio), sent.number))
        return bool(dice.random() < lost)
