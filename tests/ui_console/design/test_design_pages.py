"""What pages of the designer ask for and are shown: laws of changes, drops before and behind, questions, views."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from design_tutorial import FACTS, WATCH, element, tutorial_draft
from examples import share
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backbone.errors import Refusal
from backbone.mission.edit import outline
from ui_console.design.changes import MustAsk, changed, sections, sibling_file, touched_by
from ui_console.design.commands import DesignRefused, TextState
from ui_console.design.draft import Draft
from ui_console.design.effects import remove
from ui_console.design.offers import offer_at, offers
from ui_console.design.protocol import Change, MoveElement, Redo, RemoveElement, SetProperty, TakeOffer, Undo
from ui_console.design.views import element_view, palette, places, problems_view, rehearsal_view, tree_view

ROOT = Path(__file__).parents[3]
TUTORIAL = tutorial_draft()
START = st.sampled_from(
    [Draft.opened(str(ROOT / "mission.xml")), Draft("guard.xml", TUTORIAL.step), Draft.new("new.xml")]
)
VALUES = st.sampled_from(["", "scout1", "5", "Not Legal", "<&\"'", "\x00", "ü"])


def changes(draft: Draft) -> st.SearchStrategy[Change]:
    paths = st.sampled_from([node.path for node in draft.mission]) | st.tuples(st.integers(0, 9), st.integers(0, 9))
    labels = st.sampled_from([row.label for row in palette(draft.mission, {})]) | VALUES
    names = st.sampled_from(["name", "priority", "x-m", "type", "no-such"])
    return st.one_of(
        st.builds(TakeOffer, st.just(1), paths, labels, st.lists(VALUES, max_size=5).map(tuple)),
        st.builds(SetProperty, st.just(1), paths, names, VALUES, st.booleans()),
        st.builds(MoveElement, st.just(1), paths, paths, st.none() | st.integers(0, 9)),
        st.builds(RemoveElement, st.just(1), paths),
        st.builds(Undo, st.just(1)),
        st.builds(Redo, st.just(1)),
    )


def done(draft: Draft, change: Change) -> Draft | Refusal:
    try:
        return changed(draft, change)
    except Refusal as refusal:
        return refusal


@settings(max_examples=share(30), suppress_health_check=list(HealthCheck))
@given(START, st.data())
def test_whatever_pages_ask_for_can_be_read_and_shown_and_taken_back(draft: Draft, data: st.DataObject) -> None:
    begun = draft.text
    for _ in range(data.draw(st.integers(1, 6))):
        change = data.draw(changes(draft))
        after = done(draft, change)
        if isinstance(after, Refusal):
            assert after.remedy
            continue
        assert after.mission.at(touched_by(change, draft, after)).tag != "parameter"
        told = sections(after, FACTS)
        assert {tuple(row["path"]) for row in msgspec.json.decode(told["problems"])} <= {n.path for n in after.mission}
        draft = after
    while draft.past:
        draft = draft.undo()
    assert draft.text == begun


@settings(max_examples=share(60))
@given(st.data())
def test_what_is_dropped_before_a_sibling_stands_directly_before_it(data: st.DataObject) -> None:
    draft = TUTORIAL
    section = data.draw(st.sampled_from([node for node in draft.mission if len(node.children) > 1]))
    count = len(section.children)
    moved, before = data.draw(st.integers(0, count - 1)), data.draw(st.none() | st.integers(0, count))
    change = MoveElement(1, section.children[moved].path, section.path, before)
    tags = [draft.text[child.span.begin : child.span.end] for child in section.children]
    expected = tags[:moved] + tags[moved + 1 :]
    at = count if before is None else before
    expected.insert(at - (moved < at), tags[moved])
    after = changed(draft, change)
    got = after.mission.at(section.path)
    assert [after.text[child.span.begin : child.span.end] for child in got.children] == expected


@settings(max_examples=share(40), suppress_health_check=list(HealthCheck))
@given(START, st.data())
def test_every_part_of_the_palette_goes_somewhere_or_asks_or_says_where_it_belongs(
    draft: Draft, data: st.DataObject
) -> None:
    node = data.draw(st.sampled_from(list(draft.mission)))
    row = data.draw(st.sampled_from(palette(draft.mission, {})))
    after = done(draft, TakeOffer(1, node.path, row.label))
    if isinstance(after, MustAsk):
        assert any(not one.proposed or len(one.choices) > 1 for one in after.offer.asks)
    elif isinstance(after, Refusal):
        assert after.remedy
    else:
        assert after is draft or after.mission.at(after.step.touched).tag == row.tag


def test_a_wish_let_go_of_on_a_behavior_goes_into_its_arc_and_asks_which() -> None:
    draft = tutorial_draft()
    watcher = element(draft, "behavior", "watch-scout1")
    without = draft.do(remove(next(node.path for node in watcher if node.tag == "wish")))
    with pytest.raises(MustAsk) as must:
        changed(without, TakeOffer(1, watcher.path, "wish scout"))
    assert must.value.offer.asks[0].choices == ("scout1", "scout2")
    assert changed(without, TakeOffer(1, watcher.path, "wish scout", ("scout1",))).text == draft.text


def test_what_belongs_elsewhere_is_refused_with_the_place_where_it_belongs() -> None:
    draft = tutorial_draft()
    with pytest.raises(DesignRefused, match="cannot be added to <host>") as refusal:
        changed(draft, TakeOffer(1, element(draft, "host", "base").path, "wish scout"))
    assert refusal.value.remedy == "It belongs in <arc>."


def test_an_offer_wants_one_answer_for_each_question() -> None:
    draft = tutorial_draft()
    offer = offer_at(draft.mission, (), "behavior patrol")
    assert not offer.must_ask
    with pytest.raises(DesignRefused, match="asks for 2 answers, not 1"):
        offer.command(["only-one"])


def test_empty_text_leaves_a_value_out_and_a_parameter_nobody_knows_can_be_set() -> None:
    draft = tutorial_draft()
    radio = element(draft, "resource", "radio")
    assert (
        b'driver="simulated"/>' not in changed(draft, SetProperty(1, radio.path, "driver", " ")).text.split(b"radio")[3]
    )
    watcher = element(draft, "behavior", "watch-scout1").path
    more = changed(draft, SetProperty(1, watcher, "view_s", "6", is_parameter=True))
    assert more.description is not None
    assert changed(more, SetProperty(1, watcher, "view_s", "", is_parameter=True)).text == draft.text


def test_a_problem_stands_at_its_element_also_when_it_is_about_a_parameter() -> None:
    text = tutorial_draft().text.replace(b'name="network_id" value="2"', b'name="network_id" value="1"')
    draft = Draft("guard.xml", TextState(text))
    assert [row.told for row in tree_view(draft) if row.problems] == ["scout2 scout"]
    (problem,) = problems_view(draft)
    assert draft.mission.at(problem.path).tag == "parameter"


def test_all_about_an_element_says_what_its_class_says() -> None:
    draft = tutorial_draft()
    view = element_view(draft, element(draft, "behavior", "watch-scout1").path, FACTS)
    assert view.type_doc == ("Looks for motion.",)
    assert {one.name for one in view.properties if one.is_parameter} == {"view_s"}
    told = {one.label: one.doc for one in view.offers}
    assert told["behavior watch_for_motion"] == "Looks for motion."
    assert told["behavior patrol"] == "mission_control.behaviors.patrol:Patrol"
    row = next(row for row in palette(draft.mission, FACTS) if row.label == "behavior watch_for_motion")
    assert row.is_known
    assert f"watch_for_motion: behavior, {WATCH}" in row.doc


def test_the_palette_has_the_world_until_there_is_one_and_every_tag_has_its_places() -> None:
    assert "world" in {row.label for row in palette(Draft.new("a.xml").mission, {})}
    assert "world" not in {row.label for row in palette(tutorial_draft().mission, {})}
    assert {row.tag for row in palette(Draft.new("a.xml").mission, {})} <= {
        tag for inside in places().values() for tag in inside
    }


def test_parts_of_the_palette_are_offered_where_the_page_says_they_may_stand() -> None:
    draft = tutorial_draft()
    for node in draft.mission:
        labels = {offer.label for offer in offers(draft.mission, node.path)}
        for row in palette(draft.mission, {}):
            if row.tag in places()[node.tag] and row.tag in ("behavior", "resource", "furniture", "target"):
                assert row.label in labels


def test_the_first_minute_has_a_row_for_each_arc_and_resource_and_turns_that_do_not_overlap() -> None:
    dry = tutorial_draft().rehearsal
    assert dry is not None
    view = rehearsal_view(dry)
    assert [row.name for row in view.rows if row.is_arc] == ["watch-scout1-capture", "watch-scout2-capture"]
    video = next(row for row in view.rows if row.name == "video1")
    assert all(turn.from_s <= turn.open_s <= turn.to_s for turn in video.turns)
    assert all(one.to_s <= other.from_s for one, other in zip(video.turns, video.turns[1:], strict=False))
    assert len(view.told) == 2
    assert view.never == ()


@pytest.mark.parametrize("name", ["../a.xml", "a/b.xml", ".a.xml", "a.txt", "a.xml\n", "/etc/a.xml"])
def test_only_mission_files_of_the_same_folder_are_written(name: str) -> None:
    with pytest.raises(DesignRefused, match="no name of a mission file"):
        sibling_file("missions/guard.xml", name)


def test_another_name_stands_in_the_same_folder() -> None:
    assert sibling_file("missions/guard.xml", "night.xml") == Path("missions/night.xml")
    assert sibling_file("missions/guard.xml", "") == Path("missions/guard.xml")


def test_what_the_file_holds_now_can_be_had_and_taken_back() -> None:
    draft = tutorial_draft()
    theirs = draft.text.replace(b'priority="10"', b'priority="12"')
    after = draft.taken_from(theirs)
    assert (after.text, after.saved, after.is_changed) == (theirs, theirs, False)
    assert after.undo().text == draft.text
    assert after.undo().is_changed
    assert outline(after.text).text("priority") == "12"
