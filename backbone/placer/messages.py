"""Messages to the placer, which starts and stops all components that are no core services."""

from __future__ import annotations

from typing import Annotated

from backbone.creator.messages import EndedBy
from backbone.errors import Refusal
from backbone.ranges import FEW, MANY, Instant, Line, Mention, NameOrNone, Pid, Quoted, Text, Values
from backbone.wire import Message


class Start(Message, frozen=True):
    """Start a component and answer when it is ready.

    Attributes:
        name: Unique in the mission; empty: the placer chooses ``<type>-<n>``.
        parameters: Values for its ``Parameters``.
        host: The only possible host; empty: the placer chooses by tags and load.
        tags: Tags that the host must have, besides the tags of the type.
        process: Name of the shared process, whose members run on one host; empty: a process of its own.
        order_id: See ``Launch``; empty: the placer chooses it.
    """

    type: Mention
    name: Mention = ""
    parameters: Values = {}
    host: Mention = ""
    tags: Annotated[list[Mention], FEW] = []
    process: NameOrNone = ""
    order_id: Mention = ""


class Started(Message, frozen=True):
    """Answer to ``Start``: the component is ready.

    Attributes:
        reasons: One line for each host: why it was chosen or not.
    """

    address: Mention
    host: Mention
    pid: Pid
    reasons: Annotated[list[Text], MANY]


class ReviseStart(Message, frozen=True):
    """Start a component with these parameters from its next start on, on whichever host; its owner asks.

    Attributes:
        parameters: All of them, unless ``others_stay``; the running component keeps its own.
        class_path: Class path from its next start on; empty: as before.
        others_stay: True: parameters that are not named stay as they are.
    """

    name: Mention
    parameters: Values
    class_path: Line = ""
    others_stay: bool = False


class StartRevised(Message, frozen=True):
    """Answer to ``ReviseStart``: each restart from now on uses the new parameters."""


class StopComponent(Message, frozen=True):
    """End a component; it is no longer wanted."""

    name: Mention
    reason: Text = ""


class Ended(Message, frozen=True):
    """Answer to ``StopComponent``: the component has ended."""

    name: Mention
    by: EndedBy


class AskPlacement(Message, frozen=True):
    """Ask for the host of a component and the reasons."""

    name: Mention


class Placement(Message, frozen=True):
    """Answer to ``AskPlacement``, and one entry of ``Placements``.

    Attributes:
        requester: Address of its owner.
        reasons: One line for each host: why it was chosen or not.
    """

    name: Mention
    type: Mention
    host: Mention
    requester: Mention
    since_s: Instant
    reasons: Annotated[list[Text], MANY]


class ListPlacements(Message, frozen=True):
    """Ask for all placements."""


class Placements(Message, frozen=True):
    """Answer to ``ListPlacements``.

    Attributes:
        placements: Sorted by name.
        stopped: Names that were ordered to stop and were not started since, with the reason. Their owners must not
            start them again.
    """

    placements: Annotated[list[Placement], MANY]
    stopped: Annotated[dict[Mention, Text], MANY] = {}


class KeepMemory(Message, frozen=True):
    """Keep what the asking component leaves for its next process, which may be on another host.

    Attributes:
        order_id: See ``Launch``; nothing is kept for an order that is over.
        content: Its memory, encoded.
    """

    order_id: Mention
    content: Quoted


class MemoryKept(Message, frozen=True):
    """Answer to ``KeepMemory``."""


class AskMemory(Message, frozen=True):
    """Ask for the memory that the last process of the asking component left under this order."""

    order_id: Mention


class Memory(Message, frozen=True):
    """Answer to ``AskMemory``.

    Attributes:
        content: The memory; empty: none.
    """

    content: Quoted = b""


# Anyone → the launcher, which has the orders of the mission file.


class AskDeclared(Message, frozen=True):
    """Ask for the order that starts a component as the mission declares it now."""

    name: Mention


class DeclaredOrder(Message, frozen=True):
    """Answer to ``AskDeclared``.

    Attributes:
        order: The order; None: the mission declares no such component.
    """

    order: Start | None = None


class NoHost(Refusal):
    """No host is possible for the component; the detail gives the reason of each host."""

    code = "placer.no_host"
    remedy = "Add a host with these tags, or change the component's tags or host."


class CreatorSilent(Refusal):
    """The creator did not answer; fact ``outcome``: ``unknown``, or ``not_running`` if that is certain."""

    code = "placer.creator_silent"
    remedy = "See with 'scout-backbone status' whether it runs; start or stop it again."


class StoppedMeanwhile(Refusal):
    """An order stopped the component before it had started."""

    code = "placer.stopped"
    remedy = "Start it again if it is still wanted."


class NotPlaced(Refusal):
    """The placer has no component of this name; fact ``stopped``: whether it was ordered to stop."""

    code = "placer.unknown"
    remedy = "See 'scout-backbone status' for the names of all components."


PlacerQuestion = Start | ReviseStart | StopComponent | AskPlacement | ListPlacements | KeepMemory | AskMemory
