"""What is written to Parquet files is read back with its types."""

from __future__ import annotations

import itertools
import json
import os
import resource
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet

from backbone.recording.parquet_tables import ParquetTables

MORE_FILES = 10
LARGE = 2**63  # no integer of 64 bits
leaves = (
    st.none() | st.booleans() | st.integers(-(2**53), LARGE) | st.floats(allow_nan=False) | st.text("aä☃", max_size=3)
)
values = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("ab"), inner, max_size=2)
)
rows_of = st.lists(st.fixed_dictionaries({"at_s": st.just(1.5)}, optional={"x": values, "y.z": values}), max_size=6)


def written(folder: Path, batches: list[list[dict[str, Any]]]) -> parquet.ParquetFile:
    """Return the file of a table whose rows were written in these row groups."""
    with closing(ParquetTables(folder)) as tables:
        for rows in batches:
            tables.learn("it", rows)
        for rows in batches:
            tables.write("it", rows)
    return parquet.ParquetFile(folder / "it.parquet")


def without_nothing(value: Any) -> Any:
    """Return it without fields that are null, because a column has all fields of all its rows."""
    if isinstance(value, dict):
        return {name: without_nothing(inner) for name, inner in value.items() if inner is not None}
    return list(map(without_nothing, value)) if isinstance(value, list) else value


def spoken(value: Any, kind: pa.DataType) -> Any:
    """Return the value of a column; one of no common type holds JSON texts."""
    return json.loads(value) if value is not None and kind == pa.string() and value[:1] in '"[{-0123456789tf' else value


@given(first=rows_of, second=rows_of)
def test_all_values_are_read_back(first: list[dict[str, Any]], second: list[dict[str, Any]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        table = written(Path(folder), [first, second]).read()
    assert table.num_rows == len(first) + len(second)
    for column in table.column_names:
        given_values = [row.get(column) for row in first + second]
        read = table[column].to_pylist()
        if without_nothing(read) != without_nothing(given_values):
            assert [spoken(value, table.schema.field(column).type) for value in read] == given_values


@pytest.mark.parametrize(
    ("column", "kind"),
    [
        ([1, None, 2], pa.int64()),
        ([1, 2.5], pa.float64()),
        ([True, False], pa.bool_()),
        (["a", "b"], pa.string()),
        ([[], [1.5, 2.5]], pa.list_(pa.float64())),
        ([[{"rc": "radio"}], [{"epoch": 3}]], pa.list_(pa.struct([("rc", pa.string()), ("epoch", pa.int64())]))),
        ([1, "a"], pa.string()),
        ([LARGE, 1], pa.string()),
        ([[{}], [{}]], pa.string()),
    ],
)
def test_a_column_has_the_type_of_its_values(tmp_path: Path, column: list[Any], kind: pa.DataType) -> None:
    found = written(tmp_path, [[{"it": value}] for value in column])
    read = found.schema_arrow.field("it").type
    assert str(read).replace("element", "item") == str(kind).replace("element", "item")
    assert found.num_row_groups == len(column)


@contextmanager
def few_files() -> Iterator[None]:
    """Let this process open only a few more files while the block runs."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    is_open = set(map(int, os.listdir("/proc/self/fd")))
    free = (number for number in itertools.count() if number not in is_open)
    resource.setrlimit(resource.RLIMIT_NOFILE, (next(itertools.islice(free, MORE_FILES, None)), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_there_may_be_more_tables_than_files_that_a_process_may_open(tmp_path: Path) -> None:
    names, rows = [f"table{number}" for number in range(5 * MORE_FILES)], [{"x": 1}, {"x": 2}]
    with few_files(), closing(ParquetTables(tmp_path)) as tables:
        for name in names:
            tables.learn(name, rows)
        for row in rows:
            for name in names:
                tables.write(name, [row])
    assert all(parquet.read_table(tmp_path / f"{name}.parquet").to_pylist() == rows for name in names)
