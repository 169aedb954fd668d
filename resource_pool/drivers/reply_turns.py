"""Reply turns: which packets of a radio ask their robot for a reply, and which replies are lost.

Rules of this file:

* A robot is asked at most once in ``every_s``.
* A reply that has not arrived when its robot is asked again is lost; the loss is reported once.
* A reply counts for the packet that asked last, because a robot answers with its present state.

Pure; times are mission seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

INSTANT_S = 1e-9  # chosen: far above the rounding of mission times, far below a packet


@dataclass(frozen=True, slots=True)
class ReplyTurn:
    """The role of one packet in asking for replies.

    Attributes:
        asks: True: it asks its robot for a reply.
        is_lost: True: the reply to the packet that asked before is lost.
    """

    asks: bool = False
    is_lost: bool = False


class ReplyTurns:
    """The turns of one radio's robots."""

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._asked_s: dict[int, float] = {}
        self._open: set[int] = set()

    def take(self, network_id: int, now_s: float) -> ReplyTurn:
        """Return the turn of a packet that is sent to this robot now; times must not decrease."""
        asked_s = self._asked_s.get(network_id)
        if asked_s is not None and now_s < asked_s + self._every_s - INSTANT_S:
            return ReplyTurn()
        is_lost = network_id in self._open
        self._asked_s[network_id] = now_s
        self._open.add(network_id)
        return ReplyTurn(asks=True, is_lost=is_lost)

    def heard(self, network_id: int) -> None:
        """Record a reply of this robot."""
        self._open.discard(network_id)
