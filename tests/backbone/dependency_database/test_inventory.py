"""Laws of the inventory, then IROS 2001's hardware."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.dependency_database.inventory import MOST_SETS, Inventory
from backbone.dependency_database.messages import FindRcs, NoSuchHardware, Resource

KINDS = ["scout", "radio", "frequency", "grabber"]
FEATURES = ["camera", "pan", "jump"]


@st.composite
def hardware(draw: st.DrawFn) -> list[Resource]:
    counts = {kind: draw(st.integers(0, 3)) for kind in KINDS}
    names = {kind: [f"{kind}{n}" for n in range(1, count + 1)] for kind, count in counts.items()}
    return [
        Resource(
            name,
            kind,
            features=draw(st.lists(st.sampled_from(FEATURES), unique=True, max_size=2)),
            links={
                other: draw(st.lists(st.sampled_from(names[other]), unique=True))
                for other in draw(st.lists(st.sampled_from(KINDS), unique=True, max_size=2))
                if other != kind and names[other]
            },
        )
        for kind in draw(st.permutations(KINDS))
        for name in names[kind]
    ]


@st.composite
def wishes(draw: st.DrawFn) -> FindRcs:
    roles = draw(st.lists(st.sampled_from(KINDS), unique=True, min_size=1))
    some = st.lists(st.sampled_from(roles), unique=True, max_size=2)
    wish = {kind: f"{kind}{draw(st.integers(1, 3))}" for kind in draw(some)}
    features = {kind: draw(st.lists(st.sampled_from(FEATURES), max_size=1)) for kind in draw(some)}
    return FindRcs(roles, wish, features)


def every_fitting_set(resources: list[Resource], wanted: FindRcs) -> list[dict[str, str]]:
    """Say the same by trying all combinations."""
    by_kind = [[resource for resource in resources if resource.type == role] for role in wanted.roles]
    return [
        {one.type: one.name for one in chosen}
        for chosen in product(*by_kind)
        if all(wanted.wish.get(one.type, one.name) == one.name for one in chosen)
        and all(set(wanted.features.get(one.type, [])) <= set(one.features) for one in chosen)
        and all(b.name in a.links[b.type] for a in chosen for b in chosen if b.type in a.links)
    ]


@given(hardware(), wishes())
def test_exactly_the_fitting_sets_are_found_in_the_files_order(resources: list[Resource], wanted: FindRcs) -> None:
    expected = every_fitting_set(resources, wanted)
    if expected:
        assert Inventory(resources).find(wanted) == expected
    else:
        with pytest.raises(NoSuchHardware) as refused:
            Inventory(resources).find(wanted)
        assert refused.value.facts["role"] in wanted.roles


def iros2001() -> Inventory:
    """Three Scouts share one radio; two frequencies, a grabber on each."""
    scouts = [
        Resource(
            f"scout{n}",
            "scout",
            features=["camera"] if n < 3 else ["gripper"],
            links={"command_radio": ["radio"], "video_frequency": ["channel1"] if n < 3 else ["channel2"]},
        )
        for n in (1, 2, 3)
    ]
    channels = [Resource(f"channel{n}", "video_frequency") for n in (1, 2)]
    grabbers = [Resource(f"grabber{n}", "framegrabber", links={"video_frequency": [f"channel{n}"]}) for n in (1, 2)]
    return Inventory([*scouts, Resource("radio", "command_radio", sharable=True), *channels, *grabbers])


CAPTURE = ["scout", "command_radio", "video_frequency", "framegrabber"]


def test_any_scout_comes_with_the_frequency_and_grabber_it_can_be_seen_through() -> None:
    assert iros2001().find(FindRcs(CAPTURE)) == [
        {
            "scout": f"scout{n}",
            "command_radio": "radio",
            "video_frequency": f"channel{c}",
            "framegrabber": f"grabber{c}",
        }
        for n, c in ((1, 1), (2, 1), (3, 2))
    ]


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        (FindRcs(["scuot"]), r"no 'scuot' exists \(did you mean 'scout'\?\)"),
        (FindRcs(["scout"], {"scout": "scuot2"}), r"no scout is named 'scuot2' \(did you mean 'scout2'\?\)"),
        (FindRcs(["scout"], {"scot": "scout2"}), r"the wish names 'scot' \(did you mean 'scout'\?\)"),
        (FindRcs(["scout"], {}, {"radio": ["x"]}), "the features names 'radio'"),
        (FindRcs(["scout"], {}, {"scout": ["camrea"]}), r"no scout has 'camrea' \(did you mean 'camera'\?\)"),
        (FindRcs(["scout"], {}, {"scout": ["camera", "gripper"]}), "no scout has all of camera, gripper"),
        (FindRcs(["scout"], {"scout": "scout3"}, {"scout": ["camera"]}), "scout3 has no 'camera'"),
        (FindRcs(["scout", "scout"]), "asked for twice"),
        (FindRcs([]), "no kind of hardware"),
        (
            FindRcs(CAPTURE, {"scout": "scout1", "framegrabber": "grabber2"}),
            r"no framegrabber goes together with scout, command_radio, video_frequency as wished "
            r"\(scout scout1, framegrabber grabber2\): .*scout1 goes only with video_frequency channel1; "
            r"grabber2 goes only with video_frequency channel2",
        ),
    ],
)
def test_a_refusal_names_the_part_of_the_wish_that_nothing_fits(wanted: FindRcs, told: str) -> None:
    with pytest.raises(NoSuchHardware, match=told):
        iros2001().find(wanted)


def test_a_runaway_number_of_sets_is_cut_off() -> None:
    many = [Resource(f"{kind}{n}", kind) for kind in ("a", "b", "c") for n in range(20)]
    assert len(Inventory(many).find(FindRcs(["a", "b", "c"]))) == MOST_SETS
