"""Two recordings are the same, or the first message and field that differ are named."""

from __future__ import annotations

import copy
import math
import tracemalloc
from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.recording.comparison import ABSENT, compared, pairs_in
from backbone.recording.reader import KeyCount, Recorded

KEYS = ("resource_pool/scout1/readings", "resource_pool/scout2/readings")
MANY = 20_000
numbers = st.floats(-1e6, 1e6)
values = st.recursive(
    st.none() | st.booleans() | st.integers(-1000, 1000) | numbers | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=6,
)
bodies = st.dictionaries(st.sampled_from(["x", "y", "z"]), values, min_size=1, max_size=3)
recordings = st.lists(st.tuples(st.sampled_from(KEYS), bodies), min_size=1, max_size=12)


def messages(said: list[tuple[str, dict[str, Any]]]) -> list[Recorded]:
    return [
        Recorded(f"scout/night/{key}", key.rpartition("/")[0], "Readings/1", float(n), float(n), float(n), n, "", body)
        for n, (key, body) in enumerate(said)
    ]


@given(said=recordings)
def test_a_recording_is_the_same_as_itself(said: list[tuple[str, dict[str, Any]]]):
    found = compared(messages(said), messages(copy.deepcopy(said)))
    assert all(one.is_same and not one.errors and one.difference is None for one in found.values())
    assert sum(one.first for one in found.values()) == len(said)


@given(said=recordings, data=st.data())
def test_the_first_message_that_differs_is_named(said: list[tuple[str, dict[str, Any]]], data: st.DataObject):
    changed = copy.deepcopy(said)
    at = data.draw(st.integers(0, len(said) - 1))
    key, body = changed[at]
    body["x"] = "planted"
    found = compared(messages(said), messages(changed))
    [named] = [name for name in found if name[0] == key]
    difference = found[named].difference
    assert difference is not None
    assert difference.number == sum(one == key for one, _body in said[:at])
    assert (difference.field.split(".")[0], difference.second) == ("x", "planted")
    assert difference.first_s == at
    assert [name for name, one in found.items() if not one.is_same] == [named]


@given(first=st.lists(numbers, min_size=1, max_size=20), data=st.data())
def test_errors_of_numbers_are_their_largest_and_mean_square_distance(first: list[float], data: st.DataObject):
    second = data.draw(st.lists(numbers, min_size=len(first), max_size=len(first)))
    found = compared(
        messages([(KEYS[0], {"x": one}) for one in first]), messages([(KEYS[0], {"x": one}) for one in second])
    )
    [comparison] = found.values()
    apart = [abs(one - other) for one, other in zip(first, second, strict=True) if one != other]
    error = comparison.errors.get("x")
    if not apart:
        assert error is None
        return
    assert error is not None
    assert error.largest == max(apart)
    assert error.rms == pytest.approx(math.sqrt(sum(one * one for one in apart) / len(apart)))
    within = compared(
        messages([(KEYS[0], {"x": one}) for one in first]),
        messages([(KEYS[0], {"x": one}) for one in second]),
        {"x": max(apart)},
    )
    assert all(one.is_same for one in within.values())


@pytest.mark.parametrize(
    ("first", "second", "field", "values"),
    [
        ({"x": [1.0, None]}, {"x": [1.0]}, "x.1", (None, ABSENT)),  # a scan that ends with NaN, and a shorter one
        ({"x": 1}, {"x": 1, "y": None}, "y", (ABSENT, None)),
        ({"x": True}, {"x": 1}, "x", (True, 1)),
    ],
)
def test_null_is_not_absent_and_true_is_not_one(
    first: dict[str, Any], second: dict[str, Any], field: str, values: tuple[object, object]
):
    [found] = compared(messages([(KEYS[0], first)]), messages([(KEYS[0], second)])).values()
    assert found.difference is not None
    assert (found.difference.field, found.difference.first, found.difference.second) == (field, *values)


def test_a_message_more_is_a_difference_in_number():
    said = [(KEYS[0], {"x": 1.0})] * 3
    [found] = compared(messages(said), messages(said[:2])).values()
    assert (found.first, found.second, found.differing, found.is_same) == (3, 2, 0, False)


def test_a_tolerance_may_name_the_whole_path():
    first = messages([(KEYS[0], {"at": {"x": 1.0}, "x": 1.0})])
    second = messages([(KEYS[0], {"at": {"x": 1.5}, "x": 1.5})])
    [found] = compared(first, second, {"at.x": 1.0}).values()
    assert found.difference is not None
    assert found.difference.field == "x"


@given(first=recordings, second=recordings)
def test_known_numbers_of_pairs_change_no_result(
    first: list[tuple[str, dict[str, Any]]], second: list[tuple[str, dict[str, Any]]]
):
    one, other = messages(first), messages(second)
    assert compared(one, other, None, pairs_in(counts(one), counts(other))) == compared(one, other)


def test_a_message_without_a_schema_is_compared_though_the_index_gives_it_one():
    """A message nested too deeply to be decoded is compared as bytes, and its channel has a schema."""
    one, other = ([replace(found, schema="") for found in messages([(KEYS[0], {"x": x})])] for x in (1.0, 2.0))
    indexed = counts(messages([(KEYS[0], {})]))
    [found] = compared(one, other, None, pairs_in(indexed, indexed)).values()
    assert found.differing == 1


def test_messages_without_a_partner_take_no_memory():
    body = {"x": 1.0}
    said = (Recorded(f"scout/night/{KEYS[0]}", "scout1", "Readings/1", n, n, n, n, "", body) for n in range(MANY))
    index = [KeyCount(f"scout/night/{KEYS[0]}", "scout1", "Readings/1", MANY)]
    tracemalloc.start()
    try:
        [found] = compared(said, [], None, pairs_in(index, [])).values()
        _now, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (found.first, found.second) == (MANY, 0)
    assert most_bytes < MANY


def counts(said: list[Recorded]) -> list[KeyCount]:
    """Return the index of a recording."""
    return [KeyCount(*named, number) for named, number in Counter((m.key, m.source, m.schema) for m in said).items()]
