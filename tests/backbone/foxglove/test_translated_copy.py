"""A copy of a recording shows in Foxglove's own schemas what was recorded, and all else as it was recorded."""

from __future__ import annotations

import importlib
import io
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from message_catalogue import honest_body, limit_bodies

from backbone.component.messages import LogLevel, StoryEvent
from backbone.foxglove.translated_copy import write_copy
from backbone.foxglove.well_known import GROUP, installed, shown_as
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import NotOfMessages, Recording
from backbone.recording.recovering import recover
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, Message, write
from resource_pool.localization import FloorPlan, FloorShape, Pose, ShapeKind
from resource_pool.messages import AskReadings, Frame, Readings

CLASSES = message_classes()
TRANSLATIONS = installed()
FRAMES = "scout/night/resource_pool/watch-capture/frames"
POSES = "scout/night/resource_pool/localizer/poses"
LOG = "scout/night/resource_pool/scout1/log"
READINGS = "scout/night/resource_pool/scout1/readings"
meters = st.floats(-1e6, 1e6)


def recorded(*said: tuple[str, Message]) -> io.BytesIO:
    """Return a recording of messages that were sent a second after each other."""
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, {"mission": "night"})
    for number, (key, message) in enumerate(said):
        envelope = Envelope(WIRE_VERSION, "resource_pool/it", number, float(number), "", message)
        writer.write(key, write(envelope), float(number))
    writer.finish()
    return file


def copied(file: io.BytesIO, keys: tuple[str, ...] = ()) -> io.BytesIO:
    copy = io.BytesIO()
    write_copy(Recording(file), copy, TRANSLATIONS, keys)
    return copy


def messages(file: io.BytesIO) -> list[tuple[Any, Any, Any]]:
    """Return schema, channel and record of each message, as the library of MCAP reads them."""
    file.seek(0)
    return [*make_reader(file).iter_messages()]


def well_known(copy: io.BytesIO) -> list[tuple[str, float, Any]]:
    """Return topic, time and message, decoded by Foxglove's own classes, of all in its schemas."""
    found = []
    for schema, channel, message in messages(copy):
        if schema is None or not schema.name.startswith("foxglove."):
            continue
        assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
        name = schema.name.partition(".")[2]
        kind = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)
        assert name in described(schema.data), "the file has its schema"
        read = kind.FromString(message.data)
        size_bytes = read.ByteSize()
        read.DiscardUnknownFields()
        assert read.ByteSize() == size_bytes, "it has only fields of Foxglove's schema"
        found.append((channel.topic, message.log_time / 1e9, read))
    return found


def described(schema: bytes) -> set[str]:
    files = FileDescriptorSet.FromString(schema).file
    return {message.name for file in files for message in file.message_type}


def frame(pixels: bytes, width_px: int, height_px: int, captured_s: float = 2.5) -> Frame:
    return Frame("grabber", "watch-capture", 1, "scout1", 7, captured_s, width_px, height_px, memoryview(pixels))


@given(
    size=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    captured_s=st.floats(0, 1e6),
    data=st.data(),
)
def test_a_picture_comes_back_pixel_for_pixel(size: tuple[int, int], captured_s: float, data: st.DataObject) -> None:
    width_px, height_px = size
    pixels = data.draw(st.binary(min_size=width_px * height_px, max_size=width_px * height_px))
    [(topic, at_s, image)] = well_known(copied(recorded((FRAMES, frame(pixels, width_px, height_px, captured_s)))))
    assert (topic, at_s) == ("/robots/scout1/camera", 0.0)
    assert (image.encoding, image.step, image.frame_id) == ("mono8", width_px, "scout1")
    assert image.timestamp.seconds + image.timestamp.nanos / 1e9 == pytest.approx(captured_s, abs=1e-6)
    assert np.frombuffer(image.data, np.uint8).reshape(image.height, image.width).tobytes() == pixels


@given(x_m=meters, y_m=meters, heading_rad=st.floats(-math.pi, math.pi))
def test_a_pose_comes_back_with_its_numbers_under_the_name_of_its_robot(
    x_m: float, y_m: float, heading_rad: float
) -> None:
    found = well_known(copied(recorded((POSES, Pose("scout1", 4.0, x_m, y_m, heading_rad)))))
    [(transform_topic, _, transform), (mark_topic, _, mark)] = found
    assert (transform_topic, mark_topic) == ("/robots/scout1/pose", "/robots/scout1/mark")
    assert (transform.parent_frame_id, transform.child_frame_id) == ("room", "scout1")
    [entity] = mark.entities
    assert (entity.id, entity.frame_id, entity.texts[0].text) == ("scout1", "room", "scout1")
    for where, turned in (
        (transform.translation, transform.rotation),
        (entity.arrows[0].pose.position, entity.arrows[0].pose.orientation),
    ):
        assert (where.x, where.y, where.z) == (x_m, y_m, 0.0)
        assert 2 * math.atan2(turned.z, turned.w) == pytest.approx(heading_rad)


@pytest.mark.parametrize("kind", TRANSLATIONS, ids=lambda kind: kind.__name__)
def test_whatever_a_message_says_it_is_shown(kind: type[Message]) -> None:
    for body in [honest_body(kind), *(sample.body for sample in limit_bodies(kind))]:
        sent = msgspec.msgpack.decode(msgspec.msgpack.encode(body), type=kind)
        assert all(one.message.encode() for one in shown_as(sent, TRANSLATIONS))


def test_all_but_the_pictures_is_also_as_it_was_recorded() -> None:
    file = recorded(
        (FRAMES, frame(bytes(6), 3, 2)),
        (POSES, Pose("scout1", 1.0, 1.0, 2.0, 0.5)),
        (READINGS, Readings("scout1", 2.0, {"battery_share": 0.5})),
        (LOG, StoryEvent(3.0, "resource_pool/scout1", "stalled", "scout1", "", LogLevel.ALARM)),
    )
    as_recorded = {(c.topic, s.name, m.log_time, m.data) for s, c, m in messages(file) if s}
    in_copy = {(c.topic, s.name, m.log_time, m.data) for s, c, m in messages(copied(file)) if s}
    assert {name for _, name, *_ in as_recorded - in_copy} == {"Frame/1"}
    assert all(name.startswith("foxglove.") for _, name, *_ in in_copy - as_recorded)


def test_events_and_actions_of_people_are_lines_of_the_log() -> None:
    event = StoryEvent(3.0, "resource_pool/scout1", "stalled", "scout1", "", LogLevel.ALARM)
    stop = OperatorActed("anna", OperatorAction.STOP_ROBOT, "scout1", "child in the room", 2.0)
    lines = well_known(copied(recorded((LOG, event), ("scout/night/ui_console/it/operators", stop))))
    assert [(topic, line.message, line.name, line.level) for topic, _, line in lines] == [
        ("/log", "scout1: stalled", "resource_pool/scout1", 4),
        ("/log", "scout1: anna stops it: child in the room", "anna", 4),
    ]


def test_the_floor_has_its_shapes() -> None:
    plan = FloorPlan(4.0, 3.0, [FloorShape("wall1", ShapeKind.WALL, 1.0, 2.0, 0.5, 0.1, math.pi / 2)])
    asked = "scout/night/resource_pool/localizer/ask"
    [(topic, _, update)] = well_known(copied(recorded((asked, plan))))
    assert topic == "/floor"
    [ground, wall] = update.entities[0].cubes
    assert (ground.pose.position.x, ground.size.x, ground.size.y) == (2.0, 4.0, 3.0)
    assert (wall.pose.position.x, wall.pose.position.y, wall.size.x) == (1.0, 2.0, 0.5)


def test_only_keys_that_are_meant_are_copied() -> None:
    file = recorded((READINGS, Readings("scout1", 2.0, {})), (POSES, Pose("scout1", 1.0, 1.0, 2.0, 0.5)))
    schemas = {schema.name for schema, _, _ in messages(copied(file, ("*/readings",))) if schema}
    assert schemas == {"Readings/1"}


def test_messages_of_unknown_classes_and_bytes_are_copied_too() -> None:
    file = io.BytesIO()
    writer = RecordingWriter(file, {"AskReadings/1": AskReadings}, {})
    unknown = Envelope(WIRE_VERSION, "resource_pool/it", 1, 1.0, "", Readings("scout1", 2.0, {}))
    for raw in (write(unknown), b"nonsense"):
        writer.write(READINGS, raw, 1.0)
    writer.finish()
    assert [(schema, message.data) for schema, _, message in messages(copied(file))] == [
        (schema, message.data) for schema, _, message in messages(file)
    ]


@pytest.mark.parametrize("used", [Recording, lambda file: recover(file, io.BytesIO())], ids=["read", "recovered"])
def test_nobody_takes_a_copy_for_a_recording(used: Callable[[io.BytesIO], object]) -> None:
    copy = copied(recorded((POSES, Pose("scout1", 1.0, 1.0, 2.0, 0.5))))
    copy.seek(0)
    with pytest.raises(NotOfMessages, match="profile ''"):
        used(copy)


def scout_backbone(*words: str, begin: str = "") -> subprocess.CompletedProcess[str]:
    code = f"import sys\n{begin}\nfrom backbone.command_line.cli import app; app({list(words)!r})"
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)


@pytest.mark.processes
def test_the_command_writes_a_new_file_and_tells_what_it_lacks(tmp_path: Path) -> None:
    path, to = tmp_path / "it.mcap", tmp_path / "shown.mcap"
    path.write_bytes(recorded((FRAMES, frame(bytes(6), 3, 2))).getvalue())
    lacking = scout_backbone("recording", "foxglove", str(path), str(to), begin="sys.modules['foxglove'] = None")
    assert (lacking.returncode, to.exists()) == (2, False), lacking.stderr
    assert "scout-backbone[foxglove]" in lacking.stderr
    done = scout_backbone("recording", "foxglove", str(path), str(to))
    assert done.returncode == 0, done.stderr
    assert [topic for topic, *_ in well_known(io.BytesIO(to.read_bytes()))] == ["/robots/scout1/camera"]
    again = scout_backbone("recording", "foxglove", str(path), str(to))
    assert (again.returncode, "exists" in again.stderr) == (2, True), again.stderr


@pytest.mark.parametrize(
    ("raised", "told"),
    [("OSError('no gauge')", "OSError: no gauge"), ("SystemExit('a program')", "SystemExit: a program")],
)
def test_a_package_whose_translations_cannot_be_loaded_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, raised: str, told: str
) -> None:
    about = tmp_path / "gauges-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: gauges\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\ngauges = gauges_in_work:TRANSLATIONS\n")
    (tmp_path / "gauges_in_work.py").write_text(f"\nraise {raised}")
    monkeypatch.syspath_prepend(tmp_path)
    assert installed() == TRANSLATIONS
    place = f"{tmp_path / 'gauges_in_work.py'}, line 2"
    assert f"the translations of gauges are left out: {told} ({place})" in caplog.text
