"""``record join`` and ``recording check`` tell whose clock was off, and refuse what cannot be joined."""

from __future__ import annotations

import asyncio
import json
import math
from pathlib import Path

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.command_line.joining import clock_lines, clocks_json, join_to
from backbone.command_line.recording_work import check_whole
from backbone.command_line.unusable_file import FileUnusable
from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.recording.clock_offsets import ClockOffsets, Offset
from backbone.recording.reader import NoRecording, Recording

NAMESERVER = "backbone/nameserver"


def state(address: str, host: str, at_s: float, cause: str = "") -> Said:
    body = ComponentState(address, "t", host, 1, LifeState.READY, at_s)
    return Said(at_s, address, Conversation.STATUS, body, address, cause)


@pytest.fixture
def off(tmp_path: Path) -> Path:
    """Return a recording in which the robot's host is two seconds ahead of base."""
    path = tmp_path / "off.mcap"
    base = [state(NAMESERVER, "base", 1.0), state(NAMESERVER, "base", 2.01, f"{SCOUT}#1")]
    far = [state(SCOUT, "far", 4.0), state(SCOUT, "far", 4.02, f"{NAMESERVER}#2")]
    path.write_bytes(recorded([*base, *far]).getvalue())
    return path


def test_a_clock_that_was_off_is_told_and_corrected(off: Path, capsys: pytest.CaptureFixture[str]) -> None:
    to, again = off.with_name("joined.mcap"), off.with_name("again.mcap")
    again.write_bytes(off.read_bytes())
    assert asyncio.run(check_whole(off, as_json=False)) is ExitCode.DONE
    assert "the clock of far was 1.9900 to 2.0100 s ahead of that of base; 'record join'" in capsys.readouterr().out
    asyncio.run(check_whole(off, as_json=True))
    clocks = json.loads(capsys.readouterr().out)["clocks"]
    expected = {"at_least_s": 1.99, "at_most_s": 2.01, "taken_s": 2.0, "moved_s": 0.0}
    assert clocks == {"far": pytest.approx(expected)}
    assert asyncio.run(join_to([off, again], to)) is ExitCode.DONE
    said = capsys.readouterr().err
    assert "4 messages; 4 that several recorders heard stand once" in said
    assert "s ahead of that of base; corrected in joined.mcap" in said
    with to.open("rb") as file:
        assert [one.id for one in Recording(file).messages()] == [
            f"{NAMESERVER}#1",
            f"{SCOUT}#1",
            f"{NAMESERVER}#2",
            f"{SCOUT}#2",
        ]
    asyncio.run(check_whole(to, as_json=False))
    assert "clock" not in capsys.readouterr().out


def test_what_cannot_be_joined_is_refused_and_leaves_no_file(off: Path) -> None:
    damaged, to = off.with_name("damaged.mcap"), off.with_name("to.mcap")
    whole = off.read_bytes()
    for content in (whole[:-100], whole[:600] + b"\0" + whole[601:], b"nothing"):
        damaged.write_bytes(content)
        with pytest.raises(NoRecording) as refused:
            asyncio.run(join_to([off, damaged], to))
        assert ("record recover" in refused.value.remedy) == (content != b"nothing")
        assert not to.exists()
    with pytest.raises(FileUnusable, match=r"off\.mcap exists"):
        asyncio.run(join_to([off], off))
    assert off.read_bytes() == whole
    for named in (off.with_name("nobody.mcap"), off.with_name("no") / "to.mcap"):
        with pytest.raises(FileUnusable, match=named.name):
            asyncio.run(join_to([off, named], to) if named.parent.exists() else join_to([off], named))


def test_bounds_are_told_as_far_as_they_are_known() -> None:
    offsets = {
        "far": Offset(-math.inf, -2.0, -2.0),
        "near": Offset(-0.001, 0.002, 0.0),
        "here": Offset(-0.1, 0.1, 0.0, 0.2),
    }
    clocks = ClockOffsets("base", {}, offsets)
    assert [*clock_lines(clocks)] == [
        "the clock of far was at least 2.0000 s behind that of base",
        "the clock of here was right on average with that of base, and changed by at least 0.2000 s",
    ]
    assert clocks_json(clocks)["far"] == {"at_least_s": None, "at_most_s": -2.0, "taken_s": -2.0, "moved_s": 0.0}
