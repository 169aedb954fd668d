"""Numbers of messages that are missing in a recording: each sender numbers its messages. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from backbone.recording.reader import Recorded


def missing_numbers(messages: Iterable[Recorded]) -> dict[str, int]:
    """Return sender → number of messages missing between its first and its last, only for senders that miss any.

    Each sender numbers its messages, and a restarted sender begins again. Messages that are missing between the end of
    a sender and its restart are unknown. A number is missing if its message was lost, or if its key was not recorded. A
    question from before the begin, whose answer came later, does not count.

    Args:
        messages: In the order of sending.
    """
    lives: dict[str, list[_SenderLife]] = {}
    began_s = math.inf
    for message in messages:
        began_s = min(began_s, message.heard_s)
        if message.source:
            own = lives.setdefault(message.source, [])
            if not own or own[-1].is_over(message):
                own.append(_SenderLife())
            own[-1].take(message, began_s)
    missing = {source: sum(life.gaps(began_s) for life in own) for source, own in sorted(lives.items())}
    return {source: count for source, count in missing.items() if count}


@dataclass(slots=True)
class _SenderLife:
    """The message numbers of one life of a sender; it takes the same memory however many they are.

    Attributes:
        newest: Largest number.
        lowest: Smallest number that counts.
        highest: Largest number that counts.
        count: How many count.
        at_s: Mission time of the newest message.
        together: Numbers of that time; only these come in any order.
        early: Times and numbers of messages that were sent before the recorder heard any; they do not count yet.
    """

    newest: float = -math.inf
    lowest: float = math.inf
    highest: float = -math.inf
    count: int = 0
    at_s: float = -math.inf
    together: set[int] = field(default_factory=set)
    early: list[tuple[float, int]] = field(default_factory=list)

    def is_over(self, message: Recorded) -> bool:
        """Return whether this message begins the sender's next life."""
        return message.sequence <= self.newest and message.at_s > self.at_s

    def take(self, message: Recorded, began_s: float) -> None:
        """Note the number of a message."""
        if message.at_s != self.at_s:
            self.at_s, self.together = message.at_s, set()
        if message.sequence in self.together:
            return
        self.together.add(message.sequence)
        self.newest = max(self.newest, message.sequence)
        if message.at_s < began_s:
            self.early.append((message.at_s, message.sequence))
        else:
            self._count(message.sequence)

    def gaps(self, began_s: float) -> int:
        """Return how many numbers between the lowest and the highest are missing; messages before the begin are not."""
        for at_s, number in self.early:
            if at_s >= began_s:
                self._count(number)
        return int(self.highest - self.lowest) + 1 - self.count if self.count else 0

    def _count(self, number: int) -> None:
        self.lowest, self.highest = min(self.lowest, number), max(self.highest, number)
        self.count += 1
