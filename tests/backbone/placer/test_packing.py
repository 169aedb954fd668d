"""Packs: each host's components in few processes, evenly, and no pack holds a component on its host."""

from __future__ import annotations

from collections import Counter, defaultdict

import msgspec
from hypothesis import given
from hypothesis import strategies as st
from test_placement_book import process, spawn

from backbone.placer.packing import MEMBERS_MOST, WANTS_PACK, is_packed, pack
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


MOST = {"watcher": 3, "capture": 16, "world": 1}


def place_alike(book: PlacementBook, name: str, kind: str) -> None:
    order = msgspec.structs.replace(spawn(name, kind=kind), alike_most=MOST[kind])
    book.reserve(order, "", 1.0)
    book.choose(name, 1.0)
    book.started(name, 7, 1.0)


def kinds_by_process(book: PlacementBook, host: str) -> dict[str, Counter[str]]:
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for one in book.records():
        if one.host == host:
            found[one.spawn.process][one.spawn.type] += 1
    return found


@given(st.lists(st.tuples(st.sampled_from(sorted(MOST)), st.booleans()), max_size=80))
def test_only_alike_ones_share_a_process_and_never_more_than_their_class_allows(asked: list[tuple[str, bool]]) -> None:
    book = book_of(0, "east", "west")
    for number, (kind, leaves) in enumerate(asked):
        place_alike(book, f"c{number}", kind)
        if leaves:
            book.stop_ordered(f"c{number // 2}", "it was enough")
        for host in ("east", "west"):
            processes = kinds_by_process(book, host)
            own = processes.pop("", Counter())
            assert all(count <= MOST[kind] or MOST[kind] == 1 for kind, count in own.items())
            for members in processes.values():
                ((shared, count),) = members.items()
                assert 1 <= count <= MOST[shared]


def test_the_first_ones_have_their_own_processes_and_the_next_fill_one_before_another_begins() -> None:
    book = book_of(0, "east")
    for number in range(8):
        place_alike(book, f"c{number}", "watcher")
    processes = [book.record(f"c{number}").spawn.process for number in range(8)]
    assert processes == ["", "", "", "watcher--1", "watcher--1", "watcher--1", "watcher--2", "watcher--2"]


def test_a_host_that_takes_over_lost_components_fills_no_process_beyond_its_limit() -> None:
    book = book_of(0, "east", "west")
    for number in range(12):
        place_alike(book, f"c{number}", "watcher")
    book.creator_down("east", 2.0)
    for one in [one for one in book.records() if not one.host]:
        book.choose(one.spawn.name, 3.0)
    assert [sum(members.values()) for members in kinds_by_process(book, "west").values()] == [3, 3, 3, 3]


def test_a_restarted_placer_goes_on_filling_the_processes_that_there_are() -> None:
    book = PlacementBook()
    orders = [
        msgspec.structs.replace(spawn(f"c{number}", shares="" if number < 3 else "watcher--1"), alike_most=3)
        for number in range(5)
    ]
    book.creator_up("east", [], 1, [process(order) for order in orders], 0.0)
    place_alike(book, "c5", "watcher")
    place_alike(book, "c6", "watcher")
    assert [book.record(name).spawn.process for name in ("c5", "c6")] == ["watcher--1", "watcher--2"]


@given(st.integers(1, 3 * MEMBERS_MOST))
def test_a_full_process_of_the_mission_file_is_split_and_its_parts_stay_on_one_host(members: int) -> None:
    book = book_of(0, "east", "west")
    hosts = {place(book, f"c{number}", "hardware") for number in range(members)}
    parts = Counter(one.spawn.process for one in book.records())
    assert len(hosts) == 1
    assert max(parts.values()) <= MEMBERS_MOST
    assert len(parts) == -(-members // MEMBERS_MOST)
    assert min(parts) == "hardware"
