"""Rows of tables have all fields, and who commanded the robot."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from backbone.recording.reader import Recorded
from backbone.recording.tables import LONGEST_NAME, Commanders, FileNames, row_of

FRAMES = "scout/night/resource_pool/anna-drive/frames"
leaves = st.none() | st.booleans() | st.integers(-9, 9) | st.floats(-9, 9) | st.text(max_size=3)
bodies = st.dictionaries(
    st.sampled_from(["at_s", "x", "y"]),
    st.recursive(leaves, lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from("ab"), inner)),
    max_size=3,
)


def said(schema: str, body: Any, key: str = FRAMES) -> Recorded:
    return Recorded(key, "resource_pool/grabber", schema, 1.0, 1.0, 1.0, 7, "", body)


def leaves_of(value: Any) -> list[Any]:
    if isinstance(value, dict | list):
        inner = value.values() if isinstance(value, dict) else value
        return [leaf for one in inner for leaf in leaves_of(one)]
    return [value]


@given(body=bodies)
def test_a_row_has_each_value_once(body: dict[str, Any]):
    row = row_of(said("Readings/1", body))
    of_message = [value for column, value in row.items() if column not in row_of(said("Readings/1", {}))]
    assert sorted(map(repr, of_message)) == sorted(map(repr, leaves_of(body)))


def test_pictures_are_no_columns():
    assert "pixels" not in row_of(said("Frame/1", {"number": 1, "pixels": "aGFsbG8="}))


def test_a_person_is_named_by_name_a_behavior_by_its_own_and_nobody_is_empty():
    commanders = Commanders()
    of_anna, of_watch, of_none = (said("Frame/1", {"arc": arc}) for arc in ("anna-drive", "watch-capture", "gone"))
    assert commanders.of(of_anna) == ""
    requests = [
        {"arc": "anna-drive", "owner": "ui_console/console-1"},
        {"arc": "watch-capture", "owner": "mission_control/watch"},
    ]
    commanders.take(said("Schedule/1", {"requests": requests}))
    commanders.take(said("ComponentState/2", {"address": "ui_console/console-1", "user": "anna"}))
    assert [commanders.of(one) for one in (of_anna, of_watch, of_none)] == ["anna", "watch", ""]


def test_a_message_without_an_arc_is_of_the_arc_of_its_epoch():
    commanders = Commanders()
    asked, motions = "scout/night/resource_pool/scout1/ask", "scout/night/resource_pool/scout1/motions"
    commanders.take(said("Schedule/1", {"requests": [{"arc": "watch-capture", "owner": "mission_control/watch"}]}))
    commanders.take(said("Connect/1", {"arc": "watch-capture", "epoch": 7}, asked))
    applied = [said("Applied/1", {"rc": rc, "epoch": epoch}, motions) for rc, epoch in (("scout1", 7), ("scout1", 6))]
    assert [commanders.of(one) for one in applied] == ["watch", ""]


def test_an_arc_that_was_connected_before_the_recording_is_known_by_the_schedule():
    commanders = Commanders()
    holders = [{"arc": "watch-capture", "epoch": 7}]
    requests = [{"arc": "watch-capture", "owner": "mission_control/watch"}]
    commanders.take(said("Schedule/1", {"rcs": [{"rc": "scout1", "holders": holders}], "requests": requests}))
    assert commanders.of(said("Applied/1", {"rc": "scout1", "epoch": 7})) == "watch"


def test_what_is_told_later_is_known_from_the_first_message_on():
    applied = said("Applied/1", {"rc": "scout1", "epoch": 7})
    told = [
        applied,
        said("Connect/1", {"arc": "anna-drive", "epoch": 7}, "scout/night/resource_pool/scout1/ask"),
        said("Schedule/1", {"requests": [{"arc": "anna-drive", "owner": "ui_console/console-1"}]}),
        said("ComponentState/2", {"address": "ui_console/console-1", "user": "anna"}),
        said("Schedule/1", {"requests": [{"arc": "anna-drive", "owner": "mission_control/later"}]}),
    ]
    assert Commanders(reversed(told)).of(applied) == "anna"


@given(body=st.dictionaries(st.sampled_from(["arc", "rc", "epoch"]), leaves | st.lists(leaves) | st.just({"x": 1})))
def test_in_a_modules_own_message_these_words_may_mean_anything(body: dict[str, Any]):
    assert Commanders().of(said("Path/1", body)) == ""


@given(
    name=st.sampled_from(["Schedule/1", "Connect/1", "ComponentState/2"]),
    body=st.dictionaries(
        st.sampled_from(["arc", "epoch", "requests", "rcs", "address", "user"]),
        st.recursive(
            leaves,
            lambda inner: (
                st.lists(inner, max_size=2)
                | st.dictionaries(st.sampled_from(["arc", "rc", "owner", "holders", "epoch"]), inner)
            ),
        ),
    ),
)
def test_a_foreign_message_of_a_known_name_may_have_any_form(name: str, body: dict[str, Any]):
    Commanders().take(said(name, body))


segments = st.text(st.characters(exclude_characters="/"), min_size=1, max_size=9) | st.sampled_from(["a", "a_b", "A"])


@given(named=st.lists(st.tuples(st.lists(segments, max_size=4).map(tuple), segments), unique=True))
def test_each_key_and_schema_has_a_file_of_its_own_whatever_characters_they_have(
    named: list[tuple[tuple[str, ...], str]],
):
    names = FileNames()
    asked = [("/".join(["scout", "night", *key]), schema) for key, schema in named]
    found = [names.of(*one) for one in asked]
    assert len({name.lower() for name in found}) == len(set(asked))
    assert [names.of(*one) for one in asked] == found
    assert all(name.isascii() and name.isprintable() and "/" not in name for name in found)


def test_versions_of_a_schema_share_a_file_and_a_long_name_is_cut():
    names = FileNames()
    assert names.of(FRAMES, "Frame/1") == names.of(FRAMES, "Frame/2") == "resource_pool_anna-drive_frames_Frame"
    assert len(names.of(FRAMES, "x" * 999)) == LONGEST_NAME
