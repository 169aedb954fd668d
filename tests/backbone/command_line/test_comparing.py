"""What ``compare`` and ``replay --without`` print about two recordings."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.command_line import comparing
from backbone.command_line.comparing import print_comparison
from backbone.command_line.opened_recording import NothingSelected
from backbone.command_line.unusable_file import FileUnusable
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.recording.comparison import KeyComparison, NumberError, compared
from backbone.recording.reader import NoRecording, Recording

OTHER = "resource_pool/scout2"
EVENT = StoryEvent(0.0, SCOUT, "seen", "", "", LogLevel.INFO)


def events(*texts: str) -> Recording:
    """Return a recording with an event a second, in turn at two robots."""
    said = [
        Said(float(n), where, Conversation.LOG, StoryEvent(0.0, where, text, "", "", LogLevel.INFO), where)
        for n, (text, where) in enumerate(zip(texts, [OTHER, SCOUT] * len(texts), strict=False))
    ]
    return Recording(recorded(said))


def test_the_first_difference_of_all_keys_is_named(capsys: pytest.CaptureFixture[str]):
    found = compared(events("a", "b", "c", "d").messages(), events("a", "B", "C", "d").messages())
    assert print_comparison(found, as_json=False) is ExitCode.REFUSED
    told = f"2 of 2 keys differ; the first is message 0 of {SCOUT}/log  StoryEvent/1 at 1.000 s"
    assert told in capsys.readouterr().err


def test_of_equal_recordings_no_difference_is_named(capsys: pytest.CaptureFixture[str]):
    found = compared(events("a", "b").messages(), events("a", "b").messages())
    assert print_comparison(found, as_json=False) is ExitCode.DONE
    assert "0 of 2 keys differ\n" in capsys.readouterr().err


def test_differences_too_large_for_a_number_are_json() -> None:
    found = NumberError()
    found.add(1e155)
    found.add(1e155)
    assert found.rms == pytest.approx(1e155)
    found.add(math.inf)  # of 1e308 and -1e308
    comparison = KeyComparison(3, 3, 3, None, {"x_m": found})
    with pytest.MonkeyPatch.context() as patched:
        shown: list[str] = []
        patched.setattr(comparing, "show", shown.extend)
        print_comparison({("key", "source", "Thing/1"): comparison}, as_json=True)
    assert json.loads(shown[0], parse_constant=pytest.fail)["errors"] == {
        "x_m": {"rms": None, "largest": None, "count": 3}
    }


async def test_of_two_files_the_one_that_is_no_recording_is_named(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.mcap", tmp_path / "bad.mcap"
    good.write_bytes(recorded([]).getvalue())
    bad.touch()
    with pytest.raises(NoRecording, match=r"bad\.mcap: no recording: the file is empty") as refused:
        await comparing.compare(good, bad, (), {}, as_json=False)
    assert "recover" not in refused.value.remedy


async def test_of_two_recordings_the_damaged_one_is_named(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.mcap", tmp_path / "bad.mcap"
    whole = recorded([Said(float(n), SCOUT, Conversation.LOG, EVENT) for n in range(99)]).getvalue()
    chunk = whole.index(b"\x28\xb5\x2f\xfd")  # RFC 8878: the begin of each frame of Zstandard
    good.write_bytes(whole)
    bad.write_bytes(whole[: chunk + 20] + b"damaged" + whole[chunk + 27 :])
    with pytest.raises(NoRecording, match=rf"{bad} is damaged: "):
        await comparing.compare(good, bad, (), {}, as_json=False)


@pytest.mark.parametrize(("missions", "is_told"), [(("night", "day"), True), (("night", "night"), False)])
async def test_recordings_of_two_missions_are_named(
    missions: tuple[str, str], is_told: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Else the differences seem to be faults of one mission."""
    first, second = (tmp_path / f"{number}.mcap" for number in (1, 2))
    for path, mission in zip((first, second), missions, strict=True):
        path.write_bytes(recorded([Said(1.0, SCOUT, Conversation.LOG, EVENT)], mission).getvalue())
    assert await comparing.compare(first, second, (), {}, as_json=False) is ExitCode.DONE
    told = f"two missions: {first} is of night, {second} of day\n"
    assert (told in capsys.readouterr().err) is is_told


async def test_keys_that_no_message_has_are_refused(tmp_path: Path) -> None:
    """Else a wrong word in a nightly comparison counts as equal."""
    night = tmp_path / "night.mcap"
    night.write_bytes(recorded([Said(1.0, SCOUT, Conversation.LOG, EVENT)]).getvalue())
    with pytest.raises(NothingSelected, match="matches \\*/redings"):
        await comparing.compare(night, night, ("*/redings",), {}, as_json=False)
    assert await comparing.compare(night, night, ("*/log",), {}, as_json=False) is ExitCode.DONE


async def test_marks_that_cannot_be_read_are_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(FileUnusable) as refused:
        await comparing.compare_detection([], tmp_path / "marks.jsonl", 0.0, as_json=False)
    assert refused.value.detail == f"{tmp_path}/marks.jsonl cannot be read: No such file or directory"
