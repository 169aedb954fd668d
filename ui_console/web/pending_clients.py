"""Clients without a token: a new one always gets a place, and may displace the one that was silent for longest.

Rules of this file: no socket, no clock; a displaced client is returned, not cut off.

* Pending clients take no operator's place, and there are never more of them than ``MOST_PENDING``.
* One address, or one network of IPv6, has at most ``MOST_OF_AN_ADDRESS``: beyond that it displaces its own only.
* If all places are taken, the address with the most pending clients loses one, so few make no room for many.
* Of an address the oldest client without a request goes first.
"""

from __future__ import annotations

import ipaddress
from collections import Counter
from typing import Generic, TypeVar

MOST_OF_AN_ADDRESS = 64  # chosen: a page opens six connections at a time; a team behind one address ten pages
MOST_PENDING = 128  # chosen: far below the 1024 descriptors a process usually has
IPV6_NETWORK_BITS = 64  # a provider assigns so large a network to one household or host

PendingT = TypeVar("PendingT")


class PendingClients(Generic[PendingT]):
    """The clients without a token, in the order of their connections."""

    def __init__(self) -> None:
        self._places: dict[PendingT, str] = {}
        self._silent: dict[PendingT, None] = {}

    def __len__(self) -> int:
        return len(self._places)

    def came(self, who: PendingT, address: str) -> PendingT | None:
        """Add a client; return the client it displaces, which is removed; None: there is room.

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
        """Note that a client has sent a valid request."""
        self._silent.pop(who, None)

    def gone(self, who: PendingT) -> None:
        """Remove a client: it has left, or was authenticated."""
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
