"""The reasons for a state at any instant of a recording: the answers that the live mission gave."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from backbone.addresses import NAMESERVER
from backbone.component.messages import Absence, ComponentState
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

TOGETHER_S = 0.5  # chosen: when the hub goes, all tokens fall and rise within 10 ms (measured); mission seconds
_TOKEN = f"/{Conversation.ALIVE}"
_SAID = tuple(f"*/{said}" for said in (Conversation.STATUS, Conversation.HEALTH, Conversation.ASK, Conversation.ALIVE))


def reasons_at(recording: Recording, text: str, at_s: float) -> Reasons:
    """Return the reasons for the state of an ARC, owner, resource or component at a mission time.

    Raises:
        UnknownName: The recording contains nothing about this name before that time.
        NotRecorded: Only the schedule has this name, and the recording has no earlier state of the schedule.
    """
    name, reviver = AskedName.of(text).name, Reviver()
    said = _last_said(recording, at_s, reviver)
    component = said.states.get(name)
    absence = next((one for one in said.absent if one.name == name), None)
    try:
        why = _why(recording, name, at_s, reviver)
    except NotRecorded:
        if component is None and absence is None:
            raise
        why = None
    if why is None and component is None and absence is None:
        hint = did_you_mean(name, said.states)
        unknown = f"the recording has nothing about {name!r} before {at_s:.3f} s{hint}"
        raise UnknownName(unknown, name=name, remedy="See 'scout-backbone recording keys FILE' for its components.")
    unread = reviver.unread
    remarks = [f"incomplete: {counted(unread, 'message')} of another form cannot be read"] if unread else []
    if component is None or name not in said.left_s:
        return printable_all(Reasons(name, why, None, component, absence, remarks=remarks))
    doing = f": {component.feedback}" if component.feedback else ""
    before = f"before, it was {component.state} on {component.host}{doing}"
    left_s, hub_left_s = said.left_s[name], _hub_left_s(recording, said.left_s[name], at_s, reviver)
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


@dataclass(slots=True)
class _LastSaid:
    """What components last said before a time.

    Attributes:
        states: Component → its last state.
        left_s: Component whose token has fallen, and not risen again → the mission time of the fall.
        absent: The last published absences.
    """

    states: dict[str, ComponentState] = field(default_factory=dict)
    left_s: dict[str, float] = field(default_factory=dict)
    absent: list[Absence] = field(default_factory=list)


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


def _last_said(recording: Recording, at_s: float, reviver: Reviver) -> _LastSaid:
    said = _LastSaid()
    for message in recording.messages(_SAID, 0.0, at_s):
        match reviver.revived(message, ComponentState, MissionHealth, Presence):
            case ComponentState() as state:
                said.states[component_of(state.address)] = state
            case MissionHealth(absent=absent):
                said.absent = absent
            case Presence(alive=alive) if message.key.endswith(_TOKEN):
                name = component_of(address_of(message.key))
                said.left_s.pop(name, None)
                if not alive:
                    said.left_s[name] = message.at_s
    return said
