from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from backbone.rc_manager.groups import groups

uses = st.dictionaries(st.text("abcdefgh", min_size=1, max_size=1), st.sets(st.integers(1, 8).map(str), max_size=3))


@given(uses)
def test_every_arc_is_in_one_group(asked):
    assert sorted(arc for group in groups(asked) for arc in group) == sorted(asked)


@given(uses)
def test_arcs_of_two_groups_share_no_rc(asked):
    found = groups(asked)
    for number, group in enumerate(found):
        mine = {rc for arc in group for rc in asked[arc]}
        others = {rc for other in found[number + 1 :] for arc in other for rc in asked[arc]}
        assert mine.isdisjoint(others)


@given(uses)
def test_a_group_cannot_be_cut_in_two(asked):
    for group in groups(asked):
        reached = {group[0]}
        for _ in group:
            reached |= {a for a in group if any(asked[a] & asked[b] for b in reached)}
        assert reached == set(group)


@given(uses, st.randoms(use_true_random=False))
def test_order_of_arrival_does_not_matter(asked, rng):
    shuffled = [*asked.items()]
    rng.shuffle(shuffled)
    assert {frozenset(group) for group in groups(dict(shuffled))} == {frozenset(group) for group in groups(asked)}


def test_three_scouts_on_one_video_frequency_are_one_group():
    """IROS 2001, figure 2: two behaviors and a console share one frequency."""
    assert groups({"left": {"v", "s1"}, "right": {"v", "s2"}, "console": {"v", "s3"}, "arm": {"w"}}) == [
        ["left", "right", "console"],
        ["arm"],
    ]
