"""Recordings of several recorders of one mission become one: each message once, in order, with all that they hold."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_recordings import CLASSES, MISSION

from backbone.component.messages import AskTime, ComponentState, LifeState, LogLevel, MissionTime, StoryEvent
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.recording.joining import Joined, OtherMission, join
from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.presence import Presence
from backbone.recording.reader import NoRecording, NotOfMessages, Recorded, Recording
from backbone.recording.writer import NS, RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, Message, write

BEGUN = "2026-05-04T10:00:00.000+00:00"
ABOUT = {"mission": MISSION, "begun": BEGUN, "recorded_on": "a"}
RC_MANAGER, SCOUT = "backbone/rc_manager", "resource_pool/scout1"
SENDERS = (RC_MANAGER, SCOUT, "resource_pool/scout2")
XML = "<mission/>"
Said = tuple[str, Conversation, Envelope[Message]]


def said(
    source: str,
    sequence: int,
    at_s: float,
    body: Message | None = None,
    conversation: Conversation = Conversation.LOG,
    cause: str = "",
) -> Said:
    body = body or StoryEvent(at_s, source, f"event {sequence}", "scout1", "", LogLevel.INFO)
    return source, conversation, Envelope(WIRE_VERSION, source, sequence, at_s, cause, body)


def file_of(messages: Iterable[Said], about: dict[str, str] | None = None, late_s: float = 0.0) -> io.BytesIO:
    """Return the file of a recorder that heard these messages, each so late."""
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, ABOUT if about is None else about, mission_xml=XML)
    for address, conversation, envelope in messages:
        writer.write(key_of(MISSION, address, conversation), write(envelope), envelope.stamp_s + late_s)
    writer.finish()
    return file


def joined(*files: io.BytesIO) -> tuple[Joined, Recording]:
    made = io.BytesIO()
    done = join([*map(Recording, files)], made)
    return done, Recording(made)


def names(messages: Iterable[Recorded]) -> list[tuple[str, str, float]]:
    return [(one.key, one.id, one.stamp_s) for one in messages]


sent = st.lists(st.tuples(st.sampled_from(SENDERS), st.integers(1, 10**9)), max_size=30).map(
    lambda drawn: [
        said(source, sum(other == source for other, _ns in drawn[: n + 1]), (n + 1) + ns / NS / 2)
        for n, (source, ns) in enumerate(drawn)
    ]
)


@given(all_sent=sent, data=st.data())
def test_each_message_that_any_recorder_heard_stands_once_in_the_order_of_sending(
    all_sent: list[Said], data: st.DataObject
):
    heard = [[one for one in all_sent if data.draw(st.booleans())] for _recorder in range(3)]
    files = [file_of(data.draw(st.permutations(each)), late_s=late / 10) for late, each in enumerate(heard)]
    done, recording = joined(*files)
    expected = [one for one in all_sent if any(one in each for each in heard)]
    found = [*recording.messages()]
    assert [(one.source, one.sequence) for one in found] == [(e.source, e.sequence) for _a, _c, e in expected]
    assert done.messages == len(expected) == recording.contents().messages
    assert done.left_out == sum(map(len, heard)) - len(expected)


@given(all_sent=sent)
def test_a_recording_joined_with_nothing_or_with_itself_stays_as_it_is(all_sent: list[Said]):
    alone = file_of(all_sent)
    original = [*Recording(alone).messages()]
    for files in ((alone,), (alone, io.BytesIO(alone.getvalue()))):
        done, recording = joined(*files)
        assert [*recording.messages()] == original
        assert recording.mission_xml() == XML
        assert recording.contents().counts == Recording(alone).contents().counts
        assert done.left_out == len(original) * (len(files) - 1)


def test_schemas_and_facts_are_kept_and_facts_that_differ_have_all_values() -> None:
    about = ABOUT | {"recorded_on": "b", "begun": "2026-05-04T10:00:00.400+00:00", "host": "far"}
    _done, recording = joined(file_of([said(SCOUT, 1, 1.0)]), file_of([said(RC_MANAGER, 1, 0.5, AskTime())], about))
    facts = recording.contents().about
    assert facts == {"mission": MISSION, "begun": BEGUN, "recorded_on": "a, b", "host": "far"}
    assert [(schema.name, channel.metadata["source"]) for schema, channel, _m, _r in recording.records() if schema] == [
        ("AskTime/1", RC_MANAGER),
        ("StoryEvent/1", SCOUT),
    ]


def test_a_sender_that_began_anew_keeps_the_messages_of_both_lives() -> None:
    lives = [said(SCOUT, 1, 1.0), said(SCOUT, 2, 2.0), said(SCOUT, 1, 3.0), said(SCOUT, 2, 4.0)]
    done, recording = joined(file_of(lives[:3]), file_of(lives[1:]))
    assert [(one.sequence, one.at_s) for one in recording.messages()] == [(1, 1.0), (2, 2.0), (1, 3.0), (2, 4.0)]
    assert done.left_out == 2


def test_of_what_recorders_saw_of_presence_only_changes_stay() -> None:
    def seen(at_s: float, alive: bool) -> Said:
        return SCOUT, Conversation.ALIVE, Envelope(WIRE_VERSION, "", 0, at_s, "", Presence(alive))

    first = file_of([seen(1.0, True), seen(5.0, False)])
    second = file_of([seen(1.1, True), seen(5.1, False), seen(6.0, True)])
    _done, recording = joined(first, second)
    assert [(one.at_s, one.body["alive"]) for one in recording.messages()] == [(1.0, True), (5.0, False), (6.0, True)]


@pytest.mark.parametrize(
    ("about", "other"),
    [
        (ABOUT, ABOUT | {"mission": "day"}),
        (ABOUT, ABOUT | {"begun": "2026-05-04T10:00:05.000+00:00"}),
        (ABOUT, ABOUT | {"begun": "2026-05-03T10:00:00.000+02:00"}),
        (ABOUT, ABOUT | {"begun": "2026-05-04T10:00:05.000+00:00", "start": "7.5"}),
        (ABOUT | {"start": "7.5"}, ABOUT | {"start": "8.25"}),
    ],
)
def test_recordings_of_other_missions_or_starts_are_refused(about: dict[str, str], other: dict[str, str]) -> None:
    with pytest.raises(OtherMission):
        joined(file_of([], about), file_of([], other))


@pytest.mark.parametrize("begun", ["2026-05-04T11:00:00.000+00:00", "1970-01-01T00:00:40.000+00:00"])
def test_a_clock_that_was_set_during_the_mission_does_not_make_two_missions_of_it(begun: str) -> None:
    about = [ABOUT | {"start": "7.5", "begun": one} for one in (BEGUN, begun)]
    done, recording = joined(file_of([said(SCOUT, 1, 1.0)], about[0]), file_of([said(SCOUT, 2, 2.0)], about[1]))
    assert done.messages == 2
    assert recording.contents().about == about[0] | {"begun": min(BEGUN, begun)}


def test_a_damaged_recording_is_refused() -> None:
    whole = file_of([said(SCOUT, n, float(n)) for n in range(1, 50)]).getvalue()
    at = whole.index(b"scout-backbone") + 400
    damaged = io.BytesIO(whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
    damaged.name = "1.mcap"
    with pytest.raises(NoRecording, match=r"^1\.mcap is damaged: ") as refused:
        joined(file_of([]), damaged)
    assert "record recover" in refused.value.remedy


@pytest.mark.parametrize("begun", ["yesterday", "2026-05-04T11:00:00", ""])
def test_a_begin_that_is_no_time_of_day_is_refused(begun: str) -> None:
    with pytest.raises(NotOfMessages, match=repr(begun)):
        joined(file_of([]), file_of([], ABOUT | {"begun": begun}))


def two_hosts(far_s: float, count: int = 20) -> tuple[list[Said], list[Said]]:
    """Return what was sent on base and on a host whose clock is so far ahead: each asks the other in turn."""
    states = [
        said(one, 1, at_s, ComponentState(one, "t", host, 1, LifeState.READY, at_s), Conversation.STATUS)
        for one, host, at_s in (("backbone/nameserver", "base", 50.0), (RC_MANAGER, "base", 50.1))
    ]
    base, far = (
        states,
        [
            said(
                SCOUT, 1, 50.2 + far_s, ComponentState(SCOUT, "t", "far", 2, LifeState.READY, 50.2), Conversation.STATUS
            )
        ],
    )
    for number in range(2, 2 + count, 2):
        at_s = 51.0 + number
        base.append(said(RC_MANAGER, number, at_s))
        far.append(said(SCOUT, number, at_s + 0.001 + far_s, cause=f"{RC_MANAGER}#{number}"))
        far.append(said(SCOUT, number + 1, at_s + 0.5 + far_s))
        base.append(said(RC_MANAGER, number + 1, at_s + 0.501, MissionTime(1, 1), cause=f"{SCOUT}#{number + 1}"))
    return base, far


def before_their_causes(messages: Iterable[Recorded]) -> list[str]:
    at_s, wrong = dict[str, float](), list[str]()
    for one in messages:
        at_s[one.id] = one.at_s
        wrong += [one.id] if one.cause and one.cause not in at_s else []
    return wrong


@given(far_s=st.floats(-20.0, 20.0).filter(lambda s: abs(s) > 0.01))
def test_messages_of_a_host_with_a_wrong_clock_are_put_in_the_order_of_causes(far_s: float):
    base, far = two_hosts(far_s)
    everywhere = file_of([*base, *far])
    assert before_their_causes(Recording(everywhere).messages())
    done, recording = joined(file_of(base), file_of(far), everywhere)
    found = [*recording.messages()]
    assert before_their_causes(found) == []
    assert done.messages == len(base) + len(far)
    assert missing_numbers(found) == {}
    assert done.clocks.wrong.keys() == {"far"}
    assert done.clocks.offsets["far"].taken_s == pytest.approx(far_s, abs=0.002)
    assert json.loads(recording.contents().about["clock_offsets_s"]) == {"far": done.clocks.offsets["far"].taken_s}
    for one in found:
        assert one.stamp_s - one.at_s == pytest.approx(far_s if one.source == SCOUT else 0.0, abs=0.002)
    again = io.BytesIO()
    assert join([recording], again).clocks.wrong == {}, "what is corrected is not corrected again"
    assert [*Recording(again).messages()] == found


@pytest.mark.parametrize("fields", [[3], [], [{"alive": True}]])
def test_a_foreign_message_named_as_a_presence_is_a_message(fields: list[object]) -> None:
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, ABOUT)
    foreign = msgspec.msgpack.encode([WIRE_VERSION, SCOUT, 1, 1.0, "", ["Presence/1", *fields]])
    writer.write(key_of(MISSION, SCOUT, Conversation.EVENTS), foreign, 1.0)
    writer.finish()
    done, recording = joined(file, file)
    assert (done.messages, done.left_out) == (1, 1)
    assert [one.body for one in recording.messages()] == [["Presence/1", *fields]]
