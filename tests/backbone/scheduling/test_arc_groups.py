from __future__ import annotations

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from backbone.scheduling.groups import Group, Groups

uses = st.dictionaries(st.text("abcdefgh", min_size=1, max_size=1), st.sets(st.integers(1, 8).map(str), max_size=3))


def groups(asked):
    """Return the groups of these ARCs, which came in this order."""
    kept: Groups[str] = Groups(exact_up_to=len(asked))
    for arc, rcs in asked.items():
        kept.add(arc, rcs)
    return [[*group.arcs] for group in groups_in(kept)]


def groups_in(kept: Groups[str]) -> list[Group[str]]:
    return [*dict.fromkeys(kept.of.values())]


@settings(max_examples=share(100))
@given(uses)
def test_every_arc_is_in_one_group(asked):
    assert sorted(arc for group in groups(asked) for arc in group) == sorted(asked)


@settings(max_examples=share(100))
@given(uses)
def test_arcs_of_two_groups_share_no_rc(asked):
    found = groups(asked)
    for number, group in enumerate(found):
        mine = {rc for arc in group for rc in asked[arc]}
        others = {rc for other in found[number + 1 :] for arc in other for rc in asked[arc]}
        assert mine.isdisjoint(others)


@settings(max_examples=share(100))
@given(uses)
def test_a_group_cannot_be_cut_in_two(asked):
    for group in groups(asked):
        reached = {group[0]}
        for _ in group:
            reached |= {a for a in group if any(asked[a] & asked[b] for b in reached)}
        assert reached == set(group)


@settings(max_examples=share(100))
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


@settings(max_examples=share(100))
@given(st.lists(st.tuples(st.sampled_from("abcdefgh"), st.sets(st.integers(1, 8).map(str), max_size=3)), max_size=40))
def test_groups_that_are_kept_up_to_date_are_the_groups_of_those_that_are_there(steps):
    """Each step lets an ARC come with its RCs, or go if it is there."""
    kept: Groups[str] = Groups(exact_up_to=8)
    lazy: Groups[str] = Groups(exact_up_to=0)
    there: dict[str, set[str]] = {}
    for arc, rcs in steps:
        if arc in there:
            del there[arc]
            kept.remove(arc)
            lazy.remove(arc)
        else:
            there[arc] = rcs
            kept.add(arc, rcs)
            lazy.add(arc, rcs)
        wanted = {frozenset(group) for group in groups(there)}
        assert {frozenset(group.arcs) for group in groups_in(kept)} == wanted
        assert all(any(group <= set(big.arcs) for big in groups_in(lazy)) for group in wanted)
        assert sorted(arc for big in groups_in(lazy) for arc in big.arcs) == sorted(there)
        for rc in map(str, range(1, 9)):
            assert set(kept.users.get(rc, {})) == {arc for arc, wants in there.items() if rc in wants}
