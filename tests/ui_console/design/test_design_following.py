"""A cursor stays on the chosen element through any change of others."""

from __future__ import annotations

from collections import Counter

import pytest
from design_tutorial import element, tutorial_draft
from examples import share
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backbone.errors import Refusal
from backbone.mission.edit import Element
from ui_console.design.commands import DesignCommand
from ui_console.design.draft import Draft
from ui_console.design.effects import add_behavior, add_resource, add_type, relocate, remove, rename, set_value
from ui_console.design.following import follower

BUILT = Draft("guard.xml", tutorial_draft().step)
PATHS = st.sampled_from([node.path for node in BUILT.mission])
COMMANDS = st.one_of(
    st.builds(remove, PATHS),
    st.builds(relocate, PATHS, PATHS, st.integers(0, 5)),
    st.builds(set_value, PATHS, st.sampled_from(["name", "priority", "x-m"]), st.sampled_from(["spy", "7"])),
    st.builds(rename, PATHS, st.just("spy")),
    st.builds(add_behavior, PATHS, st.sampled_from(["patrol", "surveillance"]), st.just("other")),
    st.builds(add_resource, st.sampled_from(["scout", "framegrabber"]), st.just("other")),
    st.builds(add_type, st.sampled_from(["drive", "hide"])),
)


def head(draft: Draft, node: Element) -> bytes:
    return draft.text[node.span.begin : node.span.content]


@settings(max_examples=share(150), suppress_health_check=list(HealthCheck))
@given(COMMANDS)
def test_what_is_written_like_nothing_else_is_found_again_wherever_it_went(command: DesignCommand) -> None:
    try:
        after = BUILT.do(command)
    except Refusal:
        return
    lead = follower(BUILT, after)
    old, new = (Counter(head(draft, node) for node in draft.mission) for draft in (BUILT, after))
    for node in BUILT.mission:
        found = after.mission.at(lead(node.path))
        if old[head(BUILT, node)] == new[head(BUILT, node)] == 1:
            assert head(after, found) == head(BUILT, node)
    back = follower(after, BUILT)
    assert all(BUILT.mission.at(back(node.path)) for node in after.mission)


@pytest.mark.parametrize("tag", ["behavior", "resource"])
def test_a_cursor_behind_what_is_added_or_removed_stays_on_its_element(tag: str) -> None:
    name = {"behavior": "watch-scout2", "resource": "scout2"}[tag]
    chosen = element(BUILT, tag, name)
    before_it = {"behavior": "watch-scout1", "resource": "radio"}[tag]
    after = BUILT.do(remove(element(BUILT, tag, before_it).path))
    assert follower(BUILT, after)(chosen.path) == element(after, tag, name).path != chosen.path


def test_what_is_written_twice_is_told_apart_by_what_it_stands_in() -> None:
    arc = element(BUILT, "behavior", "watch-scout2").children[0]
    more = BUILT.do(add_behavior((), "patrol", "guard", 9))  # adds a type before, and a behavior behind
    found = more.mission.at(follower(BUILT, more)(arc.path))
    assert found.path[:-1] == element(more, "behavior", "watch-scout2").path


def test_a_renamed_element_is_the_same_one_and_a_removed_one_leads_to_what_held_it() -> None:
    scout = element(BUILT, "robot", "scout2")
    renamed = BUILT.do(rename(scout.path, "spy"))
    assert follower(BUILT, renamed)(scout.path) == element(renamed, "robot", "spy").path
    behavior = element(BUILT, "behavior", "watch-scout2")
    gone = BUILT.do(remove(behavior.path))
    assert follower(BUILT, gone)(behavior.children[0].path) == behavior.path[:-1]
