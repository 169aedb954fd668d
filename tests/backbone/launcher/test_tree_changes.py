"""What an operator's change makes of the mission file and of each behavior."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from backbone.errors import Refusal
from backbone.launcher.messages import (
    AddBranch,
    MoveBranch,
    RemoveBranch,
    ReplaceBranch,
    SetInTree,
    TreeInvalid,
    UnknownBehavior,
)
from backbone.launcher.tree_changes import consequences, orders
from backbone.launcher.tree_texts import changed
from backbone.mission.edit import EditRefused
from backbone.mission.model import MissionDescription
from backbone.mission.reader import MissionInvalid, read_mission_bytes

MISSION = b"""<mission name="m" priority="10">
  <behaviors>
    <!-- The day. -->
    <behavior type="sequence" name="day" priority="3">
      <behavior type="wait" name="morning" priority="1">  <!-- short -->
        <parameter name="seconds" value="1"/>
      </behavior>
      <behavior type="parallel" name="noon" priority="2">
        <behavior type="surveillance" name="left" priority="1"/>
        <behavior type="surveillance" name="right" priority="1"/>
      </behavior>
    </behavior>
    <behavior type="surveillance" name="spare" priority="1"/>
  </behaviors>
</mission>
"""
NEW = """<?xml version="1.0"?>
<!-- Said before. -->
<behavior type="surveillance" name="new" priority="4">

  <!-- Inside. -->
</behavior>
"""


def read(text: bytes) -> MissionDescription:
    return read_mission_bytes(text, "m.xml", {})


def shape(text: bytes) -> list[Any]:
    """Return the names of the tree, children in lists behind their parents."""

    def of(behaviors: Any) -> list[Any]:
        return [part for one in behaviors for part in ((one.name, of(one.children)) if one.children else (one.name,))]

    return of(read(text).behaviors)


def test_a_branch_is_added_where_it_is_wanted_as_it_is_written() -> None:
    for place, expected in (
        (0, ["left", "right", "new"]),
        (1, ["new", "left", "right"]),
        (3, ["left", "right", "new"]),
    ):
        after = changed(MISSION, AddBranch(0, "noon", NEW, "new.xml", place)).text
        assert shape(after) == ["day", ["morning", "noon", expected], "spare"]
        assert (
            b'\n        <behavior type="surveillance" name="new" priority="4">\n\n          <!-- Inside. -->\n' in after
        )
        assert re.sub(rb" *<behavior[^>]*new\"(.|\n)*?</behavior>\n", b"", after, count=1) == MISSION


def test_a_branch_becomes_a_root_also_of_a_mission_without_behaviors() -> None:
    assert shape(changed(MISSION, AddBranch(0, "m", NEW, "new.xml")).text)[-2:] == ["spare", "new"]
    bare = b'<mission name="m" priority="10"/>'
    assert shape(changed(bare, AddBranch(0, "m", NEW, "new.xml")).text) == ["new"]


def test_a_branch_is_removed_with_all_in_it() -> None:
    assert shape(changed(MISSION, RemoveBranch(0, "noon")).text) == ["day", ["morning"], "spare"]
    alone = changed(changed(MISSION, RemoveBranch(0, "day")).text, RemoveBranch(0, "spare")).text
    assert shape(alone) == []


def test_a_branch_is_moved_with_its_comments() -> None:
    after = changed(MISSION, MoveBranch(0, "spare", "day", 2)).text
    assert shape(after) == ["day", ["morning", "spare", "noon", ["left", "right"]]]
    after = changed(MISSION, MoveBranch(0, "noon", "day", 1)).text
    assert shape(after) == ["day", ["noon", ["left", "right"], "morning"], "spare"]
    assert b"<!-- short -->" in after
    assert shape(changed(MISSION, MoveBranch(0, "noon", "m")).text) == [
        "day",
        ["morning"],
        "spare",
        "noon",
        ["left", "right"],
    ]
    with pytest.raises(EditRefused):
        changed(MISSION, MoveBranch(0, "day", "noon"))


def test_a_branch_is_replaced_at_its_place() -> None:
    after = changed(MISSION, ReplaceBranch(0, "morning", NEW, "new.xml"))
    assert shape(after.text) == ["day", ["new", "noon", ["left", "right"]], "spare"]
    assert after.anew == {"new"}


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (SetInTree(0, "spare", "priority", -7), b'<behavior type="surveillance" name="spare" priority="-7"/>'),
        (SetInTree(0, "morning", "seconds", 2.5), b'<parameter name="seconds" value="2.5"/>'),
        (SetInTree(0, "noon", "success_count", 1), b'<parameter name="success_count" value="1"/>'),
    ],
)
def test_a_value_is_written_where_it_belongs(change: SetInTree, line: bytes) -> None:
    after = changed(MISSION, change).text
    read(after)
    assert line in after
    assert line not in MISSION


@pytest.mark.parametrize(
    ("change", "refusal", "says"),
    [
        (RemoveBranch(0, "noom"), UnknownBehavior, "did you mean 'noon'"),
        (MoveBranch(0, "noon", "nobody"), UnknownBehavior, "nobody"),
        (AddBranch(0, "nobody", NEW, "new.xml"), UnknownBehavior, "nobody"),
        (AddBranch(0, "noon", "<resource/>", "new.xml"), TreeInvalid, "new.xml:1:1"),
        (AddBranch(0, "noon", "<behavior", "new.xml"), TreeInvalid, "new.xml:1:"),
        (AddBranch(0, "noon", NEW, "new.xml", 4), TreeInvalid, "place 4 is beyond the end: noon has 2 other behaviors"),
        (AddBranch(0, "m", NEW, "new.xml", 77), TreeInvalid, "Write a place from 1 to 3"),
        (MoveBranch(0, "spare", "m", 3), TreeInvalid, "place 3 is beyond the end: the mission has 1 other behavior ("),
        (SetInTree(0, "spare", "minimum_runtime_s", 5), TreeInvalid, "claims no ARC"),
        (SetInTree(0, "morning", "seconds", [1]), TreeInvalid, "seconds"),
    ],
    ids=str,
)
def test_a_change_that_cannot_be_written_is_refused(change: Any, refusal: type[Refusal], says: str) -> None:
    with pytest.raises(refusal, match=re.escape(says)):
        changed(MISSION, change)


@pytest.mark.parametrize("name", ["spare", "left"])
def test_a_branch_that_is_replaced_by_an_equal_one_starts_again(name: str) -> None:
    edited = changed(MISSION, ReplaceBranch(0, name, node(name), "equal.xml"))
    running = Running(read(MISSION))
    before = running.numbers[name]
    running.follow(consequences(read(MISSION), read(edited.text), edited.anew))
    assert running.numbers[name] != before


def test_a_fault_in_a_branch_is_named_where_its_own_file_has_it() -> None:
    branch = """<!-- a -->
  <behavior type="sequence" name="new" priority="4">
    <behavior type="wiat" name="x" priority="1"/>
  </behavior>"""
    after = changed(MISSION, AddBranch(0, "day", branch, "new.xml", 2))
    with pytest.raises(MissionInvalid) as invalid:
        read(after.text)
    assert str(after.invalid(invalid.value.faults)).startswith("new.xml:3:15: ")
    emptied = changed(MISSION, RemoveBranch(0, "left"))
    emptied = changed(emptied.text, RemoveBranch(0, "right"))
    with pytest.raises(MissionInvalid) as invalid:
        read(emptied.text)
    assert str(emptied.invalid(invalid.value.faults)).startswith("m.xml:8:7: ")


class Running:
    """The processes of a mission in which everything runs: each new one gets a number."""

    def __init__(self, mission: MissionDescription) -> None:
        self.known = {name: dict(order.parameters) for name, order in orders(mission).items()}
        self.numbers = {name: number for number, name in enumerate(self.known)}

    def follow(self, follows: Any) -> None:
        for told in sorted(follows.told, key=lambda told: not told.gone):
            name, before = told.order.name, self.known[told.order.name]
            children = {child["name"]: child for child in told.order.parameters["children"]}
            for child in before["children"]:
                if child["name"] not in children or child["name"] in told.anew:
                    self.end(child["name"])
            self.known[name] = dict(told.order.parameters)
        for name in follows.ended:
            self.end(name)
        for order in follows.begun:
            self.begin(order.name, order.parameters)
        for told in follows.told:
            self.begin_children(told.order.parameters)

    def begin(self, name: str, parameters: dict[str, Any]) -> None:
        assert name not in self.known, f"{name} runs twice"
        self.known[name], self.numbers[name] = dict(parameters), max(self.numbers.values(), default=0) + 1
        self.begin_children(parameters)

    def begin_children(self, parameters: dict[str, Any]) -> None:
        for child in parameters["children"]:
            if child["name"] not in self.known:
                path = [*parameters["path"], [child["name"], child["priority"]]]
                own = {"path": path, "arc": child["arc"], "children": child["children"]}
                self.begin(child["name"], {**child["parameters"], **own})

    def end(self, name: str) -> None:
        for child in self.known.pop(name)["children"]:
            if child["name"] in self.known:
                self.end(child["name"])


def node(name: str, kind: str = "surveillance", inside: str = "") -> str:
    return f'<behavior type="{kind}" name="{name}" priority="1">{inside}</behavior>'


NAMES = [f"n{number}" for number in range(7)]
_changes = st.one_of(
    st.builds(
        lambda name, inside, parent, place: AddBranch(0, parent, node(name, inside=node(inside)), "b.xml", place),
        st.sampled_from(NAMES), st.sampled_from(NAMES), st.sampled_from(["m", *NAMES]), st.integers(0, 3),
    ),
    st.builds(lambda name: RemoveBranch(0, name), st.sampled_from(NAMES)),
    st.builds(
        lambda name, parent, place: MoveBranch(0, name, parent, place),
        st.sampled_from(NAMES), st.sampled_from(["m", *NAMES]), st.integers(0, 3),
    ),
    st.builds(
        lambda name, new: ReplaceBranch(0, name, node(new), "b.xml"), st.sampled_from(NAMES), st.sampled_from(NAMES)
    ),
    st.builds(lambda name, value: SetInTree(0, name, "priority", value), st.sampled_from(NAMES), st.integers(-3, 3)),
)  # fmt: skip


@given(st.lists(_changes, min_size=1, max_size=8))
def test_after_any_changes_all_runs_as_if_it_had_come_up_so_and_what_stays_was_not_touched(changes: list[Any]) -> None:
    tree = node("n0", inside=node("n1") + node("n2", inside=node("n3"))) + node("n4")
    text = f'<mission name="m" priority="10"><behaviors>{tree}</behaviors></mission>'.encode()
    mission = read(text)
    running, done = Running(mission), 0
    for change in changes:
        try:
            edited = changed(text, change)
            new = read(edited.text)
        except (Refusal, MissionInvalid):
            continue
        follows, before = consequences(mission, new, edited.anew), dict(running.numbers)
        running.follow(follows)
        done += 1
        assert running.known == {name: order.parameters for name, order in orders(new).items()}
        if not isinstance(change, ReplaceBranch | MoveBranch):
            stay = orders(mission).keys() & orders(new).keys()
            assert {name: running.numbers[name] for name in stay} == {name: before[name] for name in stay}
        for name in edited.anew & before.keys():
            assert running.numbers[name] != before[name], f"{name} was replaced, and goes on as before"
        mission, text = new, edited.text
    assume(done)
