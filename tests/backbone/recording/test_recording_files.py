"""What was written is read back whole and in order; of a broken file, all that was flushed."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import SeekingReader
from mcap.writer import Writer

from backbone.bus.interface import Copies, Told
from backbone.component.messages import LogLevel, StoryEvent
from backbone.recording.hearing import is_meant
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import NoRecording, NotOfMessages, Recorded, Recording, open_file
from backbone.recording.recovering import recover, recover_file
from backbone.recording.revival import revived
from backbone.recording.writer import PROFILE, RecordingWriter
from backbone.wire import Envelope, Message, write

CLASSES = message_classes()
SOURCES = ("resource_pool/scout1", "backbone/rc_manager")
ABOUT = {"mission": "night", "python": "3.11"}


def key_of(source: str) -> str:
    return f"scout/night/{source}/log"


def story(number: int) -> StoryEvent:
    return StoryEvent(float(number), "backbone/launcher", f"event {number}", "scout1", "", LogLevel.NOTICE, "anna")


def raw(source: str, number: int, body: Message) -> bytes:
    return write(Envelope(1, source, number, number / 4 - 0.1, f"{source}#0", body))


def writer(file: IO[bytes]) -> RecordingWriter:
    return RecordingWriter(file, CLASSES, ABOUT, mission_xml="<mission/>")


def recorded(senders: list[int], flushes: frozenset[int] = frozenset(), *, whole: bool = True) -> tuple[bytes, int]:
    """Return a recording of a message from each of these senders, and how many messages the last flush had."""
    file, flushed = io.BytesIO(), 0
    made = writer(file)
    for number, sender in enumerate(senders):
        source = SOURCES[sender]
        made.write(key_of(source), raw(source, number, story(number)), number / 4)
        if number in flushes:
            made.flush()
            flushed = number + 1
    if whole:
        made.finish()
    return file.getvalue(), flushed


def read(data: bytes, *patterns: str, **times: Any) -> list[Recorded]:
    return list(Recording(io.BytesIO(data)).messages(patterns, **times))


senders = st.lists(st.integers(0, 1), max_size=30)


@given(senders)
def test_all_messages_come_back_in_the_order_of_sending(sent: list[int]) -> None:
    data, _ = recorded(sent)
    found = read(data)
    assert [(one.source, one.sequence, one.heard_s, one.stamp_s) for one in found] == [
        (SOURCES[sender], number, number / 4, number / 4 - 0.1) for number, sender in enumerate(sent)
    ]
    assert all(one.at_s == pytest.approx(max(0.0, one.stamp_s)) for one in found)
    assert [revived(StoryEvent, one.body) for one in found] == [*map(story, range(len(sent)))]
    contents = Recording(io.BytesIO(data)).contents()
    assert (contents.messages, contents.about) == (len(sent), ABOUT)
    assert sum(one.messages for one in contents.counts) == len(sent)


@given(senders, st.frozensets(st.integers(0, 29)), st.data())
def test_of_a_recording_cut_anywhere_all_that_came_before_the_cut_is_recovered(
    sent: list[int], flushes: frozenset[int], data: st.DataObject
) -> None:
    whole, flushed = recorded(sent, flushes, whole=False)
    cut = data.draw(st.integers(0, len(whole)))
    made = io.BytesIO()
    try:
        count, damaged, unread = recover(io.BytesIO(whole[:cut]), made)
    except NoRecording:
        assert cut < 64, "only a file without even a header is none"
        return
    found = read(made.getvalue())
    assert [one.sequence for one in found] == [*range(count)], "no gap, none twice"
    assert damaged == 0
    if cut == len(whole):
        assert (count, unread) == (flushed, 0)


@given(st.data())
def test_damage_never_reads_as_something_else(data: st.DataObject) -> None:
    whole, _ = recorded([0, 1] * 10, frozenset({5, 11}))
    at = data.draw(st.integers(0, len(whole) - 1))
    broken = whole[:at] + bytes([whole[at] ^ data.draw(st.integers(1, 255))]) + whole[at + 1 :]
    try:
        found = read(broken)
    except NoRecording:
        return
    assert found == read(whole)[: len(found)]


@given(st.data())
def test_of_a_damaged_file_facts_and_mission_file_are_read_or_refused(data: st.DataObject) -> None:
    whole, _ = recorded([0, 1])
    begin = whole.index(b"<mission/>") + len(b"<mission/>")  # facts and mission file come before the messages
    at = data.draw(st.integers(0, begin - 1))
    broken = whole[:at] + bytes([whole[at] ^ data.draw(st.integers(1, 255))]) + whole[at + 1 :]
    for read_part in (Recording.contents, Recording.mission_xml):
        with suppress(NoRecording):
            read_part(Recording(io.BytesIO(broken)))


@pytest.mark.parametrize(
    ("data", "why"),
    [(b"", "is empty"), (b"hello", "another kind"), (b"RIFF" * 100, "another kind"), (bytes(1000), "another kind")],
    ids=["empty", "short", "RIFF", "zeros"],
)
def test_what_is_no_recording_is_refused_with_a_remedy(data: bytes, why: str) -> None:
    for use in (Recording, lambda file: recover(file, io.BytesIO())):
        with pytest.raises(NoRecording, match=f"no recording: .*{why}") as refused:
            use(io.BytesIO(data))
        assert "recover" not in refused.value.remedy, "recovering it is refused as well"


def test_an_unfinished_recording_names_the_remedy_and_recovers(tmp_path: Path) -> None:
    data, _ = recorded([0, 1, 0], frozenset({2}), whole=False)
    broken, whole = tmp_path / "broken.mcap", tmp_path / "whole.mcap"
    broken.write_bytes(data)
    with broken.open("rb") as file, pytest.raises(NoRecording) as refused:
        Recording(file)
    assert "still runs" in refused.value.remedy
    assert "record recover" in refused.value.remedy
    assert recover_file(broken, whole).messages == 3
    with whole.open("rb") as file:
        recording = Recording(file)
        assert recording.mission_xml() == "<mission/>"
        assert recording.contents().about == ABOUT
    with pytest.raises(FileExistsError):
        recover_file(broken, whole)


def test_what_cannot_be_read_after_the_last_chunk_is_told_by_its_length() -> None:
    data, _ = recorded([0, 1] * 3, frozenset({1, 3}))
    index = SeekingReader(io.BytesIO(data)).get_summary().chunk_indexes  # type: ignore[union-attr]
    second, third = index[1].chunk_start_offset, index[1].chunk_start_offset + index[1].chunk_length
    broken = bytearray(data)
    broken[second + 4] ^= 1  # its length
    for file, expected in (
        (data, (6, 0, 0)),
        (bytes(broken), (6, 0, 0)),  # the index has the place of the next chunk
        (bytes(broken[:-20]), (4, 0, len(data) - 20 - third)),
        (data + data, (6, 0, len(data))),
        (data[:-20], (6, 0, 0)),  # the index is cut, no message
    ):
        assert recover(io.BytesIO(file), io.BytesIO()) == expected


@pytest.mark.parametrize("at", [0, 1, 2])
@pytest.mark.parametrize("byte", [0, 3, 8])
def test_damage_between_chunks_costs_no_others_if_the_index_is_whole(at: int, byte: int) -> None:
    """The begin of a chunk is its kind and its length; the library skips by this length, and what is of no kind."""
    data, _ = recorded([0, 1] * 3, frozenset({1, 3}))
    chunks = [one.chunk_start_offset for one in SeekingReader(io.BytesIO(data)).get_summary().chunk_indexes]  # type: ignore[union-attr]
    broken, made = bytearray(data), io.BytesIO()
    broken[chunks[at] + byte] ^= 0x70
    messages, damaged, unread = recover(io.BytesIO(broken), made)
    assert (messages + 2 * damaged, unread) == (6, 0)
    assert [one.sequence for one in read(made.getvalue())] == [n for n in range(6) if not damaged or n // 2 != at]


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_damaged_chunk_costs_its_own_messages_alone(at: int) -> None:
    data, _ = recorded([0, 1] * 3, frozenset({1, 3}))
    chunks = [one.chunk_start_offset for one in SeekingReader(io.BytesIO(data)).get_summary().chunk_indexes]  # type: ignore[union-attr]
    broken, made = bytearray(data), io.BytesIO()
    broken[chunks[at] + 100] ^= 1
    assert recover(io.BytesIO(broken), made) == (4, 1, 0)
    assert [one.sequence for one in read(made.getvalue())] == [n for n in range(6) if n // 2 != at]


@pytest.mark.parametrize(
    "use", [open_file, lambda path: recover_file(path, path.with_name("whole"))], ids=["open", "recover"]
)
def test_a_pipe_is_refused_and_not_waited_for(use: Callable[[Path], object], tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.mcap"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="no regular file"):
        use(pipe)
    assert not pipe.with_name("whole").exists()


def test_what_cannot_be_recovered_leaves_no_file(tmp_path: Path) -> None:
    broken, whole = tmp_path / "broken.mcap", tmp_path / "whole.mcap"
    broken.write_bytes(b"RIFF" * 100)
    with pytest.raises(NoRecording):
        recover_file(broken, whole)
    assert not whole.exists()


def test_keys_and_times_choose_messages() -> None:
    data, _ = recorded([0, 1, 0, 1])
    assert [one.sequence for one in read(data, "resource_pool/*/log")] == [0, 2]
    assert [one.sequence for one in read(data, since_s=0.15, until_s=0.4)] == [1, 2]
    assert read(data, "nobody/*") == []
    assert read(data, since_s=0.4, until_s=0.15) == []


@given(st.permutations(range(8)))
def test_what_arrives_in_another_order_is_read_in_the_order_of_sending(arrived: list[int]) -> None:
    file = io.BytesIO()
    made = writer(file)
    for number in arrived:
        made.write(key_of(SOURCES[0]), raw(SOURCES[0], number, story(number)), 2.0)
        made.flush()
    made.finish()
    assert [one.sequence for one in read(file.getvalue())] == [*range(8)]


@pytest.mark.parametrize("stamp_s", [-86_400.0, 1e12])
def test_a_time_that_is_not_credible_orders_nothing(stamp_s: float) -> None:
    file = io.BytesIO()
    made = writer(file)
    made.write("scout/night/x/y/log", write(Envelope(1, "x/y", 1, stamp_s, "", story(1))), 3.0)
    made.finish()
    [found] = read(file.getvalue())
    assert (found.at_s, found.stamp_s) == (3.0, stamp_s)


def test_a_question_of_which_asker_and_answerer_send_copies_is_written_once() -> None:
    """Its answer was lost on the way back, so the asker believes that nobody answered."""
    file = io.BytesIO()
    made, at = writer(file), f"scout/m/{SOURCES[1]}/ask"
    for number in range(3):
        made.write(at, raw(SOURCES[0], number, story(number)), 5.0)
    for number in (1, 3):
        made.write(at, raw(SOURCES[0], number, story(number)), 5.1)
    made.write(at, raw(SOURCES[1], 1, story(1)), 5.1)
    for _ in range(2):
        made.write(at, b"no message", 5.2)
    made.finish()
    assert [(one.source, one.sequence) for one in read(file.getvalue(), "*/ask")] == [
        (SOURCES[0], 0),
        (SOURCES[0], 1),
        (SOURCES[1], 1),
        (SOURCES[0], 2),
        (SOURCES[0], 3),
        ("", 0),
        ("", 0),
    ]


def test_a_question_whose_answer_took_hours_stands_where_it_was_asked() -> None:
    file = io.BytesIO()
    made = writer(file)
    made.write(key_of(SOURCES[0]), raw(SOURCES[0], 20, story(20)), 5.0)
    made.write(key_of(SOURCES[0]), raw(SOURCES[0], 1, story(1)), 10_000.0)
    made.finish()
    assert [one.sequence for one in read(file.getvalue())] == [1, 20]


def test_unknown_messages_and_bytes_that_are_none_are_in_the_recording() -> None:
    file = io.BytesIO()
    made = writer(file)
    made.write("scout/night/x/y/log", msgspec.msgpack.encode([1, "x/y", 4, 1.0, "", ["Newcomer/3", 5]]), 1.0)
    made.write("scout/night/x/y/log", b"\xc1\xc1", 2.0)
    made.finish()
    unknown, bad = read(file.getvalue())
    assert (unknown.schema, unknown.body, unknown.id) == ("Newcomer/3", ["Newcomer/3", 5], "x/y#4")
    assert (bad.schema, bad.body, bad.at_s) == ("", b"\xc1\xc1", 2.0)


@pytest.mark.parametrize(
    ("pattern", "is_so"),
    [("*", True), ("resource_pool/*", True), ("scout/night/*", True), ("*/log", True), ("*/frames", False)],
)
def test_a_pattern_may_leave_the_mission_out(pattern: str, is_so: bool) -> None:
    assert is_meant("scout/night/resource_pool/scout1/log", (pattern,)) is is_so


def test_with_more_senders_than_channels_each_message_says_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("backbone.recording.writer.MOST_CHANNELS", 3)
    file = io.BytesIO()
    made = writer(file)
    for number in range(8):
        source = f"ui_console/console-{number}"
        made.write(key_of(source), raw(source, number, story(number)), number / 4)
    made.write("scout/night/x/y/log", b"\xc1", 3.0)
    made.finish()
    found = read(file.getvalue())
    assert [one.source for one in found] == [*(f"ui_console/console-{number}" for number in range(8)), ""]
    assert [one.key for one in found[:8]] == [key_of(one.source) for one in found[:8]]
    assert [one.sequence for one in read(file.getvalue(), "*/console-6/log")] == [6]
    assert len(Recording(io.BytesIO(file.getvalue())).contents().counts) == 5


def test_copies_inside_copies_are_not_followed() -> None:
    inner = write(Envelope(1, "x/y", 1, 0.0, "", Told([])))
    for _ in range(50):
        inner = write(Envelope(1, "x/y", 1, 0.0, "", Told([Copies("x/y", "ask", [inner, b"\xc1"])])))
    file = io.BytesIO()
    made = writer(file)
    made.write("scout/night/x/y/told", inner, 0.0)
    made.finish()
    assert [one.schema for one in read(file.getvalue())] == ["Told/1", ""]


UNNUMBERED = b'{"stamp_s":"soon","heard_s":1.0,"sequence":1,"cause":"","body":{}}'
NO_KEY = UNNUMBERED.replace(b'"soon"', b'1.0,"key":5')
NO_SOURCE = UNNUMBERED.replace(b'"soon"', b'1.0,"source":null')


@pytest.mark.parametrize("data", [b"{}", b"7", b'{"x": 1}', b"[]", UNNUMBERED, NO_KEY, NO_SOURCE])
def test_messages_of_another_form_are_refused(data: bytes) -> None:
    file = foreign(PROFILE, data, {"key": "scout/night/x/y/log"})
    file.name = "other.mcap"
    with pytest.raises(
        NotOfMessages, match=r"^other\.mcap: the message at 0.000 s in /t is none of a bus: it "
    ) as told:
        [*Recording(file).messages()]
    assert "__init__" not in told.value.detail


@pytest.mark.parametrize("about", [{}, {"key": "camera"}, {"key": "scout/night/log"}, {"key": "a/b/c/d"}])
def test_a_file_whose_keys_are_none_of_a_bus_is_refused_when_it_is_opened(about: dict[str, str]) -> None:
    """A player would ask for the address in such a key, and there is none."""
    with pytest.raises(NotOfMessages, match="is no key of a bus"):
        Recording(foreign(PROFILE, b"{}", about))


@pytest.mark.parametrize("profile", ["", "ros1", "ros2", "px4"])
def test_a_file_of_another_program_is_not_recovered(profile: str) -> None:
    with pytest.raises(NotOfMessages):
        recover(foreign(profile, b"{}"), io.BytesIO())


def foreign(profile: str, data: bytes, about: dict[str, str] | None = None) -> io.BytesIO:
    """Return another program's MCAP file, of this profile, with one JSON message."""
    file = io.BytesIO()
    made = Writer(file)
    made.start(profile=profile)
    made.add_message(made.register_channel("/t", "json", 0, about or {}), 0, data, 0)
    made.finish()
    return file
