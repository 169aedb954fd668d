"""Markers are what a person wants to look at, each with its reason, and no more than a line can show."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from small_recordings import SCOUT, Said, recorded

from backbone.addresses import RC_MANAGER
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.rc_manager.messages import TraceLine
from backbone.recording.markers import PARTS, Marker, MarkerKind, markers_in, spread
from backbone.recording.reader import Recording

markers = st.lists(
    st.builds(Marker, st.floats(0.0, 10.0), st.sampled_from(list(MarkerKind)), st.just("a"), st.text(max_size=2)),
    max_size=60,
).map(lambda found: sorted(found, key=lambda marker: marker.at_s))


@given(found=markers)
def test_of_each_kind_and_part_of_the_time_the_first_is_kept(found: list[Marker]):
    kept = spread(found, 0.0, 10.0)
    assert [marker.at_s for marker in kept] == sorted(marker.at_s for marker in kept)
    for marker in found:
        same = [one for one in kept if one.kind == marker.kind and abs(one.at_s - marker.at_s) <= 10.0 / PARTS]
        assert same, "something of its kind is marked where it was"
    assert {*kept} <= {*found}
    assert spread(kept, 0.0, 10.0) == kept


def decided(at_s: float, cause: str, **line: object) -> Said:
    return Said(at_s, RC_MANAGER, Conversation.EVENTS, TraceLine({"t": at_s, **line}, cause), RC_MANAGER)


def told(at_s: float, what: str, level: LogLevel) -> Said:
    return Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, what, "scout1", "", level))


def test_grants_losses_alarms_and_people_are_marked_with_their_reasons():
    anna = OperatorActed("anna", OperatorAction.STOP_ROBOT, "scout1", "child in the room", 4.0)
    said = [
        decided(1.0, "it is next", ev="connect", arc="watch"),
        decided(1.3, "its RCs have settled", ev="grant", arc="watch"),
        told(2.0, "drives", LogLevel.INFO),
        told(3.0, "fell over", LogLevel.ALARM),
        Said(4.0, "ui_console/anna", Conversation.OPERATORS, anna, "ui_console/anna"),
        decided(5.0, "it is the turn of another", ev="revoke", arc="watch"),
    ]
    found = [(one.at_s, one.kind, one.name, one.line) for one in markers_in(Recording(recorded(said)))]
    assert found == [
        (1.3, "grant", "watch", "watch gets its resources: it is next"),
        (3.0, "alarm", "scout1", "scout1: fell over"),
        (4.0, "operator", "scout1", "scout1: anna stops it: child in the room"),
        (5.0, "revoked", "watch", "watch loses its resources: it is the turn of another"),
    ]
