"""Events of a console: of its own robot, and of the whole mission; each event also as a line of JSON.

Rules of this file: no bus, no clock, no screen. Times are mission seconds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import msgspec

from backbone.component.messages import ComponentState, MissionTime, Parameters, SetParameter, Statistics, StoryEvent
from backbone.component_database.messages import Types
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.errors import LinkError, Refusal, code_of
from backbone.mission_log.log import Log, PeopleKnown
from backbone.mission_log.operators import OperatorActed
from backbone.nameserver.messages import Components, Disappeared
from backbone.picture.health import MissionHealth
from backbone.picture.words import why_lost
from backbone.rc_manager.messages import Leases
from backbone.scheduling.views import Schedule, Why
from backbone.wire import plain
from resource_pool.arc_client import FloorPlan, Pose, Readings, StopState, Suspended
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.consent import Settled, Sought, Topic
from ui_console.model.orders import GivenOrder


@dataclass(frozen=True, slots=True)
class Event:
    """An event with its mission time."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Asked(Event):
    """A robot was requested."""

    robot: str
    kind: str
    priority: int


@dataclass(frozen=True, slots=True)
class AbilitiesKnown(Event):
    """The abilities of the requested ARC are known, or not known any more.

    Attributes:
        abilities: None: not known.
    """

    abilities: ArcAbilities | None


@dataclass(frozen=True, slots=True)
class Granted(Event):
    """The RCs are held; repeated, with ``again``, after each suspension.

    Attributes:
        rcs: Role → name of each RC held.
        epochs: RC → epoch.
        until_s: The slice lasts at least until then.
        asked_s: When it was requested.
        again: True if it was held before.
    """

    robot: str
    rcs: Mapping[str, str]
    epochs: Mapping[str, int]
    until_s: float
    asked_s: float
    again: bool

    @property
    def after_s(self) -> float:
        """Time from the request to the grant, mission seconds."""
        return self.at_s - self.asked_s


@dataclass(frozen=True, slots=True)
class HoldConfirmed(Event):
    """The ARC reported that the present grant continues; several times in a second."""


@dataclass(frozen=True, slots=True)
class CommandApplied(Event):
    """A robot applied a command; its values may be clipped.

    Attributes:
        rc: The robot.
        command: Its word.
        values: After clipping.
        took_s: Time from the operator's action to the answer, machine seconds; negative: not measured.
    """

    rc: str
    epoch: int
    command: str
    values: Mapping[str, float]
    took_s: float = -1.0


@dataclass(frozen=True, slots=True)
class CommandRefused(Event):
    """A peer refused; with ``ends_claim`` the claim itself was refused, so the console no longer waits."""

    code: str
    detail: str
    remedy: str
    ends_claim: bool = False


@dataclass(frozen=True, slots=True)
class LinkTrouble(Event):
    """A peer did not answer; whether it acted is unknown.

    Attributes:
        detail: The unanswered question, for people.
        command: The unanswered drive command of this console's operator; empty: another message.
    """

    detail: str
    command: str = ""


def failed(at_s: float, error: Refusal | LinkError) -> CommandRefused | LinkTrouble:
    """Return the event for a refusal or a missing answer."""
    if isinstance(error, Refusal):
        return CommandRefused(at_s, code_of(error), error.detail, error.remedy)
    return LinkTrouble(at_s, str(error))


@dataclass(frozen=True, slots=True)
class GivenBack(Event):
    """The robot was given back.

    Attributes:
        reason: Why.
        confirmed: False if the ARC did not confirm it.
        wanted: False if the robot was lost without a release by the operator.
    """

    reason: str
    confirmed: bool
    wanted: bool = True


@dataclass(frozen=True, slots=True)
class LetGoNeeded(Event):
    """A held control must be released before it moves anything, or may move the robot again.

    Attributes:
        is_needed: True: release it, then press again.
    """

    is_needed: bool


@dataclass(frozen=True, slots=True)
class MomentBegan(Event):
    """A stop, a lift, a grant, a loss, or a broken link: earlier presses are ignored from now on."""


@dataclass(frozen=True, slots=True)
class PictureSeen(Event):
    """A picture arrived."""

    captured_s: float
    robot: str


@dataclass(frozen=True, slots=True)
class Attention(Event):
    """The operator used the console, or turned away from it.

    Attributes:
        is_there: False: the operator is away.
    """

    is_there: bool


@dataclass(frozen=True, slots=True)
class ConsentAsked(Event):
    """This console asked other operators to release a robot, or to lift a stop.

    Attributes:
        of: Names of the consoles asked.
        until_s: The question times out then, which is a no.
        topic: To have the robot, or to lift its stop.
    """

    robot: str
    of: Sequence[str]
    until_s: float
    topic: Topic = Topic.TAKE


@dataclass(frozen=True, slots=True)
class ConsentHeard(Event):
    """An operator answered this console's question, or it timed out.

    Attributes:
        user: The person who decided.
        is_given: True: the robot is being given back, or may move.
        reason: For people.
        topic: To have the robot, or to lift its stop.
    """

    robot: str
    user: str
    is_given: bool
    reason: str
    topic: Topic = Topic.TAKE


@dataclass(frozen=True, slots=True)
class TurnedTo(Event):
    """The stick turned to a robot that carries out an order of this console; no robot is requested."""

    robot: str


@dataclass(frozen=True, slots=True)
class OrderChanged(Event):
    """An order of this console was given, or its state changed; the last event of each order has a final state."""

    given: GivenOrder


Said = (
    Schedule
    | Leases
    | StoryEvent
    | Log
    | PeopleKnown
    | OperatorActed
    | ComponentState
    | Components
    | Disappeared
    | ProcessFell
    | HostLoad
    | StopState
    | Readings
    | Types
    | MissionTime
    | Statistics
    | MissionHealth
    | Parameters
    | SetParameter
    | Pose
    | FloorPlan
    | Suspended
    | Why
)
"""Messages that components publish or answer, as received from the bus."""


@dataclass(frozen=True, slots=True)
class Heard(Event):
    """A message arrived.

    Attributes:
        source: Address of the sender, for a message that does not name its component.
    """

    body: Said
    source: str = ""


@dataclass(frozen=True, slots=True)
class LinkHeard(Event):
    """This console's link to the hub came up, went down, or was measured.

    Attributes:
        is_up: Whether messages pass.
        latency_s: Round-trip time, machine seconds; negative: not measured now.
        until_s: Time until which the link counts as up without a newer measurement.
    """

    is_up: bool
    latency_s: float = -1.0
    until_s: float = math.inf


OwnEvent = (
    Asked
    | AbilitiesKnown
    | Granted
    | HoldConfirmed
    | CommandApplied
    | CommandRefused
    | LinkTrouble
    | GivenBack
    | LetGoNeeded
    | MomentBegan
    | PictureSeen
    | Attention
    | ConsentAsked
    | ConsentHeard
    | TurnedTo
    | OrderChanged
    | Sought
    | Settled
)
TeamEvent = Heard | LinkHeard
ConsoleEvent = OwnEvent | TeamEvent

_WORDS: dict[type[object], str] = {
    AbilitiesKnown: "abilities",
    Suspended: "suspended",
    HoldConfirmed: "confirmed",
    CommandApplied: "applied",
    CommandRefused: "refused",
    LinkTrouble: "no_answer",
    GivenBack: "released",
    LetGoNeeded: "let_go",
    MomentBegan: "moment",
    PictureSeen: "picture",
    ConsentAsked: "consent_asked",
    ConsentHeard: "consent_heard",
    TurnedTo: "turned_to",
    OrderChanged: "order",
    Sought: "consent_sought",
    Settled: "consent_settled",
    LinkHeard: "link",
    StoryEvent: "story",
    PeopleKnown: "people",
    OperatorActed: "operator",
    ComponentState: "component",
    Disappeared: "gone",
    ProcessFell: "fell",
    HostLoad: "load",
    StopState: "stop",
    MissionTime: "time",
    Statistics: "radio",
    MissionHealth: "health",
    SetParameter: "set",
    FloorPlan: "floor",
}


def said(event: ConsoleEvent) -> ConsoleEvent | Said:
    """Return the message of a ``Heard``; return any other event unchanged."""
    return event.body if isinstance(event, Heard) else event


def event_word(event: ConsoleEvent) -> str:
    """Return the word of an event in JSON output: ``granted``, ``suspended``, ``resumed`` and so on."""
    if isinstance(event, Granted):
        return "resumed" if event.again else "granted"
    kind = type(said(event))
    return _WORDS.get(kind, kind.__name__.lower())


def event_json(event: ConsoleEvent) -> bytes:
    """Return the event as one line of JSON, without its end.

    Example:
        >>> event_json(LinkTrouble(2.0, "scout1 did not answer"))
        b'{"event":"no_answer","at_s":2.0,"detail":"scout1 did not answer","command":""}'
    """
    word = event_word(event)
    fields = plain(event)
    match event:
        case Heard(body=Disappeared(address=address)):
            fields = {"at_s": event.at_s, "address": address}
        case Heard(body=Suspended(reason=reason, by=by)):
            fields = {"at_s": event.at_s, **fields["body"], "why": why_lost(reason, by)}
        case Heard():
            where = {"where": event.source} if event.source else {}
            fields = {"at_s": event.at_s, "act" if word == "operator" else word: fields["body"], **where}
        case OrderChanged(given=given):
            state = {"number": given.number, "state": given.state, "why": given.why, "by": given.by}
            fields = {"at_s": event.at_s, **plain(given.order), **state, "line": given.line}
        case Granted():
            fields["after_s"] = event.after_s
    return msgspec.json.encode({"event": word, **fields})


FOR_SCRIPTS = (Schedule, StoryEvent, OperatorActed, StopState, Disappeared, ProcessFell, LinkTrouble, CommandRefused)
"""Events for a program that watches a mission; the other events occur several times a second."""


def for_scripts(event: ConsoleEvent) -> list[bytes]:
    """Return the event as one line of JSON if it is for watching programs; otherwise no line."""
    return [event_json(event)] if isinstance(said(event), FOR_SCRIPTS) else []
