"""Laws of the catalogue."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import ComponentState, LifeState
from backbone.component_database.catalogue import Catalogue
from backbone.component_database.messages import (
    ComponentType,
    CoreService,
    Multiplicity,
    MultiplicityExceeded,
    UnknownType,
)
from backbone.naming import Subsystem

TYPES = [
    ComponentType("watcher", "x:Y", Subsystem.MISSION_CONTROL),
    ComponentType("world", "x:Y", Subsystem.RESOURCE_POOL, Multiplicity.ONE),
    ComponentType("rc_manager", "x:Y", Subsystem.BACKBONE, Multiplicity.ONE, core=True),
]


def running(kind: str, name: str, pid: int = 7) -> ComponentState:
    return ComponentState(f"backbone/{name}", kind, "a", pid, LifeState.READY, 1.0)


STATES = st.lists(
    st.builds(running, st.sampled_from([t.name for t in TYPES]), st.sampled_from(["one", "two", "three"]))
)


@given(STATES, st.sampled_from(TYPES))
def test_who_is_admitted_keeps_every_multiplicity(states: list[ComponentState], kind: ComponentType) -> None:
    there = [state for state in states if state.type == kind.name]
    try:
        admitted = Catalogue(TYPES).admit(kind.name, "new", states)
    except MultiplicityExceeded as exceeded:
        named = (exceeded.facts["name"], exceeded.facts["host"], exceeded.facts["pid"])
        assert kind.multiplicity is Multiplicity.ONE
        assert named in {(s.address.rpartition("/")[2], s.host, s.pid) for s in there}
    except CoreService:
        assert kind.core
        assert not there
    else:
        assert admitted == kind
        assert not kind.core
        assert kind.multiplicity is Multiplicity.MANY or not there


@given(STATES)
def test_counts_cover_every_type_once(states: list[ComponentState]) -> None:
    counts = Catalogue(TYPES).counts(states)
    assert [count.component_type.name for count in counts] == sorted(kind.name for kind in TYPES)
    assert sum(count.running for count in counts) == len(states)


def test_fifty_behaviors_of_one_type_may_run() -> None:
    states = [running("watcher", f"watcher{n}") for n in range(50)]
    assert Catalogue(TYPES).admit("watcher", "watcher50", states).name == "watcher"


def test_an_unknown_type_is_answered_with_the_nearest_known_one() -> None:
    with pytest.raises(UnknownType, match="did you mean 'watcher'"):
        Catalogue(TYPES).admit("wather", "w", [])
