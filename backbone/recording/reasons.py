"""The reasons for a state at any instant of a recording: the answers that the live mission gave."""

from __future__ import annotations

from backbone.component.messages import Absence, ComponentState
from backbone.keys import Conversation
from backbone.nameserver.messages import UnknownName
from backbone.naming import component_of, did_you_mean
from backbone.picture.health import MissionHealth
from backbone.picture.reasons import AskedName, Reasons
from backbone.printable import printable_all
from backbone.recording.decisions import NotRecorded, schedule_at
from backbone.recording.reader import Recording
from backbone.recording.revival import revived
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.requests import UnknownRequest
from backbone.scheduling.views import Why
from backbone.wire import schema_of

_SAID = tuple(f"*/{said}" for said in (Conversation.STATUS, Conversation.HEALTH, Conversation.ASK))


def reasons_at(recording: Recording, text: str, at_s: float) -> Reasons:
    """Return the reasons for the state of an ARC, owner, resource or component at a mission time.

    Raises:
        UnknownName: The recording contains nothing about this name before that time.
        NotRecorded: Only the schedule has this name, and the recording has no earlier state of the schedule.
        NoSnapshot, OtherForm: The recording is of another release.
    """
    name = AskedName.of(text).name
    states, absent = _last_said(recording, at_s)
    component = states.get(name)
    absence = next((one for one in absent if one.name == name), None)
    try:
        why = _why(recording, name, at_s)
    except NotRecorded:
        if component is None and absence is None:
            raise
        why = None
    if why is None and component is None and absence is None:
        hint = did_you_mean(name, states)
        raise UnknownName(f"the recording has nothing about {name!r} before {at_s:.3f} s{hint}", name=name)
    return printable_all(Reasons(name, why, None, component, absence))


def _why(recording: Recording, name: str, at_s: float) -> Why | None:
    answers = Answers(schedule_at(recording, at_s))
    try:
        return answers.why(name, at_s)
    except UnknownRequest:
        return None


def _last_said(recording: Recording, at_s: float) -> tuple[dict[str, ComponentState], list[Absence]]:
    """Return the last published state of each component by name, and the last published absences."""
    states: dict[str, ComponentState] = {}
    absent: list[Absence] = []
    for message in recording.messages(_SAID, 0.0, at_s):
        if message.schema == schema_of(ComponentState):
            state = revived(ComponentState, message.body)
            states[component_of(state.address)] = state
        elif message.schema == schema_of(MissionHealth):
            absent = revived(MissionHealth, message.body).absent
    return states, absent
