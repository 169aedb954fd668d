"""Messages of the launcher: the order to end the mission, and how its last branch went."""

from __future__ import annotations

from backbone.ranges import Duration, Text
from backbone.wire import Message


class EndMission(Message, frozen=True):
    """Run the last branch, if there is one, and end the mission; the same order again ends the branch at once.

    Attributes:
        at_once: True: without the last branch.
    """

    at_once: bool = False


class MissionEnding(Message, frozen=True):
    """Answer to ``EndMission``: the mission is ending.

    Attributes:
        told: What the last branch does, one line; empty: there is none.
        within_s: Time the branch has from its start, mission seconds; 0: it does not run.
    """

    told: Text = ""
    within_s: Duration = 0.0


class AwaitLastBranch(Message, frozen=True):
    """Ask how the last branch ended; answered as soon as it is over."""


class LastBranchOver(Message, frozen=True):
    """Answer to ``AwaitLastBranch``.

    Attributes:
        told: How it ended, one line; empty: there is none.
    """

    told: Text = ""
