"""The graph is checked whole: compared with a reference that tries every order and every path."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_modules import Counter, Doubler, Follower, Summing

from mission_control.modules.graph import (
    Connection,
    Cycle,
    Graph,
    GraphRefused,
    IllegalModuleName,
    Member,
    NoProducer,
    SecondProducer,
    UnknownPort,
    WrongType,
    faults,
)
from mission_control.modules.ports import ModulePorts, Port

Units = Mapping[str, Sequence[Member]]

keys, kinds = st.sampled_from("abcde"), st.sampled_from(["X", "X", "X", "Y"])


@st.composite
def members(draw: st.DrawFn, name: str) -> Member:
    ins = draw(st.lists(st.tuples(keys, kinds, st.booleans(), st.booleans()), max_size=3))
    outs = draw(st.lists(st.tuples(keys, kinds), max_size=2))
    inputs = tuple(Port(f"in{n}", key, kind, needed, latest) for n, (key, kind, needed, latest) in enumerate(ins))
    return Member(name, ModulePorts(inputs, tuple(Port(f"out{n}", key, kind) for n, (key, kind) in enumerate(outs))))


@st.composite
def graphs(draw: st.DrawFn) -> tuple[Units, dict[str, str]]:
    count = draw(st.integers(1, 5))
    units: dict[str, list[Member]] = {"first": [], "second": []}
    for number in range(count):
        units[draw(st.sampled_from(["first", "second"]))].append(draw(members(f"m{number}")))
    return units, draw(st.dictionaries(keys, kinds, max_size=2))


@st.composite
def sound_graphs(draw: st.DrawFn) -> tuple[Units, dict[str, str]]:
    """Return graphs in which each key has one producer and each type fits; cycles are broken."""
    count = draw(st.integers(1, 6))
    units: dict[str, list[Member]] = {"first": [], "second": []}
    names = draw(st.permutations(range(count)))
    for number in range(count):
        taken = draw(st.lists(st.tuples(st.integers(-1, count - 1), st.booleans()), max_size=3))
        inputs = tuple(
            Port(f"in{n}", f"k{of}" if of >= 0 else "given", "X", *((True, latest) if of < number else (False, True)))
            for n, (of, latest) in enumerate(taken)
        )
        member = Member(f"m{number}", ModulePorts(inputs, (Port("out", f"k{number}", "X"),)))
        units[draw(st.sampled_from(["first", "second"]))].append(member)
    return {unit: sorted(of, key=lambda one: names[int(one.name[1:])]) for unit, of in units.items()}, {"given": "X"}


def edges(among: Sequence[Member]) -> set[tuple[str, str]]:
    """Return (before, after) for all of these modules."""
    return {
        (maker.name, taker.name)
        for maker in among
        for taker in among
        for _, made in maker.keyed_outputs
        for _, port in taker.keyed_inputs
        if made.key == port.key and (port.is_required or not port.is_latest)
    }


def first_producers(all_of_them: Sequence[Member]) -> list[Member]:
    """Return the modules with only those outputs that are the first of their key."""
    seen: set[str] = set()
    found = []
    for member in all_of_them:
        kept = tuple(p for p in member.ports.outputs if not (p.key in seen or seen.add(p.key)))  # type: ignore[func-returns-value]
        found.append(Member(member.name, ModulePorts(member.ports.inputs, kept)))
    return found


@given(graphs())
@settings(max_examples=share(400))
def test_every_fault_is_found_and_nothing_else(graph: tuple[Units, dict[str, str]]) -> None:
    units, outside = graph
    every = [member for of in units.values() for member in of]
    expected = set()
    outputs = [(port.key, member, port) for member in every for port in member.ports.outputs]
    for number, (key, member, port) in enumerate(outputs):
        if key in outside or any(key == other for other, _, _ in outputs[:number]):
            expected.add((SecondProducer, (member.name,), port.name))
    for member in every:
        for port in member.ports.inputs:
            made = [output.type for key, _, output in outputs if key == port.key]
            made = [outside[port.key]] if port.key in outside else made
            if not made and port.is_required:
                expected.add((NoProducer, (member.name,), port.name))
            if made and made[0] != port.type:
                expected.add((WrongType, (member.name,), port.name))
    reach = edges(first_producers(every))
    for middle, left, right in itertools.product([member.name for member in every], repeat=3):
        if {(left, middle), (middle, right)} <= reach:
            reach.add((left, right))
    for member in every:
        if (member.name, member.name) in reach:
            mutual = tuple(o.name for o in every if {(member.name, o.name), (o.name, member.name)} <= reach)
            expected.add((Cycle, mutual, ""))
    found = faults(units, outside)
    told = {(type(one), one.modules if isinstance(one, Cycle) else one.modules[:1], one.port) for one in found}
    assert told == expected
    assert len(told) == len(found)
    assert all(one.detail and one.remedy for one in found)


@given(sound_graphs())
@settings(max_examples=share(300))
def test_the_order_is_the_first_of_all_that_are_possible(graph: tuple[Units, dict[str, str]]) -> None:
    units, outside = graph
    ordered = Graph(units, outside).order
    for unit, of in units.items():
        bonds = edges(of)
        possible = (
            names
            for names in itertools.permutations([member.name for member in of])
            if all(names.index(before) < names.index(after) for before, after in bonds)
        )
        assert ordered[unit] == next(possible)


@given(sound_graphs())
@settings(max_examples=share(200))
def test_what_is_sound_is_sound_in_every_arrangement_and_all_values_have_a_way(
    graph: tuple[Units, dict[str, str]],
) -> None:
    units, outside = graph
    every = [member for of in units.values() for member in of]
    whole = Graph({"all": every}, outside)
    assert {one.key for one in whole.connections} <= outside.keys()
    alone = Graph({member.name: [member] for member in every}, outside)
    takers = {(port.key, member.name) for member in every for port in member.ports.inputs}
    own = {(port.key, member.name) for member in every for port in member.ports.outputs}
    assert {(one.key, one.consumer) for one in alone.connections} == takers - own


CHAIN = [Member("summing", Summing.ports()), Member("doubler", Doubler.ports()), Member("counter", Counter.ports())]


def test_a_chain_is_put_in_order_and_cut_between_units() -> None:
    assert Graph({"one": CHAIN}).order == {"one": ("counter", "doubler", "summing")}
    cut = Graph({"late": CHAIN[:2], "early": CHAIN[2:]})
    number = Counter.ports().outputs[0].type
    assert cut.connections == (Connection("number", number, "early", "late"),)
    assert cut.into("late") == {"number": "early"}
    assert cut.out_of("early") == ["number"]
    assert cut.out_of("late") == []


def test_two_algorithms_for_one_task_stand_side_by_side_under_keys_of_their_own() -> None:
    """RoboFrame 2006, section IV: different algorithms are compared in the same application."""
    other = Member("doubler-b", Doubler.ports(), outputs={"twice": "twice-b"})
    chosen = Member("summing", Summing.ports(), inputs={"summand": "twice-b"})
    assert Graph({"one": [chosen, *CHAIN[1:], other]}).order["one"] == ("counter", "doubler", "doubler-b", "summing")


def test_a_latest_value_with_a_default_breaks_a_cycle() -> None:
    assert Graph({"one": [Member("follower", Follower.ports())]}, {"sum": Follower.ports().inputs[0].type}).order


def test_all_faults_are_said_at_once_with_names_and_remedies() -> None:
    typo = Member("doubler", Doubler.ports(), inputs={"numbr": "x"}, outputs={"twice": "No Name"})
    with pytest.raises(GraphRefused) as refused:
        Graph({"one": [typo, dataclasses.replace(typo), Member("Bad Name", Counter.ports())]})
    said = [(type(one), one.detail) for one in refused.value.faults]
    assert (UnknownPort, "doubler has no input 'numbr' (did you mean 'number'?)") in said
    assert (IllegalModuleName, "the key 'No Name' of output twice of doubler is no legal name") in said
    assert (IllegalModuleName, "'Bad Name' is no legal name") in said
    assert (IllegalModuleName, "a second module doubler") in said
    assert "SecondProducer: doubler produces No Name, and so does doubler" in str(refused.value)


def test_modules_that_wait_for_each_other_are_named_once() -> None:
    ring = [
        Member(name, ModulePorts((Port("in", f"from-{before}", "X"),), (Port("out", f"from-{name}", "X"),)))
        for name, before in [("a", "c"), ("b", "a"), ("c", "b")]
    ]
    [fault] = faults({"one": ring[:1], "two": ring[1:]}, {})
    assert (type(fault), fault.modules, fault.detail) == (Cycle, ("a", "b", "c"), "a, b, c wait for each other")
