"""The reasons for a state at any instant of a recording: the answers that the live mission gave."""

from __future__ import annotations

import math
from glob import escape
from typing import TypeVar

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.component.messages import ComponentState
from backbone.keys import Conversation, address_of
from backbone.nameserver.messages import UnknownName
from backbone.naming import component_of, did_you_mean
from backbone.picture.health import MissionHealth
from backbone.picture.reasons import AskedName, Reasons
from backbone.printable import printable_all
from backbone.recording.decisions import NotRecorded, schedule_at
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.revival import Reviver
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.requests import UnknownRequest
from backbone.scheduling.views import Why
from backbone.spoken import counted
from backbone.wire import Message

TOGETHER_S = 0.5  # chosen: when the hub goes, all tokens fall and rise within 10 ms (measured); mission seconds
Kind = TypeVar("Kind", bound=Message)


def reasons_at(recording: Recording, text: str, at_s: float) -> Reasons:
    """Return the reasons for the state of an ARC, owner, resource or component at a mission time.

    Raises:
        UnknownName: The recording contains nothing about this name before that time.
        NotRecorded: Only the schedule has this name, and the recording has no earlier state of the schedule.
    """
    name, reviver = AskedName.of(text).name, Reviver()
    _, component = _newest(recording, ComponentState, name, (Conversation.STATUS, Conversation.ASK), at_s, reviver)
    _, health = _newest(recording, MissionHealth, component_of(LAUNCHER), (Conversation.HEALTH,), at_s, reviver)
    left_s, token = _newest(recording, Presence, name, (Conversation.ALIVE,), at_s, reviver)
    absence = next((one for one in health.absent if one.name == name), None) if health is not None else None
    try:
        why = _why(recording, name, at_s, reviver)
    except NotRecorded:
        if component is None and absence is None:
            raise
        why = None
    if why is None and component is None and absence is None:
        hint = did_you_mean(name, {component_of(address_of(one.key)) for one in recording.contents().counts if one.key})
        unknown = f"the recording has nothing about {name!r} before {at_s:.3f} s{hint}"
        raise UnknownName(unknown, name=name, remedy="See 'scout-backbone recording keys FILE' for its components.")
    unread = reviver.unread
    remarks = [f"incomplete: {counted(unread, 'message')} of another form cannot be read"] if unread else []
    if component is None or token is None or token.alive:
        return printable_all(Reasons(name, why, None, component, absence, remarks=remarks))
    doing = f": {component.feedback}" if component.feedback else ""
    before = f"before, it was {component.state} on {component.host}{doing}"
    hub_left_s = _hub_left_s(recording, left_s, at_s, reviver)
    left = f"{name} left the bus at {left_s:.3f} s; {before}"
    if hub_left_s is not None:  # a restarted hub is back in a moment, and no component has ended
        left = f"the hub left the bus at {hub_left_s:.3f} s, and all components with it; {before}"
    return printable_all(Reasons(name, why, None, None, absence, remarks=[left, *remarks]))


def _why(recording: Recording, name: str, at_s: float, reviver: Reviver) -> Why | None:
    answers = Answers(schedule_at(recording, at_s, reviver))
    try:
        return answers.why(name, at_s)
    except UnknownRequest:
        return None


def _hub_left_s(recording: Recording, left_s: float, at_s: float, reviver: Reviver) -> float | None:
    """Return when the hub left, if a token that had fallen fell with the hub's, and the hub's was not up again."""
    fell_s, rose_s = math.inf, -math.inf
    for message in recording.messages((f"{NAMESERVER}/{Conversation.ALIVE}",), 0.0, at_s + TOGETHER_S):
        match reviver.revived(message, Presence):
            case Presence(alive=True):
                rose_s = message.at_s
            case Presence():
                fell_s, rose_s = message.at_s, math.inf
    return fell_s if left_s >= fell_s - TOGETHER_S and at_s <= rose_s + TOGETHER_S else None


def _newest(
    recording: Recording, kind: type[Kind], name: str, said: tuple[Conversation, ...], at_s: float, reviver: Reviver
) -> tuple[float, Kind | None]:
    """Return a component's newest message of a class in these conversations, with its time; -inf, None: there is none.

    The recording is read from ``at_s`` backwards, no further than to this message.
    """
    keys = tuple(f"*/{escape(name)}/{each}" for each in said)
    for message in recording.messages(keys, 0.0, at_s, newest_first=True):
        if (found := reviver.revived(message, kind)) is not None:
            return message.at_s, found
    return -math.inf, None
