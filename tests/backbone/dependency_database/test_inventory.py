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
    roles = draw(st.dictionaries(st.sampled_from(["left", "right", *KINDS]), st.sampled_from(KINDS), min_size=1))
    some = st.lists(st.sampled_from(list(roles)), unique=True, max_size=2)
    wish = {role: f"{roles[role]}{draw(st.integers(1, 3))}" for role in draw(some)}
    features = {role: draw(st.lists(st.sampled_from(FEATURES), max_size=1)) for role in draw(some)}
    return FindRcs(roles, wish, features)


def every_fitting_set(resources: list[Resource], wanted: FindRcs) -> list[dict[str, str]]:
    """Say the same by trying all combinations."""
    by_role = [[resource for resource in resources if resource.type == kind] for kind in wanted.roles.values()]
    sets = [dict(zip(wanted.roles, chosen, strict=True)) for chosen in product(*by_role)]
    return [
        {role: one.name for role, one in found.items()}
        for found in sets
        if all(wanted.wish.get(role, one.name) == one.name for role, one in found.items())
        and all(set(wanted.features.get(role, [])) <= set(one.features) for role, one in found.items())
        and len({one.name for one in found.values()}) == len(found)
        and all(b.name in a.links[b.type] for a in found.values() for b in found.values() if b.type in a.links)
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


def kinds(*names: str) -> dict[str, str]:
    return {name: name for name in names}


CAPTURE = kinds("scout", "command_radio", "video_frequency", "framegrabber")


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
        (FindRcs(kinds("scuot")), r"no 'scuot' exists \(did you mean 'scout'\?\)"),
        (FindRcs(kinds("scout"), {"scout": "scuot2"}), r"no scout is named 'scuot2' \(did you mean 'scout2'\?\)"),
        (FindRcs(kinds("scout"), {"scot": "scout2"}), r"the wish names 'scot' \(did you mean 'scout'\?\)"),
        (FindRcs(kinds("scout"), {}, {"radio": ["x"]}), "the features names 'radio'"),
        (FindRcs(kinds("scout"), {}, {"scout": ["camrea"]}), r"no scout has 'camrea' \(did you mean 'camera'\?\)"),
        (FindRcs(kinds("scout"), {}, {"scout": ["camera", "gripper"]}), "no scout has all of camera, gripper"),
        (FindRcs(kinds("scout"), {"scout": "scout3"}, {"scout": ["camera"]}), "scout3 has no 'camera'"),
        (
            FindRcs({"left": "framegrabber", "right": "framegrabber", "third": "framegrabber"}),
            "too few of kind framegrab",
        ),
        (FindRcs({}), "no kind of hardware"),
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
    assert len(Inventory(many).find(FindRcs(kinds("a", "b", "c")))) == MOST_SETS


def test_a_set_has_a_different_rc_for_each_role_of_one_kind() -> None:
    eyes = Inventory([Resource("eye1", "camera"), Resource("eye2", "camera")])
    assert eyes.find(FindRcs({"left": "camera", "right": "camera"}, {"left": "eye2"})) == [
        {"left": "eye2", "right": "eye1"}
    ]


def test_the_sharable_rcs_of_a_set_are_those_of_the_mission_file() -> None:
    inventory = iros2001()
    assert inventory.sharable(inventory.find(FindRcs(CAPTURE))) == {"radio"}
