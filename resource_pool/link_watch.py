"""Link watch: counts received and lost replies on one radio, and detects a robot that does not reply.

Rules of this file:

* ``LOST_IN_A_ROW`` lost replies in a row make one event; further losses are only counted.
* The first reply afterwards makes one event.

Pure.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

LOST_IN_A_ROW = 3  # chosen: at a packet loss of 1 %, a false alarm happens once in 17 hours


class LinkNews(Enum):
    """News of a robot's link."""

    NONE = ""
    SILENT = "does not answer"
    ANSWERS = "answers again"


@dataclass(slots=True)
class _Link:
    name: str
    replies: int = 0
    lost: int = 0
    in_a_row: int = 0


class LinkWatch:
    """The robots of one radio that are asked for replies, by network id."""

    def __init__(self) -> None:
        self._links: dict[int, _Link] = {}

    def add(self, network_id: int, name: str) -> bool:
        """Watch the robot of this network id under this name; return whether the id is new."""
        is_new = network_id not in self._links
        if is_new:
            self._links[network_id] = _Link(name)
        self._links[network_id].name = name
        return is_new

    def name_of(self, network_id: int) -> str:
        """Return the name of a watched robot."""
        return self._links[network_id].name

    def heard(self, network_id: int) -> LinkNews:
        """Count a reply of a watched robot."""
        link = self._links[network_id]
        was_silent = link.in_a_row >= LOST_IN_A_ROW
        link.replies += 1
        link.in_a_row = 0
        return LinkNews.ANSWERS if was_silent else LinkNews.NONE

    def lost(self, network_id: int) -> LinkNews:
        """Count a lost reply of a watched robot."""
        link = self._links[network_id]
        link.lost += 1
        link.in_a_row += 1
        return LinkNews.SILENT if link.in_a_row == LOST_IN_A_ROW else LinkNews.NONE

    def counts(self) -> dict[str, float]:
        """Return counts by name: replies and lost replies in total, and lost replies of each robot."""
        links = self._links.values()
        return {
            "replies": sum(link.replies for link in links),
            "replies_lost": sum(link.lost for link in links),
            **{f"replies_lost_{link.name}": link.lost for link in links},
        }
