"""The data set has the files, columns and types of LeRobotDataset v3.0.

LeRobot itself needs PyTorch and a newer Python, so its form is written down here, by its documents and its reader.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pytest
from driven_robot import (
    ARCS,
    HEIGHT_PX,
    WIDTH_PX,
    connected,
    disconnected,
    halted,
    known,
    moved,
    reported,
    seen,
)
from pyarrow import parquet
from small_recordings import recorded

from backbone.recording.reader import Recording
from mission_control.training_data import lerobot_dataset
from mission_control.training_data.lerobot_dataset import BY_HAND, NoEpisodes, data_set

RATE_HZ = 10
WATCH, DRIVE = ARCS
INFO = {
    "codebase_version": str,
    "robot_type": str,
    "total_episodes": int,
    "total_frames": int,
    "total_tasks": int,
    "chunks_size": int,
    "data_files_size_in_mb": int,
    "video_files_size_in_mb": int,
    "fps": int,
    "splits": dict,
    "data_path": str,
    "video_path": type(None),  # no column is a video
    "features": dict,
}
"""Fields of ``DatasetInfo``."""
COUNTERS = {
    "timestamp": "float",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
EPISODE = {
    "episode_index",
    "tasks",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
}
STATISTICS = {"min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99"}


def a_night() -> bytes:
    """Return a recording: a watcher sees, then a person drives and sees, then a person drives without a picture."""
    return recorded(
        [
            *known(0.1),
            reported(0.5, way_m=0.0, touches=False),
            *connected(1.0, WATCH, 7),
            *(seen(1.0 + number / 10, WATCH, 100 + number) for number in range(1, 6)),
            *disconnected(1.6, WATCH, 7),
            *connected(2.0, DRIVE, 8),
            seen(2.1, DRIVE, 50),
            moved(2.25, 8, 0.25, -0.5),
            reported(2.35, way_m=0.5, touches=True),
            seen(2.4, DRIVE, 60, (2 * WIDTH_PX, 2 * HEIGHT_PX)),
            halted(2.55, 8),
            *disconnected(3.0, DRIVE, 8),
            *connected(4.0, DRIVE, 9),
            *disconnected(4.5, DRIVE, 9),
        ]
    ).getvalue()


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("night") / "night.mcap"
    path.write_bytes(a_night())
    return path


def written(night: Path, folder: Path, task: str = "", *, with_pictures: bool = True) -> str:
    with night.open("rb") as file:
        return data_set(Recording(file), "scout1", RATE_HZ, task, with_pictures=with_pictures).write(folder)


def info_of(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "meta" / "info.json").read_text())
    return found


def rows_of(folder: Path, kind: str) -> list[dict[str, Any]]:
    return [row for path in sorted((folder / kind).glob("*/*.parquet")) for row in parquet.read_table(path).to_pylist()]


def arrow_of(feature: dict[str, Any]) -> pa.DataType:
    """Return the type by which LeRobot reads a column of this feature."""
    if feature["dtype"] == "image":
        return pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    kind = pa.type_for_alias(feature["dtype"])
    [length] = feature["shape"]
    return kind if length == 1 else pa.list_(kind, length)


def plain(kind: pa.DataType) -> str:
    """Return the type as text; Parquet has another name for the items of lists."""
    return str(kind).replace("element", "item")


def test_it_says_what_it_has(night: Path, tmp_path: Path) -> None:
    said = written(night, tmp_path)
    assert said == "2 episodes with 14 steps; 1 grant without pictures of each camera left out"
    info = info_of(tmp_path)
    assert {name: type(value) for name, value in info.items()} == INFO
    assert (info["codebase_version"], info["fps"], info["splits"]) == ("v3.0", RATE_HZ, {"train": "0:2"})
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 14, 2)
    features = info["features"]
    assert features["observation.images.camera"]["shape"] == [HEIGHT_PX, WIDTH_PX, 3]
    assert features["observation.state"]["names"] == ["way_m", "touches"]
    assert features["action"]["names"] == ["forward_m_s", "turn_rad_s"]
    path = tmp_path / info["data_path"].format(chunk_index=0, file_index=0)
    schema = parquet.read_schema(path)
    assert schema.names == list(features)
    assert {name: plain(schema.field(name).type) for name in schema.names} == {
        name: plain(arrow_of(feature)) for name, feature in features.items()
    }
    assert {name: str(schema.field(name).type) for name in COUNTERS} == COUNTERS


def test_rows_have_regular_times_and_who_commanded(night: Path, tmp_path: Path) -> None:
    written(night, tmp_path)
    rows = rows_of(tmp_path, "data")
    assert [row["index"] for row in rows] == list(range(14))
    assert [(row["episode_index"], row["frame_index"]) for row in rows] == [
        *((0, number) for number in range(5)),
        *((1, number) for number in range(9)),
    ]
    assert [row["timestamp"] for row in rows] == pytest.approx([row["frame_index"] / RATE_HZ for row in rows])
    assert {(row["episode_index"], row["commanded_by"], row["by_person"]) for row in rows} == {
        (0, "watch", False),
        (1, "anna", True),
    }
    assert [row["action"] for row in rows[5:]] == [[0.0, 0.0]] * 2 + [[0.25, -0.5]] * 3 + [[0.0, 0.0]] * 4
    assert [row["observation.state"] for row in rows[6:9]] == [[0.0, 0.0], [0.0, 0.0], [0.5, 1.0]]
    pictures = [
        cv2.imdecode(np.frombuffer(row["observation.images.camera"]["bytes"], np.uint8), cv2.IMREAD_UNCHANGED)
        for row in rows
    ]
    assert {picture.shape for picture in pictures} == {(HEIGHT_PX, WIDTH_PX, 3)}
    assert [int(picture.max()) for picture in pictures] == [101, 102, 103, 104, 105, *[50] * 3, *[60] * 6]


def test_episodes_tasks_and_statistics_are_told(night: Path, tmp_path: Path) -> None:
    written(night, tmp_path)
    first, second = rows_of(tmp_path, "meta/episodes")
    assert {name for name in first if not name.startswith("stats/")} == EPISODE
    assert [(row["dataset_from_index"], row["dataset_to_index"], row["length"]) for row in (first, second)] == [
        (0, 5, 5),
        (5, 14, 9),
    ]
    assert (first["tasks"], second["tasks"]) == (["watch"], [BY_HAND])
    tasks = parquet.read_table(tmp_path / "meta" / "tasks.parquet")
    assert tasks.to_pydict() == {"task_index": [0, 1], "task": ["watch", BY_HAND]}
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    statistics = json.loads((tmp_path / "meta" / "stats.json").read_text())
    assert statistics.keys() == info_of(tmp_path)["features"].keys() - {"commanded_by"}
    assert {frozenset(values) for values in statistics.values()} == {frozenset(STATISTICS)}
    assert np.shape(statistics["observation.images.camera"]["mean"]) == (3, 1, 1)
    assert statistics["action"]["max"] == [0.25, 0.0]
    assert (first["stats/action/max"], second["stats/action/min"]) == ([0.0, 0.0], [0.0, -0.5])
    assert (statistics["action"]["count"], first["stats/action/count"]) == ([14], [5])


def test_without_pictures_no_grant_is_left_out(night: Path, tmp_path: Path) -> None:
    assert written(night, tmp_path, "look around", with_pictures=False) == "3 episodes with 21 steps"
    assert "observation.images.camera" not in info_of(tmp_path)["features"]
    assert {tuple(row["tasks"]) for row in rows_of(tmp_path, "meta/episodes")} == {("look around",)}


def test_a_large_file_is_followed_by_the_next(night: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lerobot_dataset, "FILE_MB", 0)
    monkeypatch.setattr(lerobot_dataset, "CHUNK", 1)
    written(night, tmp_path)
    assert sorted(str(path.relative_to(tmp_path)) for path in (tmp_path / "data").glob("*/*")) == [
        "data/chunk-000/file-000.parquet",
        "data/chunk-001/file-000.parquet",
    ]
    assert [row["data/chunk_index"] for row in rows_of(tmp_path, "meta/episodes")] == [0, 1]
    assert [row["index"] for row in rows_of(tmp_path, "data")] == list(range(14))


def test_a_robot_without_a_step_is_refused(night: Path) -> None:
    with night.open("rb") as file, pytest.raises(NoEpisodes, match="no step of scout2 in 0 grants; the robots: scout1"):
        data_set(Recording(file), "scout2", RATE_HZ, "", with_pictures=True)


def scout_backbone(*words: str, begin: str = "") -> subprocess.CompletedProcess[str]:
    code = f"import sys\n{begin}\nfrom backbone.command_line.cli import app; app({list(words)!r})"
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)


@pytest.mark.processes
def test_the_command_writes_a_new_folder_and_tells_what_it_lacks(night: Path, tmp_path: Path) -> None:
    folder = tmp_path / "set"
    words = ("recording", "lerobot", str(night), str(folder), "--robot")
    lacking = scout_backbone(*words, "scout1", begin="sys.modules['pyarrow'] = None")
    assert (lacking.returncode, "scout-backbone[parquet]" in lacking.stderr) == (2, True), lacking.stderr
    unknown = scout_backbone(*words, "scout2")
    assert (unknown.returncode, "recording.episodes" in unknown.stderr) == (5, True), unknown.stderr
    assert not folder.exists()
    done = scout_backbone(*words, "scout1")
    assert (done.returncode, "2 episodes with 14 steps" in done.stderr) == (0, True), done.stderr
    assert info_of(folder)["total_frames"] == 14
