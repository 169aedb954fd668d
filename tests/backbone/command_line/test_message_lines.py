"""Messages as lines and plain data; rates of keys."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.command_line.key_facts import KeyFacts, with_facts
from backbone.command_line.message_lines import (
    LONGEST_BODY,
    TrafficTable,
    field_of,
    message_json,
    message_line,
    traffic_lines,
)
from backbone.recording.reader import Recorded


def message(body: object) -> Recorded:
    return Recorded("scout/night/x/y/log", "x/y", "Note/1", 12.3456, 12.3, 12.4, 7, "z#3", body)


@pytest.mark.parametrize("body", [{"text": "a" * 500}, {"text": "short"}, b"\xc1\x00", ["Newcomer/1", 5]])
def test_a_line_has_time_key_and_schema_and_a_bounded_body(body: object) -> None:
    line = message_line(message(body))
    assert line.startswith("    12.346 s  x/y/log  Note/1  ")
    assert len(line.split("  Note/1  ", 1)[1]) <= LONGEST_BODY
    assert json.loads(json.dumps(message_json(message(body))))["cause"] == "z#3"


@pytest.mark.parametrize(
    ("path", "value"),
    [("a", {"b": [1, {"c": None}]}), ("a.b.0", 1), ("a.b.1.c", None), ("a.b.2", None), ("a.b.x", None), ("", None)],
)
def test_a_field_is_found_by_names_and_numbers(path: str, value: object) -> None:
    assert field_of({"a": {"b": [1, {"c": None}]}}, path) == value


sizes = st.integers(1, 10_000)


@given(st.lists(st.tuples(st.sampled_from(["a", "b", "c"]), sizes)), st.floats(0.1, 100.0))
def test_all_traffic_is_counted_once_and_the_busiest_key_is_first(
    heard: list[tuple[str, int]], lasted_s: float
) -> None:
    table = TrafficTable()
    for name, size in heard:
        table.add(f"scout/night/x/{name}/log", f"x/{name}", "Note/1", size)
    rows = table.busiest(lasted_s)
    assert sum(one["bytes_per_s"] for one in rows) * lasted_s == pytest.approx(sum(size for _name, size in heard))
    assert sum(one["messages_per_s"] for one in rows) * lasted_s == pytest.approx(len(heard))
    assert rows == sorted(rows, key=lambda one: -one["bytes_per_s"])
    shown = with_facts(rows, KeyFacts(), "night")
    assert len(traffic_lines(shown)) == len({name for name, _size in heard})
