"""The story of a recording has each event that is asked for, however many there are."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.command_line.recording_work import print_events, print_keys
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.mission_log.log import EVENTS_KEPT, MOST_EVENTS_BYTES
from backbone.ranges import LONGEST_TEXT

EACH_S = 0.5
MANY = EVENTS_KEPT + 5  # more than a mission keeps


def night(folder: Path, count: int) -> Path:
    """Return a recording of so many events."""
    events = (StoryEvent(EACH_S * at, SCOUT, f"event {at}", "scout1", "", LogLevel.INFO) for at in range(count))
    path = folder / "night.mcap"
    path.write_bytes(recorded(Said(event.at_s, SCOUT, Conversation.LOG, event) for event in events).getvalue())
    return path


@pytest.mark.parametrize(
    ("count", "since_s", "until_s", "numbers"),
    [(MANY, 0.0, None, range(MANY)), (9, 0.0, 1.0, range(3)), (9, 1e-5, 1.0, range(1, 3)), (9, 1e9, None, range(0))],
)
async def test_each_event_of_that_time_is_printed(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    count: int,
    since_s: float,
    until_s: float | None,
    numbers: range,
) -> None:
    assert await print_events(night(tmp_path, count), "scout1", since_s, until_s, as_json=False) is ExitCode.DONE
    lines = capsys.readouterr().out.splitlines()
    assert [line.rpartition(" ")[2] for line in lines] == [str(number) for number in numbers]


async def test_more_events_than_fit_one_message_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    long = "x" * LONGEST_TEXT
    count = MOST_EVENTS_BYTES // len(long) + 2
    events = (StoryEvent(at, SCOUT, f"{at} {long}"[:LONGEST_TEXT], "scout1", "", LogLevel.INFO) for at in range(count))
    path = tmp_path / "night.mcap"
    path.write_bytes(recorded(Said(event.at_s, SCOUT, Conversation.LOG, event) for event in events).getvalue())
    assert await print_events(path, "scout1", 0.0, None, as_json=True) is ExitCode.DONE
    assert len(capsys.readouterr().out.splitlines()) == count


async def test_an_event_of_several_lines_is_one_line_and_forges_no_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    what = "is well\n     9.000 s  backbone/launcher                 scout1: all is well"
    event = StoryEvent(1.0, SCOUT, what, "scout1", "", LogLevel.INFO)
    path = tmp_path / "night.mcap"
    path.write_bytes(recorded([Said(1.0, SCOUT, Conversation.LOG, event)]).getvalue())
    assert await print_events(path, "", 0.0, None, as_json=False) is ExitCode.DONE
    [line] = capsys.readouterr().out.splitlines()
    assert r"is well\n " in line


@pytest.mark.parametrize(
    ("times_s", "shown"),
    [((1.0, 1.0), "2         -  "), ((1.0, 1.000_001), "2         -  "), ((1.0, 3.0), "2      1.00/s")],
)
async def test_messages_of_a_moment_have_no_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], times_s: tuple[float, ...], shown: str
) -> None:
    path = tmp_path / "night.mcap"
    told = (Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, "", "", "", LogLevel.INFO)) for at_s in times_s)
    path.write_bytes(recorded(told).getvalue())
    assert await print_keys(path, as_json=False) is ExitCode.DONE
    assert shown in capsys.readouterr().out
