"""Tables as Parquet files: a column keeps the type of its values, a list is a list."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import pyarrow as pa
from pyarrow import parquet

_NO_KIND = (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError)
"""What Arrow raises if values have no type in common."""


class ParquetTables:
    """Parquet files in a folder, one for each table; each ``write`` makes a row group.

    Each file is open only while rows are written, because there may be hundreds.

    A column whose values have no type in common, such as numbers and texts, holds them as JSON texts.
    """

    splits_lists: ClassVar[bool] = False

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._kinds: dict[str, dict[str, pa.DataType | None]] = {}
        self._writers: dict[str, parquet.ParquetWriter] = {}

    def learn(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Find the types of the columns; all rows must pass here before the first is written."""
        kinds = self._kinds.setdefault(table, {})
        for column in dict.fromkeys(column for row in rows for column in row):
            kinds[column] = _common_kind(kinds.get(column, pa.null()), [row.get(column) for row in rows])

    def write(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Append the rows as a row group."""
        kinds = self._kinds[table]
        arrays = [_array([row.get(column) for row in rows], kind) for column, kind in kinds.items()]
        batch = pa.Table.from_arrays(arrays, names=list(kinds))
        if table not in self._writers:
            file = _FileToAppend(self._folder / f"{table}.parquet")
            self._writers[table] = parquet.ParquetWriter(file, batch.schema)
        self._writers[table].write_table(batch)

    def close(self) -> None:
        """Write the ends of the files; without them no file is readable."""
        for writer in self._writers.values():
            writer.close()


class _FileToAppend(io.RawIOBase):
    """A file that is open only while it is written."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        with self._path.open("ab") as file:
            return file.write(data)


def _common_kind(known: pa.DataType | None, values: list[object]) -> pa.DataType | None:
    """Return the common type of these values and the earlier ones; None: they have none."""
    if known is None:
        return None
    try:
        found = pa.array(values).type  # infer_type takes texts among numbers for numbers
        schemas = [pa.schema([("column", kind)]) for kind in (known, found)]
        kind = pa.unify_schemas(schemas, promote_options="permissive").field(0).type
    except _NO_KIND:
        return None
    return None if _has_empty_struct(kind) else kind


def _has_empty_struct(kind: pa.DataType) -> bool:
    """Return whether the type contains an empty struct, which Parquet cannot hold."""
    if pa.types.is_list(kind):
        return _has_empty_struct(kind.value_type)
    if not pa.types.is_struct(kind):
        return False
    return kind.num_fields == 0 or any(_has_empty_struct(field.type) for field in kind)


def _array(values: list[object], kind: pa.DataType | None) -> pa.Array:
    if kind is None:
        return pa.array([None if value is None else json.dumps(value) for value in values], pa.string())
    try:
        return pa.array(values, kind)
    except pa.ArrowInvalid:  # among floats, an integer too large for 64 bits is rounded
        return pa.array(values).cast(kind, safe=False)
