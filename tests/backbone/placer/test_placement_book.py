"""Laws of the placement book under any order of events."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from backbone.component.messages import NameTaken
from backbone.component_database.messages import ComponentType, Multiplicity, MultiplicityExceeded
from backbone.creator.messages import HostLoad, ProcessState, RestartPolicy, Spawn
from backbone.naming import Subsystem
from backbone.placer.decisions import EndOrphan, Inspect, Instruction, Note, PlaceAgain, PlacementPhase
from backbone.placer.messages import NoHost, NotPlaced
from backbone.placer.placement_book import STOPPED_KEPT, PlacementBook


def spawn(name: str, *, restart: bool = True, pinned: bool = False, kind: str = "watcher", shares: str = "") -> Spawn:
    policy = RestartPolicy(restart=restart)
    return Spawn(Subsystem.MISSION_CONTROL, name, kind, "x:Y", {"n": 1}, "boss", policy, pinned=pinned, process=shares)


def process(order: Spawn, pid: int = 7) -> ProcessState:
    return ProcessState(order, pid, 0, "")


def book_with(*hosts: str) -> PlacementBook:
    book = PlacementBook()
    for host in hosts:
        book.creator_up(host, [], 1, [], 0.0)
    return book


def run(book: PlacementBook, order: Spawn, pin: str = "", now_s: float = 1.0) -> str:
    book.reserve(order, pin, now_s)
    host = book.choose(order.name, now_s).host
    book.started(order.name, 7, now_s)
    return host


def without_notes(instructions: list[Instruction]) -> list[Instruction]:
    return [instruction for instruction in instructions if not isinstance(instruction, Note)]


@dataclass
class World:
    """Hosts that may be alive, cut off or dead, and what really runs on them; it obeys the book at once."""

    book: PlacementBook = field(default_factory=PlacementBook)
    running: dict[str, dict[str, Spawn]] = field(default_factory=dict)
    connected: set[str] = field(default_factory=set)
    pids: dict[str, int] = field(default_factory=dict)
    now_s: float = 0.0

    def obey(self, instructions: list[Instruction]) -> None:
        for instruction in instructions:
            match instruction:
                case PlaceAgain(name=name):
                    self.place(name)
                case EndOrphan(host=host, name=name):
                    del self.running[host][name]
                case Inspect(host=host):
                    self.obey(self.book.inspected(host, self.listing(host), self.now_s))
                case Note():
                    pass

    def listing(self, host: str) -> list[ProcessState]:
        return [process(order) for order in self.running[host].values()]

    def place(self, name: str) -> None:
        record = self.book.find(name)
        if record is None or record.phase not in (PlacementPhase.WAITING, PlacementPhase.STARTING):
            return
        try:
            host = self.book.choose(name, self.now_s).host
        except NoHost:
            self.book.waits(name)
            return
        self.running[host][name] = record.spawn
        self.book.started(name, 7, self.now_s)

    def connect(self, host: str) -> None:
        self.pids.setdefault(host, 1)
        self.running.setdefault(host, {})
        self.connected.add(host)
        self.obey(self.book.creator_up(host, [], self.pids[host], self.listing(host), self.now_s))

    def cut(self, host: str) -> None:
        if host in self.connected:
            self.connected.discard(host)
            self.obey(self.book.creator_down(host, self.now_s))

    def kill(self, host: str) -> None:
        self.running[host] = {}
        self.pids[host] = self.pids.get(host, 1) + 1
        self.cut(host)

    def start(self, order: Spawn, pin: str) -> None:
        try:
            self.book.reserve(order, pin, self.now_s)
        except NameTaken:
            return
        self.place(order.name)
        record = self.book.find(order.name)
        if record is not None and not record.host:
            self.book.forget(order.name)

    def stop(self, name: str) -> None:
        record = self.book.find(name)
        if record is None:
            return
        if record.host in self.connected:
            self.running[record.host].pop(name, None)
        self.book.forget(name)

    def end_by_itself(self, host: str, name: str) -> None:
        order = self.running.get(host, {}).pop(name, None)
        if order is not None and host in self.connected:
            self.obey(self.book.component_disappeared(f"{order.subsystem}/{name}"))


HOSTS = ["a", "b", "c"]
EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["connect", "connect", "cut", "kill", "start", "start", "arc", "pin", "stop", "ends"]),
        st.sampled_from(HOSTS),
        st.sampled_from(["w1", "w2", "w3"]),
    ),
    max_size=40,
)


@given(EVENTS)
def test_nothing_runs_twice_and_what_is_wanted_runs_while_a_host_can_have_it(
    events: list[tuple[str, str, str]],
) -> None:
    world = World()
    for act, host, name in events:
        world.now_s += 1.0
        match act:
            case "connect":
                world.connect(host)
            case "cut":
                world.cut(host)
            case "kill":
                world.kill(host)
            case "start":
                world.start(spawn(name), "")
            case "arc":
                world.start(spawn(name, restart=False), "")
            case "pin":
                world.start(spawn(name, pinned=True), host)
            case "stop":
                world.stop(name)
            case _:
                world.end_by_itself(host, name)
        real = [(where, what) for where in sorted(world.connected) for what in sorted(world.running[where])]
        booked = [(r.host, r.spawn.name) for r in world.book.records() if r.phase is PlacementPhase.RUNNING]
        assert sorted(real) == sorted(booked)
        assert len({what for _, what in real}) == len(real)
        for record in world.book.records():
            if record.phase is PlacementPhase.WAITING:
                assert not (world.connected if not record.pin else world.connected & {record.pin})
            assert record.pin in ("", record.host) or record.phase is PlacementPhase.WAITING
        assert sum(view.components for view in world.book.hosts()) == len(booked)


def test_two_starts_at_once_get_two_names_and_two_hosts() -> None:
    book = book_with("a", "b")
    names = [book.number("watcher"), book.number("watcher")]
    assert names == ["watcher-1", "watcher-2"]
    for name in names:
        book.reserve(spawn(name), "", 1.0)
    assert [book.choose(name, 1.0).host for name in names] == ["a", "b"]
    with pytest.raises(NameTaken):
        book.reserve(spawn("watcher-1"), "", 1.0)


def test_a_rebuilt_book_knows_requester_pin_and_numbers() -> None:
    book = PlacementBook()
    book.creator_up("a", ["gl"], 1, [process(spawn("watcher-4", pinned=True))], 1.0)
    record = book.record("watcher-4")
    assert (record.spawn.requester, record.pin, record.host, record.pid) == ("boss", "a", "a", 7)
    assert book.number("watcher") == "watcher-5"


def test_a_lost_hosts_components_are_placed_again_and_its_arcs_forgotten() -> None:
    book = book_with("a")
    run(book, spawn("w1"))
    run(book, spawn("arc", restart=False))
    assert without_notes(book.creator_down("a", 2.0)) == [PlaceAgain("w1")]
    assert book.find("arc") is None
    assert book.creator_down("a", 2.0) == []


def test_a_pinned_component_waits_for_its_host() -> None:
    book = book_with("a", "b")
    run(book, spawn("rc", pinned=True), pin="a")
    book.creator_down("a", 2.0)
    with pytest.raises(NoHost):
        book.choose("rc", 2.0)
    assert book.may_find_host("rc")
    book.waits("rc")
    assert without_notes(book.creator_up("a", [], 2, [], 3.0)) == [PlaceAgain("rc")]


def test_a_creator_that_was_replaced_unnoticed_has_lost_what_it_ran() -> None:
    book = book_with("a", "b")
    assert run(book, spawn("w1")) == "a"
    assert PlaceAgain("w1") in book.creator_up("a", [], 2, [], 3.0)


def test_the_same_creator_met_again_keeps_what_it_runs() -> None:
    book = book_with("a")
    run(book, spawn("w1"))
    assert book.creator_up("a", [], 1, [process(spawn("w1"))], 3.0) == []


def test_a_component_that_was_stopped_while_its_host_was_cut_off_is_ended_when_it_is_back() -> None:
    book = book_with("a")
    run(book, spawn("w1"))
    book.creator_down("a", 2.0)
    book.forget("w1")
    assert EndOrphan("a", "w1") in book.creator_up("a", [], 1, [process(spawn("w1"))], 3.0)
    assert book.find("w1") is None


@pytest.mark.parametrize(
    ("wanted", "pin"),
    [(spawn("w1", kind="other"), ""), (replace(spawn("w1"), parameters={"n": 2}), ""), (spawn("w1", pinned=True), "b")],
    ids=["another type", "other parameters", "another host"],
)
def test_what_is_found_but_wanted_otherwise_is_ended(wanted: Spawn, pin: str) -> None:
    book = book_with("b")
    book.reserve(wanted, pin, 1.0)
    assert EndOrphan("a", "w1") in book.creator_up("a", [], 1, [process(spawn("w1"))], 2.0)


def test_a_component_its_creator_no_longer_lists_ended_by_itself() -> None:
    book = book_with("a")
    run(book, spawn("arc", restart=False))
    assert book.component_disappeared("mission_control/arc") == [Inspect("a")]
    book.inspected("a", [process(spawn("arc"))], 2.0)
    assert book.load_heard(HostLoad("a", [], 0.0, 0.0, 2, 0)) == [Inspect("a")]
    book.inspected("a", [], 2.0)
    with pytest.raises(NotPlaced):
        book.record("arc")


def test_an_old_listing_does_not_end_what_started_after_it_was_asked_for() -> None:
    book = book_with("a")
    run(book, spawn("w1"), now_s=5.0)
    assert book.inspected("a", [], 4.0) == []
    assert book.record("w1").phase is PlacementPhase.RUNNING


def test_a_wanted_component_that_is_missing_is_placed_again_and_reported() -> None:
    book = book_with("a")
    run(book, spawn("w1"))
    assert without_notes(book.inspected("a", [], 2.0)) == [PlaceAgain("w1")]
    assert [(each.name, each.since_s) for each in book.absences()] == [("w1", 2.0)]
    book.choose("w1", 3.0)
    book.started("w1", 8, 3.0)
    assert book.absences() == []


def test_only_so_many_orders_to_stop_are_remembered() -> None:
    book = book_with("a")
    for number in range(STOPPED_KEPT + 10):
        book.stop_ordered(f"w{number}", "over")
    assert len(book.stopped()) == STOPPED_KEPT
    assert f"w{STOPPED_KEPT + 9}" in book.stopped()


def test_a_difference_in_numbers_is_asked_about_until_the_creator_has_answered() -> None:
    book = book_with("a")
    run(book, spawn("w1"))
    load = HostLoad("a", ["gl"], 0.5, 0.2, 4, 3)
    assert book.load_heard(load) == [Inspect("a")]
    assert book.load_heard(load) == [Inspect("a")], "the first question may get no answer"
    book.inspected("a", [process(spawn(name)) for name in ("w1", "other1", "other2")], 2.0)
    assert book.load_heard(load) == []
    assert book.load_heard(replace(load, components=2)) == [Inspect("a")]
    assert (book.hosts()[0].cpu, book.hosts()[0].cores, book.hosts()[0].tags) == (0.5, 4, frozenset({"gl"}))


def test_a_kind_of_one_that_waits_for_its_restart_is_still_the_one() -> None:
    book = book_with("a")
    run(book, spawn("room", kind="world"))
    world = ComponentType("world", "x:Y", Subsystem.RESOURCE_POOL, Multiplicity.ONE)
    with pytest.raises(MultiplicityExceeded, match="room is running on a, pid 7"):
        book.refuse_second(world, "second")
    book.refuse_second(world, "room")


def test_an_unknown_name_is_answered_with_the_nearest_known_one() -> None:
    book = book_with("a")
    run(book, spawn("watcher"))
    with pytest.raises(NotPlaced, match="did you mean 'watcher'"):
        book.record("wacther")


def test_who_shares_a_process_goes_where_the_first_of_it_is() -> None:
    book = book_with("a", "b")
    assert run(book, spawn("w1", shares="pool")) == "a"
    assert run(book, spawn("w2")) == "b"
    for name in ("w3", "w4"):
        assert run(book, spawn(name, shares="pool")) == "a"
    assert book.record("w4").reasons[0].startswith("a: chosen, with the rest of its process")
    assert book.record("w4").reasons[1] == "b: not a, where the rest of its process is"
    assert run(book, spawn("w5", shares="other")) == "b"


def test_who_is_asked_for_elsewhere_goes_there_whoever_shares_its_process() -> None:
    book = book_with("a", "b")
    run(book, spawn("w1", shares="pool"))
    assert run(book, spawn("w2", shares="pool", pinned=True), "b") == "b"


def test_who_shared_a_process_on_a_lost_host_is_together_again_elsewhere() -> None:
    book = book_with("a", "b", "c")
    names = ("w1", "w2", "w3")
    for name in names:
        assert run(book, spawn(name, shares="pool")) == "a"
    again = without_notes(book.creator_down("a", 2.0))
    assert again == [PlaceAgain(name) for name in names]
    assert {book.choose(name, 2.0).host for name in names} == {"b"}
