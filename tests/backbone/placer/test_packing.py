"""Packs: each host's components in few processes, evenly, and no pack holds a component on its host."""

from __future__ import annotations

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st
from test_placement_book import process, spawn

from backbone.placer.packing import WANTS_PACK, is_packed, pack
from backbone.placer.placement_book import PlacementBook


def book_of(packs: int, *hosts: str) -> PlacementBook:
    book = PlacementBook(packs)
    for host in hosts:
        book.creator_up(host, [], 1, [], 0.0)
    return book


def place(book: PlacementBook, name: str, shares: str) -> str:
    book.reserve(spawn(name, shares=shares), "", 1.0)
    host = book.choose(name, 1.0).host
    book.started(name, 7, 1.0)
    return host


@given(st.integers(1, 5), st.lists(st.sampled_from([WANTS_PACK, "", "hardware"]), max_size=30))
def test_packs_of_a_host_differ_by_one_member_at_most_and_other_processes_are_as_ordered(
    packs: int, orders: list[str]
) -> None:
    book = book_of(packs, "east", "west")
    for number, shares in enumerate(orders):
        place(book, f"c{number}", shares)
    for host in ("east", "west"):
        members = Counter(
            one.spawn.process for one in book.records() if one.host == host and is_packed(one.spawn.process)
        )
        counts = [members.get(f"packed--{number}", 0) for number in range(1, packs + 1)]
        assert sum(counts) == sum(members.values())
        assert max(counts) - min(counts) <= 1
    for number, shares in enumerate(orders):
        if not is_packed(shares):
            assert book.record(f"c{number}").spawn.process == shares


def test_a_packed_component_goes_to_any_host_and_joins_a_pack_there() -> None:
    book = book_of(1, "east", "west")
    assert {place(book, name, WANTS_PACK) for name in ("a", "b")} == {"east", "west"}
    book.creator_down("east", 2.0)
    lost = next(one.spawn.name for one in book.records() if not one.host)
    assert book.choose(lost, 3.0).host == "west"
    assert [one.spawn.process for one in book.records()] == ["packed--1", "packed--1"]


def test_a_restarted_placer_knows_packs_by_their_names() -> None:
    book = PlacementBook(2)
    book.creator_up("east", [], 1, [process(spawn("a", shares="packed--2"))], 0.0)
    place(book, "b", WANTS_PACK)
    place(book, "c", WANTS_PACK)
    assert [one.spawn.process for one in book.records()] == ["packed--2", "packed--1", "packed--1"]


def test_of_equal_packs_the_first_is_joined() -> None:
    assert pack([], 3) == "packed--1"
