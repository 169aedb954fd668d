"""Names in the picture of a mission, for shells that complete them. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from backbone.component.messages import LifeState
from backbone.component_database.messages import TypeCount
from backbone.creator.messages import TYPE as CREATOR
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission_log.people import is_console
from backbone.naming import Subsystem, component_of
from backbone.picture.mission import MissionPicture
from backbone.run_names import MissionNames

_LEAVING = (LifeState.DRAINING, LifeState.STOPPED)


def names_in(picture: MissionPicture, types: Iterable[TypeCount] = ()) -> MissionNames:
    """Return the names in a picture and of these types, without components that leave or left.

    The news that a component has left may come before the last news of the component itself, which would stay. A
    person's name is left out if it is more than one word for a shell.
    """
    components = {at: one for at, one in picture.components.items() if one.state not in _LEAVING}
    schedule = picture.schedule
    rcs = schedule.rcs if schedule is not None else []
    requests = schedule.requests if schedule is not None else []
    found = {component_of(at) for at in components}
    found |= {component.host for component in components.values() if component.type == CREATOR}
    found |= {component.user for component in components.values() if is_word(component.user)}
    found |= {rc.rc for rc in rcs} | {request.arc for request in requests}
    return MissionNames(
        sorted(found - {""}),
        sorted(rc.rc for rc in rcs),
        sorted(rc.rc for rc in rcs if rc.is_robot),
        sorted(component_of(at) for at, one in components.items() if is_behavior(at, one.type)),
        sorted({one.user for at, one in components.items() if is_console(at) and is_word(one.user)}),
        sorted(one.component_type.name for one in types),
    )


def is_behavior(at: str, kind: str) -> bool:
    """Return whether the component is a behavior; an execution unit of the same subsystem is not a behavior."""
    return at.startswith(f"{Subsystem.MISSION_CONTROL}/") and kind != EXECUTION_UNIT


def is_word(text: str) -> bool:
    """Return whether the text is one word for a shell."""
    return bool(text) and text.isprintable() and not any(each in text for each in " \t'\"\\$`&|;<>()*?[]#~=%!{}:")
