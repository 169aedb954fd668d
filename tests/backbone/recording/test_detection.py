"""Marks of a recording are detected or missed, and sightings outside of them are false alarms."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.command_line.comparing import compare_detection
from backbone.launcher.endings import ExitCode
from backbone.recording.detection import (
    SIGHTING,
    Mark,
    MarkNotRecorded,
    NoMarks,
    WatcherReport,
    detected,
    read_marks,
    worse,
)
from backbone.recording.detection import sightings as sightings_in
from backbone.recording.known_messages import message_classes
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded
from backbone.recording.writer import RecordingWriter
from backbone.wire import Envelope, schema_of, write
from mission_control.messages import MotionSeen, Region

LASTED_S = 120.0
ROBOTS = ("scout1", "scout2")
times = st.integers(0, 100).map(float)
sightings = st.lists(st.builds(WatcherReport, times, st.sampled_from(ROBOTS)), max_size=8)
marks = st.lists(
    st.builds(
        lambda from_s, lasts_s, robot: Mark(from_s, from_s + lasts_s, "intruder", robot),
        times,
        st.integers(0, 20),
        st.sampled_from(("", *ROBOTS)),
    ),
    min_size=1,
    max_size=5,
)


@given(marks, sightings)
def test_each_mark_is_detected_or_missed_and_each_sighting_counts(told: list[Mark], seen: list[WatcherReport]) -> None:
    found = detected(told, seen, LASTED_S)
    assert len(found.seen_after_s) + found.missed == len(told)
    assert found.false_alarms + sum(any(mark.has(one) for mark in told) for one in seen) == len(seen)
    assert all(
        0 <= after_s <= mark.to_s - mark.from_s
        for mark, after_s in zip(told, found.delays_s, strict=True)
        if after_s is not None
    )


@pytest.mark.parametrize("body", [{"at_s": None, "robot": "scout1"}, {"at_s": "1", "robot": "scout1"}, {"at_s": 1.0}])
def test_a_sighting_without_a_time_or_a_robot_is_left_out(body: dict[str, object]) -> None:
    """A time that is not finite is null in a recording."""

    def told(body: object) -> Recorded:
        return Recorded("scout/night/x/y/events", "x/y", f"{SIGHTING}/1", 1.0, 1.0, 1.0, 1, "", body)

    assert [one.at_s for one in sightings_in([told(body), told({"at_s": 2.0, "robot": "scout1"})])] == [2.0]


@given(marks)
def test_who_sees_each_mark_at_its_begin_misses_nothing(told: list[Mark]) -> None:
    found = detected(told, [WatcherReport(mark.from_s, mark.robot or ROBOTS[0]) for mark in told], LASTED_S)
    assert (found.missed, found.false_alarms, found.largest_delay_s) == (0, 0, 0.0)


@given(marks, sightings, st.integers(0, 10_000))
def test_a_shift_of_all_times_changes_nothing(told: list[Mark], seen: list[WatcherReport], by_s: int) -> None:
    later = [Mark(mark.from_s + by_s, mark.to_s + by_s, mark.what, mark.robot) for mark in told]
    assert detected(later, [WatcherReport(one.at_s + by_s, one.robot) for one in seen], LASTED_S) == detected(
        told, seen, LASTED_S
    )


@given(marks, sightings, st.randoms(use_true_random=False))
def test_the_order_of_sightings_does_not_matter(told: list[Mark], seen: list[WatcherReport], rng: object) -> None:
    mixed = [*seen]
    rng.shuffle(mixed)  # type: ignore[attr-defined]
    assert detected(told, mixed, LASTED_S) == detected(told, seen, LASTED_S)


@given(marks, sightings, st.builds(WatcherReport, times, st.sampled_from(ROBOTS)))
def test_a_sighting_more_is_worse_only_as_a_false_alarm(
    told: list[Mark], seen: list[WatcherReport], more: WatcherReport
) -> None:
    before, after = detected(told, seen, LASTED_S), detected(told, [*seen, more], LASTED_S)
    assert worse(before, before) == []
    assert bool(worse(before, after)) is not any(mark.has(more) for mark in told)


def test_a_mark_that_is_missed_or_detected_later_is_worse() -> None:
    told = [Mark(10, 20), Mark(30, 40)]
    soon = detected(told, [WatcherReport(11, "scout1"), WatcherReport(31, "scout1")], LASTED_S)
    late = detected(told, [WatcherReport(14, "scout1")], LASTED_S)
    assert worse(soon, late) == ["mark 1 is detected 3.000 s later", "mark 2 is missed"]
    assert worse(soon, late, later_s=3.0) == ["mark 2 is missed"]
    assert worse(late, soon) == []
    assert (late.median_delay_s, late.missed, soon.median_delay_s) == (4.0, 1, 1.0)


@given(marks)
def test_marks_are_read_as_they_were_written(told: list[Mark]) -> None:
    assert read_marks("\n\n".join(msgspec.json.encode(mark).decode() for mark in told)) == told


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("nonsense", "line 2 is no mark"),
        ("[1]", "line 2 is no mark"),
        ('{"from_s": 1}', "to_s"),
        ('{"from_s": "a", "to_s": 2}', "from_s"),
        ('{"from_s": -1, "to_s": 2}', "from_s"),
        ('{"from_s": 1, "to_s": 2, "robto": "scout1"}', "robto"),
        ('{"from_s": 3, "to_s": 2}', "line 2: it ends at 2 s, before 3 s"),
    ],
)
def test_a_line_that_is_no_mark_is_refused_with_its_number(line: str, said: str) -> None:
    with pytest.raises(NoMarks, match=said) as refused:
        read_marks(f'{{"from_s": 1, "to_s": 2}}\n{line}\n')
    assert refused.value.facts["line"] == 2


def test_a_file_without_marks_is_refused() -> None:
    with pytest.raises(NoMarks):
        read_marks("\n \n")


async def test_the_command_says_which_recording_is_worse(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    marks_file, paths = tmp_path / "marks.jsonl", [tmp_path / "one.mcap", tmp_path / "other.mcap"]
    marks_file.write_text('{"from_s": 10, "to_s": 20}\n{"from_s": 30, "to_s": 40}\n')
    for path, seen_s in zip(paths, ([11.0, 31.0], [12.0, 50.0]), strict=True):
        record(path, seen_s)
    assert await compare_detection(paths, marks_file, 0.0, as_json=False) == ExitCode.REFUSED
    said = capsys.readouterr()
    assert [line.partition(": ")[2][:25] for line in said.out.splitlines()] == [
        "detected 2 of 2 marks, mi",
        "detected 1 of 2 marks, mi",
    ]
    assert [line.rpartition(": ")[2][:18] for line in said.err.splitlines()] == [
        "mark 1 is detected",
        "mark 2 is missed",
        "1 false alarms a m",
    ]
    assert await compare_detection(paths[:1], marks_file, 0.0, as_json=True) == ExitCode.DONE
    [judged] = map(msgspec.json.decode, capsys.readouterr().out.splitlines())
    assert (judged["delays_s"], judged["missed"], judged["worse"]) == ([1.0, 1.0], 0, [])


@pytest.mark.parametrize(("mark", "is_recorded"), [((50, 3600), True), ((61, 70), False), ((900, 920), False)])
async def test_a_mark_that_a_recording_cannot_have_is_refused(
    tmp_path: Path, mark: tuple[int, int], is_recorded: bool
) -> None:
    """It would count as missed, as if a watcher had been blind."""
    marks_file, path = tmp_path / "marks.jsonl", tmp_path / "one.mcap"
    marks = [Mark(10.0, 20.0), Mark(*map(float, mark))]
    marks_file.write_bytes(msgspec.json.Encoder().encode_lines(marks))
    record(path, [11.0])
    if is_recorded:
        assert await compare_detection([path], marks_file, 0.0, as_json=False) is ExitCode.DONE
        return
    told = rf"mark 2 is from {mark[0]} to {mark[1]} s, but .*one.mcap has 0.000 to 60.000 s"
    with pytest.raises(MarkNotRecorded, match=told):
        await compare_detection([path], marks_file, 0.0, as_json=False)


def record(path: Path, seen_s: list[float]) -> None:
    """Write a recording of a minute in which a watcher saw something at these times."""
    seen = [(at_s, MotionSeen(at_s, "scout1", Region(0, 0, 1, 1))) for at_s in seen_s]
    with path.open("wb") as file:
        made = RecordingWriter(file, message_classes(), {})
        for number, (at_s, told) in enumerate([(0.0, Presence(True)), *seen, (60.0, Presence(False))], start=1):
            made.write("scout/night/x/y/events", write(Envelope(1, "x/y", number, at_s, "", told)), at_s)
        made.finish()


def test_a_sighting_is_what_watchers_publish() -> None:
    assert schema_of(MotionSeen).partition("/")[0] == SIGHTING
    assert {"at_s", "robot"} <= {*MotionSeen.__struct_fields__}
