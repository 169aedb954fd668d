"""Writes episodes as a data set for LeRobot.

Source: LeRobotDataset v3.0 as lerobot 0.6.1 reads it (docs/source/lerobot-dataset-v3.mdx; ``DatasetInfo``, the paths
and ``load_tasks`` in src/lerobot/datasets, ``DEFAULT_FEATURES`` in src/lerobot/utils/constants.py):

* ``meta/info.json``: version, numbers, rate, paths, and the type and shape of each column.
* ``meta/stats.json``: statistics of each column.
* ``meta/tasks.parquet``: number of each task; pandas uses the text as index.
* ``meta/episodes/chunk-000/file-000.parquet``: length, place, tasks and statistics of each episode.
* ``data/chunk-000/file-000.parquet``: a row for each step. A vector of one number is stored as a number. Pictures have
LeRobot's type ``image`` (PNG files in the rows), because OpenCV cannot write the codecs that LeRobot expects for its
type ``video``.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TypedDict

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import parquet

from backbone.errors import Refusal
from backbone.recording.reader import Recording
from backbone.spoken import counted
from mission_control.training_data.episodes import ACTION, EpisodeStep, Follower, Survey, keys_of, survey
from mission_control.training_data.statistics import LEVELS, Statistics, of_levels, of_numbers
from mission_control.vision.picture_files import png_of
from resource_pool.arc_client import Frame

VERSION = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
CHUNK = 1000  # files in a folder, as LeRobot's DEFAULT_CHUNK_SIZE
FILE_MB, VIDEO_MB = 100, 200  # as LeRobot's DEFAULT_DATA_FILE_SIZE_IN_MB and DEFAULT_VIDEO_FILE_SIZE_IN_MB
ROWS_AT_ONCE = 256  # chosen: some 20 MB of pictures
STATE, IMAGES = "observation.state", "observation.images."
PICTURE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
COUNTERS = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
BY_HAND = "driven by hand"
"""Task of an episode that a person commanded."""
NOT_KNOWN = "not known"
"""Task of an episode whose commander the recording does not name."""


class NoEpisodes(Refusal):
    """The recording has no step of the robot."""

    code = "recording.episodes"
    remedy = "Name a robot that was held while it was recorded; --without-pictures needs no pictures of it."


class Feature(TypedDict):
    """Type and shape of a column in ``info.json``; ``info`` has more about pictures."""

    dtype: str
    shape: list[int]
    names: list[str] | None
    info: dict[str, bool]


@dataclass(frozen=True)
class Form:
    """The form of a data set.

    Attributes:
        found: The robot's data in the recording.
        cameras: Cameras whose pictures are written.
        rate_hz: Steps in a second.
        task: Text for all episodes; empty: the behavior's name, or ``BY_HAND``.
    """

    found: Survey
    cameras: tuple[str, ...]
    rate_hz: int
    task: str = ""

    def features(self) -> dict[str, Feature]:
        """Return column → type, shape and names of its numbers."""
        features: dict[str, Feature] = {}
        for camera in self.cameras:
            width, height = self.found.sizes_px[camera]
            features[IMAGES + camera] = {
                "dtype": "image",
                "shape": [height, width, 3],
                "names": ["height", "width", "channels"],
                "info": {"is_depth_map": False},
            }
        if self.found.reports:
            features[STATE] = _feature("float32", list(self.found.reports))
        features["action"] = _feature("float32", list(ACTION))
        features["commanded_by"], features["by_person"] = _feature("string"), _feature("bool")
        return features | {name: _feature(kind) for name, kind in COUNTERS.items()}

    def schema(self) -> pa.Schema:
        """Return the columns of the data's files."""
        return pa.schema([(name, _arrow(feature)) for name, feature in self.features().items()])

    def task_of(self, arc: str) -> str:
        """Return the text of an episode's task."""
        return self.task or (BY_HAND if self.found.is_of_a_person(arc) else self.found.commander(arc)) or NOT_KNOWN


class DataSetWriter:
    """Writes episodes, step by step, into a folder; after ``finish`` the folder is a data set.

    Attributes:
        rows: Number of steps.
        episodes: A row for each episode.
    """

    def __init__(self, folder: Path, form: Form) -> None:
        self.rows = 0
        self.episodes: list[dict[str, object]] = []
        self._folder, self._form, self._schema = folder, form, form.schema()
        self._tasks: dict[str, int] = {}
        self._waiting: list[dict[str, object]] = []
        self._file: parquet.ParquetWriter | None = None
        self._number = 0
        self._all, self._of_episode = _Seen(), _Seen()

    def add(self, step: EpisodeStep) -> None:
        """Add a step, in the order of episodes and steps."""
        if step.episode == len(self.episodes):
            self._end_episode()
            self._begin_episode(step)
        row = self._row(step)
        self._waiting.append(row)
        self._of_episode.add(row, step)
        self.rows += 1
        if len(self._waiting) >= ROWS_AT_ONCE:
            self._write_rows()

    def finish(self) -> None:
        """Write the metadata that makes the folder a data set; at least one step must have been added."""
        self._end_episode()
        self.close()
        self._write(EPISODES.format(chunk_index=0, file_index=0), pa.Table.from_pylist(self.episodes))
        self._write("meta/tasks.parquet", _tasks_table(self._tasks))
        for name, content in (("info", self._info()), ("stats", self._all.statistics())):
            (self._folder / f"meta/{name}.json").write_text(json.dumps(content, indent=4))

    def close(self) -> None:
        """Complete the present data file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _row(self, step: EpisodeStep) -> dict[str, object]:
        found = self._form.found
        pictures = {
            IMAGES + name: {"bytes": png_of(_levels(frame), found.sizes_px[name]), "path": None}
            for name, frame in step.pictures.items()
        }
        return {
            **pictures,
            STATE: step.state[0] if len(step.state) == 1 else step.state,
            "action": step.action,
            "commanded_by": found.commander(step.arc),
            "by_person": found.is_of_a_person(step.arc),
            "timestamp": step.number / self._form.rate_hz,
            "frame_index": step.number,
            "episode_index": step.episode,
            "index": self.rows,
            "task_index": self._tasks[self._form.task_of(step.arc)],
        }

    def _begin_episode(self, step: EpisodeStep) -> None:
        task = self._form.task_of(step.arc)
        self._tasks.setdefault(task, len(self._tasks))
        place = {"chunk_index": self._number // CHUNK, "file_index": self._number % CHUNK}
        self.episodes.append(
            {
                "episode_index": step.episode,
                "tasks": [task],
                "length": 0,
                **{f"data/{name}": value for name, value in place.items()},
                "dataset_from_index": self.rows,
                "dataset_to_index": self.rows,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
            }
        )

    def _end_episode(self) -> None:
        if not self.episodes:
            return
        self._write_rows()
        last = self.episodes[-1]
        last["length"], last["dataset_to_index"] = self._of_episode.rows, self.rows
        for column, statistics in self._of_episode.statistics().items():
            last.update((f"stats/{column}/{name}", value) for name, value in statistics.items())
        self._all.join(self._of_episode)
        self._of_episode = _Seen()
        if self._path().stat().st_size >= FILE_MB * 1024**2:
            self.close()
            self._number += 1

    def _path(self) -> Path:
        return self._folder / DATA.format(chunk_index=self._number // CHUNK, file_index=self._number % CHUNK)

    def _write_rows(self) -> None:
        if not self._waiting:
            return
        if self._file is None:
            self._path().parent.mkdir(parents=True, exist_ok=True)
            self._file = parquet.ParquetWriter(self._path(), self._schema)
        self._file.write_table(pa.Table.from_pylist(self._waiting, self._schema))
        self._waiting.clear()

    def _write(self, name: str, table: pa.Table) -> None:
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(table, path)

    def _info(self) -> dict[str, object]:
        return {
            "codebase_version": VERSION,
            "robot_type": self._form.found.kind or None,
            "total_episodes": len(self.episodes),
            "total_frames": self.rows,
            "total_tasks": len(self._tasks),
            "chunks_size": CHUNK,
            "data_files_size_in_mb": FILE_MB,
            "video_files_size_in_mb": VIDEO_MB,
            "fps": self._form.rate_hz,
            "splits": {"train": f"0:{len(self.episodes)}"},
            "data_path": DATA,
            "video_path": None,
            "features": self._form.features(),
        }


@dataclass
class _Seen:
    """Data for the statistics: the numbers of all rows, and a histogram of grey levels for each camera."""

    numbers: dict[str, list[NDArray[np.float64]]] = field(default_factory=lambda: defaultdict(list))
    levels: dict[str, NDArray[np.int64]] = field(default_factory=lambda: defaultdict(lambda: np.zeros(LEVELS, int)))
    rows: int = 0

    def add(self, row: dict[str, object], step: EpisodeStep) -> None:
        self.rows += 1
        for column, value in row.items():
            if column != "commanded_by" and not column.startswith(IMAGES) and value != ():
                self.numbers[column].append(np.atleast_2d(np.asarray(value, np.float64)))
        for camera, frame in step.pictures.items():
            self.levels[IMAGES + camera] += np.bincount(_levels(frame).ravel(), minlength=LEVELS)

    def join(self, other: _Seen) -> None:
        self.rows += other.rows
        for column, values in other.numbers.items():
            self.numbers[column].append(np.concatenate(values))
        for column, levels in other.levels.items():
            self.levels[column] += levels

    def statistics(self) -> dict[str, Statistics]:
        pictures = {column: of_levels(levels, self.rows) for column, levels in self.levels.items()}
        return pictures | {column: of_numbers(np.concatenate(values)) for column, values in self.numbers.items()}


def _levels(frame: Frame) -> NDArray[np.uint8]:
    return np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)


def _feature(kind: str, names: list[str] | None = None) -> Feature:
    return {"dtype": kind, "shape": [len(names or " ")], "names": names, "info": {}}


def _arrow(feature: Feature) -> pa.DataType:
    if feature["dtype"] == "image":
        return PICTURE
    kind = pa.type_for_alias(feature["dtype"])
    return kind if feature["shape"] == [1] else pa.list_(kind, feature["shape"][0])


def _tasks_table(tasks: dict[str, int]) -> pa.Table:
    """Return the table that pandas reads with the tasks' texts as its index."""
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    columns = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
        for name, (kind, numpy) in kinds.items()
    ]
    about = {"index_columns": ["task"], "column_indexes": [], "columns": columns, "pandas_version": "2.0.0"}
    table = pa.table({"task_index": pa.array(tasks.values(), pa.int64()), "task": pa.array(tasks, pa.string())})
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


@dataclass(frozen=True)
class DataSet:
    """A data set that can be written.

    Attributes:
        follower: Counts grants and episodes during writing.
    """

    form: Form
    follower: Follower
    steps: Iterator[EpisodeStep]

    def write(self, folder: Path) -> str:
        """Write the data set into a folder; return a summary for people."""
        writer = DataSetWriter(folder, self.form)
        try:
            for step in self.steps:
                writer.add(step)
            writer.finish()
        finally:
            writer.close()
        said = f"{counted(len(writer.episodes), 'episode')} with {counted(writer.rows, 'step')}"
        left_out = self.follower.grants - self.follower.episodes
        if left_out:
            said = f"{said}; {counted(left_out, 'grant')} without pictures of each camera left out"
        unread = self.form.found.unread
        return f"{said}; incomplete: {counted(unread, 'message')} of another form cannot be read" if unread else said


def data_set(recording: Recording, robot: str, rate_hz: int, task: str, *, with_pictures: bool) -> DataSet:
    """Return the data set of a robot's grants.

    Raises:
        NoEpisodes: The recording has no step of the robot.
        NoRecording: The recording is damaged.
    """
    found = survey(recording.messages(keys_of(robot)), robot)
    form = Form(found, tuple(sorted(found.sizes_px)) if with_pictures else (), rate_hz, task)
    follower = Follower(robot, found.reports, form.cameras, rate_hz)
    steps = follower.follow(recording.messages(keys_of(robot)))
    first = next(steps, None)
    if first is None:
        robots = ", ".join(sorted(found.robots)) or "none"
        raise NoEpisodes(f"no step of {robot} in {counted(follower.grants, 'grant')}; the robots: {robots}")
    return DataSet(form, follower, chain([first], steps))
