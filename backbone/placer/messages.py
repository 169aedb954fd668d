"""What can be said to the placer: the one who starts and stops everything that is no core service."""

from __future__ import annotations

from typing import Any

from backbone.creator.messages import EndedBy
from backbone.errors import Refusal
from backbone.wire import Message

ADDRESS = "backbone/placer"


class Start(Message, frozen=True):
    """Start a component and answer when it is ready.

    Attributes:
        type: Component type.
        name: Unique in the mission; empty: the placer numbers it, ``<type>-<n>``.
        parameters: Values for its ``Parameters``.
        host: Must run there; empty: wherever tags and load say.
        tags: Tags the host must have, besides the type's own.
        process: Name of the process it shares with others, which are on the same host then; empty: its own.
    """

    type: str
    name: str = ""
    parameters: dict[str, Any] = {}
    host: str = ""
    tags: list[str] = []
    process: str = ""


class Started(Message, frozen=True):
    """Answer to ``Start``: it is ready, here.

    Attributes:
        address: Where to ask it.
        host: Where it runs.
        pid: Its process.
        reasons: One line a host: why it was chosen or not.
    """

    address: str
    host: str
    pid: int
    reasons: list[str]


class StopComponent(Message, frozen=True):
    """End a component and forget that it was wanted."""

    name: str
    reason: str = ""


class Ended(Message, frozen=True):
    """Answer to ``StopComponent``: it is gone."""

    name: str
    by: EndedBy


class AskPlacement(Message, frozen=True):
    """Why is this component where it is?"""

    name: str


class Placement(Message, frozen=True):
    """Answer to ``AskPlacement``, and one entry of ``Placements``.

    Attributes:
        name: The component.
        type: Its type.
        host: Where it was placed.
        requester: Who wanted it.
        since_s: Mission time of the decision.
        reasons: One line a host: why it was chosen or not.
    """

    name: str
    type: str
    host: str
    requester: str
    since_s: float
    reasons: list[str]


class ListPlacements(Message, frozen=True):
    """What was placed where?"""


class Placements(Message, frozen=True):
    """Answer to ``ListPlacements``.

    Attributes:
        placements: Sorted by name.
        stopped: Names that were ordered to stop and not started since, with the reason: their owners must not start
            them again.
    """

    placements: list[Placement]
    stopped: dict[str, str] = {}


class NoHost(Refusal):
    """No host can take the component; the detail names every host and why not."""

    code = "placer.no_host"
    remedy = "Add a host with these tags, or change the component's tags or host."


class CreatorSilent(Refusal):
    """The creator asked did not answer; fact ``outcome``: ``unknown``, or ``not_running`` if that much is sure."""

    code = "placer.creator_silent"
    remedy = "See with 'scout-backbone status' whether it runs; start or stop it again."


class StoppedMeanwhile(Refusal):
    """The component was to be stopped before it had started, and was."""

    code = "placer.stopped"
    remedy = "Start it again if it is still wanted."


class NotPlaced(Refusal):
    """The placer has no component of this name; fact ``stopped``: whether it was ordered to stop."""

    code = "placer.unknown"
    remedy = "See 'scout-backbone status' for the names that are there."


PlacerQuestion = Start | StopComponent | AskPlacement | ListPlacements
