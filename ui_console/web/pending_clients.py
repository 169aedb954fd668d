"""Clients before authentication: a new client always gets a place, and may displace the client that was silent longest.

Rules of this file: no socket, no clock; a displaced client is returned; the caller disconnects it.

* Pending clients occupy no operator's place; there are at most ``MOST_PENDING``.
* One address (or IPv6 network) has at most ``MOST_OF_AN_ADDRESS``: further clients displace only clients of the same
  address.
* If all places are taken, the address with the most pending clients loses one, so addresses with few clients keep
  theirs.
* Of an address, the oldest client without a request is displaced first.
"""

from __future__ import annotations

import ipaddress
from collections import Counter
from typing import Generic, TypeVar

MOST_OF_AN_ADDRESS = 64  # chosen: a page opens six connections at a time; a team behind one address ten pages
MOST_PENDING = 128  # chosen: far below the 1024 descriptors a process usually has
IPV6_NETWORK_BITS = 64  # a provider assigns a network of this size to one household or host

PendingT = TypeVar("PendingT")


class PendingClients(Generic[PendingT]):
    """The clients before authentication, in the order of their connections."""

    def __init__(self) -> None:
        self._places: dict[PendingT, str] = {}
        self._silent: dict[PendingT, None] = {}

    def __len__(self) -> int:
        return len(self._places)

    def came(self, who: PendingT, address: str) -> PendingT | None:
        """Add a client; return the displaced client, which is removed; None: there was room.

        Args:
            who: The new client.
            address: Its address; empty: unknown.
        """
        place = place_of(address)
        counts = Counter(self._places.values())
        displaced = None
        if counts[place] >= MOST_OF_AN_ADDRESS:
            displaced = self._first_of(place)
        elif len(self._places) >= MOST_PENDING:
            displaced = self._first_of(counts.most_common(1)[0][0])
        if displaced is not None:
            self.gone(displaced)
        self._places[who] = place
        self._silent[who] = None
        return displaced

    def asked(self, who: PendingT) -> None:
        """Record that a client has sent a valid request."""
        self._silent.pop(who, None)

    def gone(self, who: PendingT) -> None:
        """Remove a client that has left or was authenticated."""
        self._places.pop(who, None)
        self._silent.pop(who, None)

    def _first_of(self, place: str) -> PendingT:
        all_there = [who for who, at in self._places.items() if at == place]
        return next((who for who in all_there if who in self._silent), all_there[0])


def place_of(address: str) -> str:
    """Return the network that counts as one address.

    Example:
        >>> place_of("192.0.2.7"), place_of("2001:db8::1:7"), place_of("fe80::1%eth0"), place_of("")
        ('192.0.2.7', '2001:db8::/64', 'fe80::/64', '')
    """
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if parsed.version == 4 or parsed.ipv4_mapped is not None:
        return str(parsed if parsed.version == 4 else parsed.ipv4_mapped)
    return str(ipaddress.ip_network((parsed, IPV6_NETWORK_BITS), strict=False))
