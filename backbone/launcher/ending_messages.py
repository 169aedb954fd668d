"""Messages of the launcher: the order to end the mission, how its last branch went, and what a signal ended."""

from __future__ import annotations

from typing import Annotated

from backbone.creator.messages import ProcessEnded
from backbone.ranges import MANY, Duration, Text
from backbone.wire import Message


class EndMission(Message, frozen=True):
    """Run the last branch, if the mission has one, then end the mission; a repeated order ends the branch at once.

    Attributes:
        at_once: True: the mission ends without the last branch.
    """

    at_once: bool = False


class MissionEnding(Message, frozen=True):
    """Answer to ``EndMission``: the mission is ending.

    Attributes:
        told: State of the last branch, or what the end waits for, one line; empty: neither.
        within_s: Longest run of the branch, mission seconds; 0: it does not run.
        has_components: False: no component runs, as in a replay; no further question is answered.
    """

    told: Text = ""
    within_s: Duration = 0.0
    has_components: bool = True


class AwaitLastBranch(Message, frozen=True):
    """Ask how the last branch ended. The launcher answers as soon as the branch is over."""


class LastBranchOver(Message, frozen=True):
    """Answer to ``AwaitLastBranch``.

    Attributes:
        told: How the branch ended, one line; empty: the mission has none.
    """

    told: Text = ""


class AwaitMissionEnd(Message, frozen=True):
    """Ask which components a signal ended. The launcher answers when all but the first core services have ended."""


class MissionEnded(Message, frozen=True):
    """Answer to ``AwaitMissionEnd``: all but the nameserver and the component database have ended.

    Attributes:
        signaled: Components that a signal ended, because they were starting or did not answer.
    """

    signaled: Annotated[list[ProcessEnded], MANY]


EndingQuestion = EndMission | AwaitLastBranch | AwaitMissionEnd
