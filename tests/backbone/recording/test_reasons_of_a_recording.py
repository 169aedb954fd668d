"""The reasons for a state in a recording are those of the asked instant."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.rc_manager.messages import Decided, ScheduleSnapshot
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.reasons import reasons_at
from backbone.scheduling.events import Woken
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.snapshot import written

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


HUB_LEFT = "the hub left the bus at 4.001 s, and all components with it; before, it was ready on base: drives"
OWN_LEFT = "scout1 left the bus at 4.000 s; before, it was ready on base: drives"


def state() -> Said:
    doing = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "drives")
    return Said(2.0, SCOUT, Conversation.STATUS, doing)


def token(at_s: float, address: str, *, alive: bool) -> Said:
    return Said(at_s, address, Conversation.ALIVE, Presence(alive), "")


@pytest.mark.parametrize(
    ("hub_back_s", "at_s", "expected"),
    [
        (4.3, 3.9, DRIVES),
        (4.3, 4.0, HUB_LEFT),
        (4.3, 4.2, HUB_LEFT),
        (4.3, 4.301, HUB_LEFT),
        (4.3, 4.305, DRIVES),
        (9.0, 8.0, HUB_LEFT),
    ],
)
def test_amid_a_restart_of_the_hub_no_component_has_left(hub_back_s: float, at_s: float, expected: str):
    """The tokens of all fall and rise with the hub, whose own is neither the first nor the last."""
    said = [
        token(1.0, NAMESERVER, alive=True),
        token(1.5, SCOUT, alive=True),
        state(),
        token(4.0, SCOUT, alive=False),
        token(4.001, NAMESERVER, alive=False),
        token(hub_back_s, NAMESERVER, alive=True),
        token(hub_back_s + 0.005, SCOUT, alive=True),
    ]
    assert reasons_at(Recording(recorded(said)), "scout1", at_s).lines(at_s) == [expected]


@pytest.mark.parametrize(("hub_s", "at_s"), [((1.0,), 5.0), ((1.0, 2.0, 2.3), 5.0), ((3.9,), 4.1), ((1.0, 8.0), 7.0)])
def test_a_component_that_falls_while_the_hub_stands_has_left(hub_s: tuple[float, ...], at_s: float):
    hub = [token(one_s, NAMESERVER, alive=number % 2 == 0) for number, one_s in enumerate(hub_s)]
    said = [*hub, token(1.5, SCOUT, alive=True), state(), token(4.0, SCOUT, alive=False)]
    assert reasons_at(Recording(recorded(said)), "scout1", at_s).lines(at_s) == [OWN_LEFT]


def test_a_component_that_does_not_return_with_the_hub_has_left():
    hub = [token(at_s, NAMESERVER, alive=alive) for at_s, alive in ((1.0, True), (4.001, False), (4.3, True))]
    said = [*hub, state(), token(4.0, SCOUT, alive=False)]
    assert reasons_at(Recording(recorded(said)), "scout1", 9.0).lines(9.0) == [OWN_LEFT]


class CountedRecording(Recording):
    """A recording that counts the messages that are read.

    Attributes:
        read: Their number.
    """

    read = 0

    def records(self, *given: Any, **named: Any) -> Iterator[Any]:
        for one in super().records(*given, **named):
            self.read += 1
            yield one


def test_late_reasons_need_only_the_messages_since_the_last_snapshot():
    empty = written(ScheduleManager(SchedulingRules(), tolerance_s=0.01, mission="night", mission_priority=10))
    said = [state()]
    for number in range(1, 1001):
        if number % 10 == 0:
            snapshot = ScheduleSnapshot(number, 1.0 + number, empty)
            said.append(Said(1.0 + number, RC_MANAGER, Conversation.ASK, snapshot, RC_MANAGER))
        else:
            decided = Decided(number, 1.0 + number, Woken())
            said.append(Said(1.0 + number, RC_MANAGER, Conversation.DECISIONS, decided, RC_MANAGER))
            said.append(Said(1.0 + number, "resource_pool/scout2", Conversation.ALIVE, Presence(True), ""))
            said.append(state()._replace(at_s=1.0 + number))
    recording = CountedRecording(recorded(said))
    assert reasons_at(recording, "scout1", 996.0).lines(996.0) == [DRIVES]
    assert recording.read < 10
