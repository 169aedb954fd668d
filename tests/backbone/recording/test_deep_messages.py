"""A message that is nested as deeply as the recorder can write costs no reader the rest of the recording."""

from __future__ import annotations

import json
from pathlib import Path
from threading import Thread

import msgspec
import pytest
from small_recordings import CLASSES, MISSION, SCOUT

from backbone.command_line.event_loop import exit_code_of
from backbone.command_line.exporting import CsvTables, export
from backbone.command_line.recording_work import print_messages
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.launcher.endings import ExitCode
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION

DEPTHS = range(800, 1001)  # around the limit of the interpreter


@pytest.fixture
def night(tmp_path: Path) -> Path:
    path = tmp_path / "night.mcap"
    recorder = Thread(target=record, args=(path,))  # which stands in fewer calls than a test, and so writes more
    recorder.start()
    recorder.join()
    return path


def record(path: Path) -> None:
    with path.open("wb") as file:
        writer = RecordingWriter(file, CLASSES, {"mission": MISSION})
        for depth in DEPTHS:
            raw = msgspec.msgpack.encode([WIRE_VERSION, SCOUT, depth, float(depth), "", ["Nest/1", 0]])
            nested = raw[:-1] + depth * b"\x91" + raw[-1:]  # MessagePack: a list of one item
            writer.write(key_of(MISSION, SCOUT, Conversation.READINGS), nested, float(depth))
        writer.finish()


@pytest.mark.parametrize("as_json", [True, False])
def test_each_message_is_printed(night: Path, capsys: pytest.CaptureFixture[str], as_json: bool) -> None:
    assert exit_code_of(lambda: print_messages(night, (), 0.0, None, 1000, as_json=as_json)) == ExitCode.DONE
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(DEPTHS)
    assert "Nest/1" in lines[0]
    if as_json:
        assert json.loads(lines[-1])["schema"] == ""


def test_each_message_is_exported(night: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "tables"
    assert exit_code_of(lambda: export(night, folder, (), CsvTables, with_videos=False)) == ExitCode.DONE
    assert f"{len(DEPTHS)} rows" in capsys.readouterr().err
