"""Names for completion: only components that are there."""

from __future__ import annotations

import pytest

from backbone.component.messages import ComponentState, LifeState
from backbone.picture.mission import MissionPicture
from backbone.picture.names import names_in


@pytest.mark.parametrize(
    ("state", "is_named"),
    [
        (LifeState.CONNECTING, True),
        (LifeState.READY, True),
        (LifeState.FAILED, True),
        (LifeState.DRAINING, False),
        (LifeState.STOPPED, False),
    ],
)
def test_a_component_that_leaves_is_not_completed(state: LifeState, is_named: bool) -> None:
    """Its last news may come after the news that it has left, and then stay in the picture until the next list."""
    picture = MissionPicture("local")
    component = ComponentState("mission_control/watch1", "watch", "base", 7, state, 2.0)
    picture.components[component.address] = component
    names = names_in(picture)
    assert ("watch1" in names.all, "watch1" in names.behaviors) == (is_named, is_named)
