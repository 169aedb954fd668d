"""What a person injects at a key of a service changes no reconstruction of the mission."""

from __future__ import annotations

from small_recordings import CLASSES, SCOUT, Said, recorded

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.nameserver.messages import Components, ListComponents
from backbone.rc_manager.messages import AskSchedule, Decided, ScheduleSnapshot
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.reasons import reasons_at
from backbone.recording.restoring import mission_at
from backbone.scheduling.events import RcKnown, Wanted
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.snapshot import written
from backbone.scheduling.views import Schedule

PERSON = "ui_console/injector"
STATE = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "drives")


def test_only_the_rc_manager_decides() -> None:
    snapshot = ScheduleSnapshot(
        0, 1.0, written(ScheduleManager(SchedulingRules(), tolerance_s=0.01, mission="night", mission_priority=10))
    )
    known = RcKnown("scout1", "scout", False, 1.0, 0.1, 0.1, True, 0)
    said = [
        Said(1.0, RC_MANAGER, Conversation.DECISIONS, snapshot, RC_MANAGER),
        Said(2.0, RC_MANAGER, Conversation.DECISIONS, Decided(1, 2.0, known), RC_MANAGER),
        Said(3.0, RC_MANAGER, Conversation.DECISIONS, Decided(7, 3.0, Wanted("nobody")), PERSON),
        Said(4.0, RC_MANAGER, Conversation.DECISIONS, snapshot, PERSON),
    ]
    mission = mission_at(Recording(recorded(said)), CLASSES, 5.0)
    schedule = mission.answer(RC_MANAGER, AskSchedule())
    assert isinstance(schedule, Schedule)
    assert [rc.rc for rc in schedule.rcs] == ["scout1"]


def test_only_a_token_shows_presence() -> None:
    said = [
        Said(1.0, SCOUT, Conversation.ALIVE, Presence(True), ""),
        Said(2.0, SCOUT, Conversation.STATUS, STATE),
        Said(3.0, SCOUT, Conversation.STATUS, Presence(False), PERSON),
    ]
    recording = Recording(recorded(said))
    assert reasons_at(recording, "scout1", 4.0).lines(4.0) == ["scout1 is ready on base: drives"]
    found = mission_at(recording, CLASSES, 4.0).answer(NAMESERVER, ListComponents())
    assert isinstance(found, Components)
    assert [one.address for one in found.components] == [SCOUT]
