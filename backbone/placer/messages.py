"""What can be said to the placer: the one who starts and stops everything that is no core service."""

from __future__ import annotations

from typing import Annotated

from backbone.creator.messages import EndedBy
from backbone.errors import Refusal
from backbone.ranges import FEW, MANY, Instant, Mention, NameOrNone, Pid, Text, Values
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

    type: Mention
    name: Mention = ""
    parameters: Values = {}
    host: Mention = ""
    tags: Annotated[list[Mention], FEW] = []
    process: NameOrNone = ""


class Started(Message, frozen=True):
    """Answer to ``Start``: it is ready, here.

    Attributes:
        address: Where to ask it.
        host: Where it runs.
        pid: Its process.
        reasons: One line a host: why it was chosen or not.
    """

    address: Mention
    host: Mention
    pid: Pid
    reasons: Annotated[list[Text], MANY]


class StopComponent(Message, frozen=True):
    """End a component and forget that it was wanted."""

    name: Mention
    reason: Text = ""


class Ended(Message, frozen=True):
    """Answer to ``StopComponent``: it is gone."""

    name: Mention
    by: EndedBy


class AskPlacement(Message, frozen=True):
    """Why is this component where it is?"""

    name: Mention


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

    name: Mention
    type: Mention
    host: Mention
    requester: Mention
    since_s: Instant
    reasons: Annotated[list[Text], MANY]


class ListPlacements(Message, frozen=True):
    """What was placed where?"""


class Placements(Message, frozen=True):
    """Answer to ``ListPlacements``.

    Attributes:
        placements: Sorted by name.
        stopped: Names that were ordered to stop and not started since, with the reason: their owners must not start
            them again.
    """

    placements: Annotated[list[Placement], MANY]
    stopped: Annotated[dict[Mention, Text], MANY] = {}


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
