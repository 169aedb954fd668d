"""A draft: commands, refusals, the way back, and that the text is always what the model says."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest
from examples import share
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shipped_drafts import EVERYTHING_DECLARED, ROOT, SHIPPED

from backbone.errors import Refusal
from backbone.mission.behavior_orders import TREE_PARAMETERS
from backbone.mission.class_facts import ClassFacts, ParameterFacts, shipped_classes
from backbone.mission.edit import Element, NewElement, outline
from backbone.mission.reader import MissionInvalid, read_mission
from ui_console.design.catalogue import Role, entries, stock
from ui_console.design.commands import DesignCommand, DesignRefused, ElementNameTaken, NothingToUndo, TextState
from ui_console.design.draft import Draft
from ui_console.design.effects import (
    add,
    add_behavior,
    add_resource,
    add_type,
    add_world,
    claim_arc,
    relocate,
    remove,
    rename,
    set_value,
    write_parameter,
)
from ui_console.design.file import save
from ui_console.design.offers import free_name, offers
from ui_console.design.properties import Property, properties
from ui_console.design.views import problems_view, tree_view

COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)


def designed(*commands: DesignCommand, draft: Draft | None = None) -> Draft:
    draft = draft or Draft.new("guard.xml")
    for command in commands:
        draft = draft.do(command)
    return draft


def only(draft: Draft, tag: str, name: str) -> Element:
    (found,) = [node for node in draft.mission if node.tag == tag and node.text("name") == name]
    return found


def watchers() -> Draft:
    draft = designed(
        add_world("9", "6"),
        add_resource("command_radio", "radio"),
        add_resource("video_frequency", "video1"),
        add_resource("framegrabber", "grabber"),
        add_resource("scout", "scout1"),
        add_resource("scout", "scout2"),
        add_behavior((), "surveillance", "surveillance", 5),
    )
    for robot in ("scout1", "scout2"):
        parent = only(draft, "behavior", "surveillance").path
        draft = draft.do(add_behavior(parent, "watch_for_motion", f"watch-{robot}"))
        draft = draft.do(claim_arc(draft.step.touched, "capture", "5"))
        draft = draft.do(add(draft.step.touched, NewElement("wish", {"type": "scout", "name": robot})))
    return draft


NAMES = st.sampled_from(["scout1", "scout9", "radio", "world", "watch-scout1", "base", "Not Legal", ""])
START = st.sampled_from([*(Draft.opened(str(file)) for file in SHIPPED), Draft.new("new.xml")])


def commands(draft: Draft) -> st.SearchStrategy[DesignCommand]:
    paths = st.sampled_from([node.path for node in draft.mission])
    kinds = st.sampled_from([entry.name for entry in entries(draft.mission)])
    return st.one_of(
        st.builds(remove, paths),
        st.builds(rename, paths, NAMES),
        st.builds(relocate, paths, paths, st.integers(0, 5)),
        st.builds(set_value, paths, st.sampled_from(["name", "priority", "host", "x-m"]), NAMES | st.none()),
        st.builds(write_parameter, paths, NAMES, NAMES | st.none()),
        st.builds(add_behavior, paths, kinds, NAMES, st.integers(-3, 3)),
        st.builds(add_resource, kinds, NAMES),
        st.builds(add_type, kinds),
        st.builds(add_world, st.just("9"), st.sampled_from(["6", "x"])),
        st.builds(claim_arc, paths, kinds, st.sampled_from(["5", "none"])),
        st.builds(add, paths, st.builds(NewElement, st.sampled_from(["wish", "uses", "behavior", "furniture"]))),
    )


@settings(max_examples=share(30), suppress_health_check=list(HealthCheck))
@given(START, st.data())
def test_any_sequence_of_commands_can_be_read_loses_no_comment_and_is_undone_to_the_byte(
    draft: Draft, data: st.DataObject
) -> None:
    first, states = draft, [draft]
    for _ in range(data.draw(st.integers(1, 6))):
        command = data.draw(commands(draft))
        after = done(draft, command)
        if after is draft:
            continue
        taken = re.findall(COMMENT, removed_by(draft, command))
        assert len(re.findall(COMMENT, after.text)) == len(re.findall(COMMENT, draft.text)) - len(taken)
        assert outline(after.text).at(after.step.touched)
        draft = after
        states.append(draft)
    for state in reversed(states[:-1]):
        draft = draft.undo()
        assert draft.text == state.text
    for state in states[1:]:
        draft = draft.redo()
        assert draft.text == state.text
    assert first.saved == states[-1].saved


def done(draft: Draft, command: DesignCommand) -> Draft:
    try:
        return draft.do(command)
    except Refusal:
        return draft


def removed_by(draft: Draft, command: DesignCommand) -> bytes:
    if command.effect is not remove(()).effect:
        return b""
    node = draft.mission.at(command.arguments[0])
    return draft.text[node.span.begin : node.span.end]


@settings(max_examples=share(25), suppress_health_check=list(HealthCheck))
@given(START, st.data())
def test_every_offer_can_be_taken_or_says_why_not_and_touches_what_it_added(draft: Draft, data: st.DataObject) -> None:
    node = data.draw(st.sampled_from(list(draft.mission)))
    offer = data.draw(st.sampled_from(offers(draft.mission, node.path)))
    given = [data.draw(st.sampled_from([asked.proposed, *asked.choices, "x", "1"])) for asked in offer.asks]
    try:
        after = draft.do(offer.build(given))
    except Refusal:
        return
    if after is draft:
        return  # the behavior has just this ARC already
    assert after.mission.at(after.step.touched).tag in (*offer.label.split(), "behavior", "resource")


def test_the_problems_are_those_of_check(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    draft = Draft.opened(str(SHIPPED[0]))
    draft = designed(
        remove(only(draft, "resource", "video1").path), rename(only(draft, "host", "base").path, "b"), draft=draft
    )
    draft = save(Draft(str(file), draft.step), file)
    with pytest.raises(MissionInvalid) as invalid:
        read_mission(file)
    assert draft.problems == invalid.value.faults
    assert draft.description is None
    assert draft.rehearsal is None
    assert {draft.mission.at(draft.element_of(fault)).tag for fault in draft.problems} <= {"resource", "uses", "arc"}


def test_what_the_text_means_is_what_the_reader_reads(tmp_path: Path) -> None:
    draft = save(watchers(), tmp_path / "guard.xml")
    assert draft.description is not None
    assert msgspec.structs.replace(draft.description, source=draft.source) == read_mission(draft.source)


def test_a_problem_is_about_the_element_it_stands_in() -> None:
    """With any text before it in its line, and with a byte order mark."""
    for mark in (b"", b"\xef\xbb\xbf"):
        text = mark + SHIPPED[0].read_bytes().replace(b'x-m="7.20"', 'x-m="ü"'.encode())
        draft = Draft("mission.xml", TextState(text))
        (fault,) = draft.problems
        assert draft.mission.at(draft.element_of(fault)).text("name") == "scout2"
        assert text.splitlines()[fault.line - 1].decode()[fault.column - 1 :].startswith("x-m=")


def test_a_new_mission_is_fine_and_named_as_its_file() -> None:
    assert Draft.new("night-watch.xml").mission.text("name") == "night-watch"
    assert Draft.new("Ünlawful name.xml").mission.text("name") == "mission"
    assert Draft.new("a.xml").problems == ()
    assert Draft.new("a.xml").is_changed


def test_two_watchers_are_built_from_nothing_and_take_turns() -> None:
    draft = watchers()
    assert draft.problems == ()
    assert draft.rehearsal is not None
    assert draft.rehearsal.can_come_up
    turns = {claimed.behavior: claimed.turns for claimed in draft.rehearsal.claimed}
    assert set(turns) == {"watch-scout1", "watch-scout2"}
    assert min(turns.values()) >= 5
    assert max(turns.values()) - min(turns.values()) <= 1


def test_a_last_branch_is_offered_once_gets_one_root_and_is_told_with_its_time() -> None:
    draft = watchers()
    roots = next(node for node in draft.mission if node.tag == "behaviors")
    [offer] = [one for one in offers(draft.mission, roots.path) if one.label == "last"]
    draft = draft.do(offer.command([]))
    assert [row.message for row in problems_view(draft)] == ["<last> lacks <behavior>"]
    last = draft.step.touched
    [patrol] = [one for one in offers(draft.mission, last) if one.label == "behavior patrol"]
    draft = designed(
        patrol.command(["drive-home", "1"]),
        set_value(last, "within-s", "30"),
        write_parameter((*last, 0), "waypoints", "1,1"),
        write_parameter((*last, 0), "localizer", "world"),
        claim_arc((*last, 0), "drive", "5"),
        draft=draft,
    )
    assert problems_view(draft) == []
    [row] = [row for row in tree_view(draft) if row.tag == "last"]
    assert row.told == "within 30 s"
    assert draft.description is not None
    assert draft.description.last is not None
    assert draft.description.last.behavior.name == "drive-home"
    roots = next(node for node in draft.mission if node.tag == "behaviors")
    assert "last" not in [one.label for one in offers(draft.mission, roots.path)]
    with pytest.raises(Refusal, match="has its <behavior> already"):
        draft.do(add_behavior(last, "wait", "rest"))


def test_the_shipped_types_are_those_that_an_old_file_declares() -> None:
    written = {
        one.text("name"): (one.values, [needed.values for needed in one.all("needs")])
        for file in [EVERYTHING_DECLARED]
        for one in Draft.opened(str(file)).mission.first("types").all("type")  # type: ignore[union-attr]
    }
    listed = {
        one.text("name"): (one.values, [needed.values for needed in one.all("needs")])
        for one in stock().first("types").all("type")  # type: ignore[union-attr]
    }
    assert written == {name: listed[name] for name in written}
    modules = {path.stem for path in (ROOT / "mission_control" / "behaviors").glob("*.py")}
    assert {entry.name for entry in entries(stock()) if entry.role is Role.BEHAVIOR} <= modules


def test_every_behavior_of_the_project_is_at_hand() -> None:
    table = (ROOT / "docs" / "reference" / "behaviors.md").read_text().partition("\n## ")[0]
    names = set(re.findall(r"^\| `(\w+)` \| (?:`|–)", table, re.MULTILINE))
    assert names == {entry.name for entry in entries(Draft.new("a.xml").mission) if entry.role is Role.BEHAVIOR}


def test_a_robot_gets_what_it_is_tied_to_the_next_network_id_and_a_body() -> None:
    draft = watchers().do(add_resource("scout", "scout3"))
    robot = draft.mission.at(draft.step.touched)
    assert [(one.text("type"), one.text("name")) for one in robot.all("uses")] == [
        ("command_radio", "radio"),
        ("video_frequency", "video1"),
    ]
    assert [one.text("value") for one in robot.all("parameter")] == ["3"]
    assert only(draft, "robot", "scout3").values["x-m"] == "3"
    assert draft.problems == ()
    assert draft.do(remove(robot.path)).text != draft.text
    assert draft.do(remove(robot.path)).problems == ()


def test_a_body_that_was_removed_stays_away() -> None:
    draft = watchers()
    draft = draft.do(remove(only(draft, "robot", "scout1").path)).do(add_resource("scout", "scout3"))
    world = draft.mission.first("world")
    assert world is not None
    assert [body.text("name") for body in world.all("robot")] == ["scout2", "scout3"]


def test_to_rename_a_robot_renames_what_speaks_of_it() -> None:
    draft = watchers()
    draft = draft.do(rename(only(draft, "resource", "scout1").path, "spy"))
    assert draft.problems == ()
    assert b"scout1" not in draft.text.replace(b"watch-scout1", b"")
    draft = draft.do(rename(only(draft, "robot", "spy").path, "scout1"))
    assert draft.text == watchers().text


@pytest.mark.parametrize(
    ("tag", "old"), [("host", "base"), ("type", "scout"), ("type", "capture"), ("world", "world"), ("type", "placer")]
)
def test_to_rename_anything_keeps_the_mission_fine(tag: str, old: str) -> None:
    draft = Draft.opened(str(EVERYTHING_DECLARED))
    after = draft.do(rename(only(draft, tag, old).path, "renamed"))
    assert [fault for fault in after.problems if "core service" not in fault.message and tag != "type"] == []
    assert after.do(rename(only(after, tag, "renamed").path, old)).text == draft.text


def test_a_claim_replaces_the_one_before_and_declares_no_shipped_type() -> None:
    draft = designed(add_behavior((), "patrol", "guard"))
    draft = draft.do(claim_arc(draft.step.touched, "drive", "5"))
    assert draft.mission.first("types") is None
    draft = draft.do(claim_arc(draft.step.touched[:-1], "capture", "7"))
    (arc,) = [node for node in draft.mission if node.tag == "arc"]
    assert (arc.text("kind"), arc.text("minimum-runtime-s")) == ("capture", "7")


def test_a_parameter_is_set_changed_and_left_out() -> None:
    draft = watchers()
    path = only(draft, "behavior", "watch-scout1").path
    more = draft.do(write_parameter(path, "view_s", "6"))
    assert more.description is not None
    assert more.description.behaviors[0].children[0].parameters == {"view_s": 6}
    again = more.do(write_parameter(path, "view_s", "7")).do(write_parameter(path, "view_s", None))
    assert again.text == draft.text
    assert draft.do(write_parameter(path, "view_s", None)) is draft


def test_what_cannot_be_meant_is_refused_and_changes_nothing() -> None:
    draft = watchers()
    refused: list[tuple[DesignCommand, type[Refusal]]] = [
        (add_resource("scout", "scout1"), ElementNameTaken),
        (add_behavior((), "patrol", "world"), ElementNameTaken),
        (rename(only(draft, "host", "base").path, "Base Station"), Refusal),
        (add_resource("submarine", "nautilus"), DesignRefused),
        (add_behavior((), "no_such", "x"), DesignRefused),
        (claim_arc(only(draft, "host", "base").path, "drive", "5"), DesignRefused),
        (add_world("1", "1"), Refusal),
        (remove(()), Refusal),
    ]
    for command, kind in refused:
        with pytest.raises(kind) as refusal:
            draft.do(command)
        assert refusal.value.remedy
    with pytest.raises(NothingToUndo):
        draft.redo()
    with pytest.raises(NothingToUndo):
        Draft.new("a.xml").undo()


def test_the_last_network_id_is_the_last_robot() -> None:
    draft = watchers()
    robot = only(draft, "resource", "scout1")
    section = draft.text[robot.span.begin : robot.span.end].decode()
    many = "\n".join(section.replace("scout1", f"s{number}").replace('"1"', f'"{number}"') for number in range(3, 255))
    text = draft.text.replace(b"  </resources>", many.encode() + b"</resources>")
    full = Draft("many.xml", TextState(text))
    with pytest.raises(DesignRefused, match="254 network ids"):
        full.do(add_resource("scout", "one-more"))


def test_names_are_proposed_that_nobody_has() -> None:
    mission = watchers().mission
    assert [free_name(mission, name) for name in ("scout1", "radio", "eye")] == ["scout3", "radio2", "eye"]


def test_properties_know_meaning_default_and_what_may_be_chosen() -> None:
    draft = watchers()
    wish = next(node for node in draft.mission if node.tag == "wish")
    of_wish = {one.name: one for one in properties(draft.mission, wish, {})}
    assert of_wish["name"].choices == ("scout1", "scout2")
    assert of_wish["type"].choices == ("scout", "command_radio", "video_frequency", "framegrabber")
    radio = {one.name: one for one in properties(draft.mission, only(draft, "resource", "radio"), {})}
    assert (radio["connect-s"].value, radio["connect-s"].default) == (None, "0")
    assert radio["sharable"].choices == ("true", "false")
    assert radio["host"].choices == ("base",)


def test_properties_of_a_resource_are_those_of_its_driver_too() -> None:
    draft = watchers()

    def of_grabber(draft: Draft) -> dict[str, Property]:
        grabber = only(draft, "resource", "grabber")
        return {one.name: one for one in properties(draft.mission, grabber, shipped_classes())}

    assert of_grabber(draft)["driver"].doc.endswith("Built in: simulated, video_device, recorded.")
    assert of_grabber(draft)["capture_delay_s"].doc.startswith("Time from a frame to its delivery")
    played = draft.do(set_value(only(draft, "resource", "grabber").path, "driver", "recorded"))
    assert "capture_delay_s" not in of_grabber(played)
    assert of_grabber(played)["file"].is_missing
    assert of_grabber(played)["loop"].choices == ("true", "false")


def test_parameters_of_shipped_classes_are_judged_and_of_others_once_they_were_looked_up() -> None:
    draft = watchers()
    wrong = draft.do(write_parameter(only(draft, "behavior", "watch-scout1").path, "veiw_s", "6"))
    assert [fault.message for fault in wrong.problems] == [
        "watch_for_motion has no parameter 'veiw_s' (did you mean 'view_s'?)"
    ]
    own = {"name": "own", "class": "backbone.naming:Subsystem", "subsystem": "mission_control"}
    draft = draft.do(add((), NewElement("types", {}, [NewElement("type", own)])))
    draft = draft.do(add_behavior((), "own", "mine")).do(write_parameter((4, 1), "depth_m", "deep"))
    assert draft.problems == ()
    depth = ParameterFacts("depth_m", {"type": "number", "default": 1.0})
    known = draft.knowing({"backbone.naming:Subsystem": ClassFacts(parameters=(depth,), given=TREE_PARAMETERS)})
    assert [fault.message for fault in known.problems] == ["depth_m='deep' is illegal"]
    assert known.undo().redo().problems == known.problems
