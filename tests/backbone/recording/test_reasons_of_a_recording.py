"""The reasons for a state in a recording are those of the asked instant."""

from __future__ import annotations

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.reasons import reasons_at

DRIVES = "scout1 is ready on base: drives"
KILLED_S, BACK_S = 3.0, 5.0


@pytest.fixture
def recording() -> Recording:
    """Return a recording without a schedule, of a robot that is killed and comes back."""

    def state(pid: int, doing: str) -> ComponentState:
        return ComponentState(SCOUT, "scout", "base", pid, LifeState.READY, 0.5, doing)

    said = [
        Said(1.0, SCOUT, Conversation.ALIVE, Presence(True), ""),
        Said(2.0, SCOUT, Conversation.STATUS, state(7, "drives")),
        Said(KILLED_S, SCOUT, Conversation.ALIVE, Presence(False), ""),
        Said(BACK_S, SCOUT, Conversation.ALIVE, Presence(True), ""),
        Said(BACK_S, SCOUT, Conversation.STATUS, state(8, "stands")),
        Said(6.0, "resource_pool/scout2", Conversation.ALIVE, Presence(True), ""),
    ]
    return Recording(recorded(said))


@pytest.mark.parametrize(
    ("at_s", "expected"),
    [
        (2.0, DRIVES),
        (2.999, DRIVES),
        (KILLED_S, "scout1 left the bus at 3.000 s; before, it was ready on base: drives"),
        (4.9, "scout1 left the bus at 3.000 s; before, it was ready on base: drives"),
        (BACK_S, "scout1 is ready on base: stands"),
        (6.0, "scout1 is ready on base: stands"),
    ],
)
def test_a_component_that_was_killed_is_not_ready(recording: Recording, at_s: float, expected: str):
    assert reasons_at(recording, "scout1", at_s).lines(at_s) == [expected]
