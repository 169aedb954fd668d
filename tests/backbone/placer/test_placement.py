"""Laws of the choice of a host."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.placer.messages import NoHost
from backbone.placer.placement import CandidateHost, Choice, obstacle, place

TAGS = ["gl", "serial", "video"]
NAMES = ["alpha", "beta", "gamma", "delta"]


@st.composite
def hosts(draw: st.DrawFn) -> list[CandidateHost]:
    return [
        CandidateHost(
            name,
            frozenset(draw(st.sets(st.sampled_from(TAGS)))),
            draw(st.booleans()),
            draw(st.integers(0, 30)),
            draw(st.floats(0, 1)),
            draw(st.floats(0, 1)),
            draw(st.integers(1, 16)),
        )
        for name in draw(st.lists(st.sampled_from(NAMES), unique=True))
    ]


WANTED_TAGS = st.sets(st.sampled_from(TAGS), max_size=2)
PINS = st.sampled_from(["", *NAMES])


def filled(views: list[CandidateHost], count: int) -> dict[str, int]:
    """Place that many equal components one after the other and count them by host."""
    known = {view.name: view for view in views}
    placed = dict.fromkeys(known, 0)
    for number in range(count):
        host = place(f"c{number}", [], "", known.values()).host
        placed[host] += 1
        known[host] = replace(known[host], components=known[host].components + 1)
    return placed


@given(hosts(), WANTED_TAGS, PINS)
def test_a_chosen_host_lives_has_the_tags_and_is_the_one_asked_for(
    views: list[CandidateHost], tags: set[str], pin: str
) -> None:
    able = [view for view in views if view.alive and tags <= view.tags and pin in ("", view.name)]
    try:
        choice = place("c", tags, pin, views)
    except NoHost as refused:
        assert not able
        assert all(view.name in refused.detail for view in views)  # noqa: PT017
    else:
        assert choice.host in {view.name for view in able}
        assert [line.partition(":")[0] for line in choice.reasons] == sorted(view.name for view in views)
        chosen = next(view for view in able if view.name == choice.host)
        assert all(chosen.load <= view.load for view in able)


@given(hosts(), WANTED_TAGS, PINS, st.randoms(use_true_random=False))
def test_the_order_in_which_hosts_are_known_does_not_matter(
    views: list[CandidateHost], tags: set[str], pin: str, rng: object
) -> None:
    def outcome(of: list[CandidateHost]) -> Choice | str:
        try:
            return place("c", tags, pin, of)
        except NoHost as refused:
            return refused.detail

    shuffled = list(views)
    rng.shuffle(shuffled)  # type: ignore[attr-defined]
    assert outcome(views) == outcome(shuffled)


@given(st.integers(0, 40), st.integers(1, 4), st.floats(0, 0.12), st.floats(0, 0.12))
def test_equal_hosts_get_equal_numbers_whatever_noise_their_load_has(
    count: int, cores: int, noise: float, other_noise: float
) -> None:
    views = [
        CandidateHost(name, cpu=cpu, cores=cores) for name, cpu in zip(NAMES, (0.0, noise, other_noise), strict=False)
    ]
    placed = filled(views, count)
    assert max(placed.values()) - min(placed.values()) <= 1


@given(st.integers(1, 40), st.floats(0, 1), st.floats(0, 1))
def test_the_busier_of_two_equal_hosts_never_gets_more(count: int, cpu: float, other_cpu: float) -> None:
    idle, busy = sorted((cpu, other_cpu))
    placed = filled([CandidateHost("z_idle", cpu=idle), CandidateHost("a_busy", cpu=busy)], count)
    assert placed["a_busy"] - placed["z_idle"] <= 1


def test_twelve_equal_components_over_three_hosts_end_four_each() -> None:
    assert filled([CandidateHost(name) for name in NAMES[:3]], 12) == {"alpha": 4, "beta": 4, "gamma": 4}


def test_a_loaded_host_gets_fewer() -> None:
    views = [CandidateHost("alpha", cpu=0.9, cores=2), CandidateHost("beta", cores=2), CandidateHost("gamma", cores=2)]
    assert filled(views, 12) == {"alpha": 0, "beta": 6, "gamma": 6}
    assert filled([replace(views[0], cpu=0.2), *views[1:]], 12) == {"alpha": 2, "beta": 5, "gamma": 5}


def test_a_host_with_full_memory_is_the_last_choice_but_one() -> None:
    assert place("c", [], "", [CandidateHost("alpha", memory=0.95), CandidateHost("beta", components=5)]).host == "beta"
    assert place("c", [], "", [CandidateHost("alpha", memory=0.95)]).host == "alpha"


def test_a_host_on_which_the_type_did_not_start_is_the_last_choice_but_still_one() -> None:
    failed = CandidateHost("alpha", failed_s=3.0)
    choice = place("c", [], "", [failed, CandidateHost("beta", cpu=1.0, components=9)])
    assert choice.host == "beta"
    assert choice.reasons[0] == "alpha: a component of this type did not start there"
    assert place("c", [], "", [failed]).host == "alpha"
    assert place("c", [], "", [failed, CandidateHost("beta", failed_s=2.0)]).host == "beta", (
        "the one that failed earlier"
    )


def test_a_refusal_names_every_host_and_why_not() -> None:
    views = [
        CandidateHost("alpha"),
        CandidateHost("beta", frozenset({"gl"}), alive=False),
        CandidateHost("gamma", frozenset({"gl"})),
    ]
    with pytest.raises(NoHost) as refused:
        place("world", {"gl", "video"}, "", views)
    assert refused.value.detail == ("no host for world: alpha: lacks gl, video; beta: lacks video; gamma: lacks video")
    with pytest.raises(NoHost, match="beta: its creator is gone"):
        place("world", {"gl"}, "beta", views)


def test_a_host_that_does_not_exist_is_answered_with_the_nearest_one() -> None:
    with pytest.raises(NoHost, match=r"alhpa is no host with a creator \(did you mean 'alpha'\?\)"):
        place("world", [], "alhpa", [CandidateHost("alpha")])
    with pytest.raises(NoHost, match="no creator is known"):
        place("world", [], "", [])


def test_one_component_on_one_core_is_told_in_the_singular() -> None:
    assert CandidateHost("base", components=1).describe().startswith("1 component on 1 core, ")


def test_a_host_without_obstacle_is_told_by_nothing() -> None:
    assert obstacle(CandidateHost("alpha"), [], "") == ""
