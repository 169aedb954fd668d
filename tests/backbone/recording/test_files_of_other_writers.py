"""A recording of another MCAP writer is read whole, or refused until it is recovered; nothing is lost unsaid."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.writer import IndexType, Writer

from backbone.recording.reader import NoRecording, NotOfMessages, Recording
from backbone.recording.recovering import Recovered, recover, recover_file
from backbone.recording.writer import ABOUT, NS, PROFILE

COUNT = 50
KEY = "scout/night/resource_pool/scout1/readings"


def written(**options: Any) -> io.BytesIO:
    """Return a recording of ``COUNT`` messages, written with these options of the library."""
    file = io.BytesIO()
    writer = Writer(file, **options)
    writer.start(profile=PROFILE, library="another")
    writer.add_metadata(ABOUT, {"mission": "night"})
    writer.add_attachment(0, 0, "mission.xml", "application/xml", b"<mission/>")
    about = {"key": KEY, "source": "resource_pool/scout1", "schema": "Readings/1"}
    channel = writer.register_channel("/a", "json", writer.register_schema("Readings", "jsonschema", b"{}"), about)
    for number in range(COUNT):
        said = {"stamp_s": number, "heard_s": number, "sequence": number, "cause": "", "body": {"x": number}}
        writer.add_message(channel, number * NS, msgspec.json.encode(said), number * NS, number)
    writer.finish()
    return file


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.MESSAGE},
        {"index_types": IndexType.CHUNK},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"use_statistics": False},
    ],
    ids=str,
)
def test_a_recording_whose_index_is_incomplete_is_refused_and_recovers_whole(options: dict[str, Any]) -> None:
    file, whole = written(**options), io.BytesIO()
    with pytest.raises(NoRecording) as refused:
        Recording(file)
    assert "record recover" in refused.value.remedy
    assert recover(file, whole) == Recovered(COUNT, 0, 0)
    recording = Recording(whole)
    assert [one.body["x"] for one in recording.messages(newest_first=True)] == [*range(COUNT)][::-1]
    assert (recording.contents().about, recording.mission_xml()) == ({"mission": "night"}, "<mission/>")


def test_a_recording_without_checksums_is_read() -> None:
    """A checksum of 0 means that there is none; its index was called damaged."""
    recording = Recording(written(enable_crcs=False))
    assert [one.body["x"] for one in recording.messages()] == [*range(COUNT)]


def test_a_refusal_to_recover_names_the_file(tmp_path: Path) -> None:
    foreign = tmp_path / "of another program.mcap"
    with foreign.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="another")
        writer.finish()
    with pytest.raises(NotOfMessages, match=r"of another program\.mcap: the file is of profile 'ros2'"):
        recover_file(foreign, tmp_path / "whole.mcap")
    assert not (tmp_path / "whole.mcap").exists()
