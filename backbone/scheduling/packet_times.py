"""Packet times: the longest measured packet times of each ARC, if they are longer than declared.

Rules of this file:

* The longer of the declared and the measured time counts. A measured time never decreases; it is forgotten when the
  ARC ends.
* A time that no packet can take, an unknown ARC, or a kind of packet that the ARC did not request changes nothing.

Pure. Source: RAM 2002, assumption 3: the run time of a request may vary.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from backbone.ranges import A_DAY_S
from backbone.scheduling.requests import RcUse, Usage


class PacketTimes:
    """The measured times of all ARCs with a request."""

    def __init__(self) -> None:
        """Begin without measured times."""
        self._longest_s: dict[str, dict[tuple[str, str], float]] = {}

    def take(self, rc: str, arc: str, kind: str, packet_time_s: float) -> bool:
        """Record the duration of a packet of this kind; return whether it is the longest so far.

        A time that is not above 0, or longer than a day, changes nothing.
        """
        known = self._longest_s.get(arc, {})
        if not known.get((rc, kind), 0.0) < packet_time_s <= A_DAY_S:
            return False
        self._longest_s[arc] = {**known, (rc, kind): packet_time_s}
        return True

    def forget(self, arc: str) -> None:
        """Forget the measured times of this ARC; a later ARC of the same name is another one."""
        self._longest_s.pop(arc, None)

    def counted(self, arc: str, declared: Mapping[str, RcUse]) -> dict[str, RcUse]:
        """Return the ARC's uses with the packet times that count, never shorter than declared.

        Example:
            >>> times = PacketTimes()
            >>> times.take("radio", "patrol-drive", "drive", 0.0043)
            True
            >>> counted = times.counted("patrol-drive", {"radio": RcUse([Usage(0.1, 0.002, kind="drive")])})
            >>> counted["radio"].streams[0].packet_time_s
            0.0043
        """
        longest_s = self._longest_s.get(arc, {})
        return {rc: _counted(rc, use, longest_s) for rc, use in declared.items()}


def _counted(rc: str, use: RcUse, longest_s: Mapping[tuple[str, str], float]) -> RcUse:
    if not any(longest_s.get((rc, usage.kind), 0.0) > usage.packet_time_s for usage in use.streams):
        return use
    return RcUse([_longer(usage, longest_s.get((rc, usage.kind), 0.0)) for usage in use.streams])


def _longer(usage: Usage, packet_time_s: float) -> Usage:
    return msgspec.structs.replace(usage, packet_time_s=max(usage.packet_time_s, packet_time_s))
