"""Graph: modules in execution units; checks their connections and computes their order.

The input is plain data, so a mission file can be checked without an instance of any module.

Rules of this file:

* Outputs and inputs are connected by key. Their types must be equal.
* Legality does not depend on the units: legal modules are legal in every arrangement. So a cycle through several units
is rejected like a cycle within one unit.
* All faults are found at once.

Source: B-Human's module graph; RoboFrame 2006, section III.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from backbone.errors import Refusal
from backbone.naming import did_you_mean, is_legal
from mission_control.modules.ports import ModulePorts, Port

OUTSIDE = ""  # the unit of values that no module of the graph produces


@dataclass(frozen=True, slots=True)
class Member:
    """A module of a graph.

    Attributes:
        name: Unique in the graph.
        ports: Ports that its class declares.
        inputs: Input → key, if it differs from the declared one.
        outputs: Output → key, likewise.
    """

    name: str
    ports: ModulePorts
    inputs: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def keyed_inputs(self) -> list[tuple[str, Port]]:
        """Key and port of each input."""
        return [(self.inputs.get(port.name, port.key), port) for port in self.ports.inputs]

    @property
    def keyed_outputs(self) -> list[tuple[str, Port]]:
        """Key and port of each output."""
        return [(self.outputs.get(port.name, port.key), port) for port in self.ports.outputs]


@dataclass(frozen=True, slots=True)
class Connection:
    """The path of a key's values from one unit to another.

    Attributes:
        producer: Unit of the module that produces them; ``OUTSIDE``: no module does.
        consumer: Unit with a module that takes them.
    """

    key: str
    type: str
    producer: str
    consumer: str


@dataclass(frozen=True, slots=True)
class WiringFault:
    """A fault of the graph.

    Attributes:
        modules: Names of the modules concerned, the main one first.
        port: Name of the port of the first module; empty: the fault concerns the whole module.
        detail: A sentence with the names.
        remedy: Advice for the author.
    """

    modules: tuple[str, ...]
    port: str
    detail: str
    remedy: str


class IllegalModuleName(WiringFault):
    """The name of a module or key cannot be part of a key, or another module has it."""


class UnknownPort(WiringFault):
    """A key is set for a port that the module does not have."""


class SecondProducer(WiringFault):
    """A key has more than one producer."""


class NoProducer(WiringFault):
    """A required input has no producer."""


class WrongType(WiringFault):
    """The type of an input differs from that of its key's producer."""


class Cycle(WiringFault):
    """Modules wait for each other."""


class GraphRefused(Refusal):
    """The modules cannot be connected.

    Attributes:
        faults: All faults found.
    """

    code = "module.graph"
    remedy = "Correct each fault as its remedy says."

    def __init__(self, faults: Sequence[WiringFault]) -> None:
        lines = (f"{type(one).__name__}: {one.detail}. {one.remedy}" for one in faults)
        super().__init__("\n".join(lines), faults=len(faults))
        self.faults = tuple(faults)


class Graph:
    """A checked graph.

    Args:
        units: Unit → its modules; unless connections demand otherwise, they run in this order.
        given: Key → type of values from outside.

    Attributes:
        order: Unit → names of its modules in the order in which they run.
        connections: Connections between units and from outside; sorted.

    Raises:
        GraphRefused: The graph has faults; the error lists all of them.
    """

    def __init__(self, units: Mapping[str, Sequence[Member]], given: Mapping[str, str] | None = None) -> None:
        self.units, self.given = {unit: tuple(members) for unit, members in units.items()}, dict(given or {})
        if found := faults(self.units, self.given):
            raise GraphRefused(found)
        producers = {key: unit for unit, member in _all(self.units) for key, _port in member.keyed_outputs}
        self.order = {unit: tuple(_ordered(members)) for unit, members in self.units.items()}
        self.connections = tuple(
            sorted(
                {
                    Connection(key, port.type, producers.get(key, OUTSIDE), unit)
                    for unit, member in _all(self.units)
                    for key, port in member.keyed_inputs
                    if producers.get(key, OUTSIDE) != unit and (key in producers or key in self.given)
                },
                key=lambda one: (one.key, one.producer, one.consumer),
            )
        )

    def into(self, unit: str) -> dict[str, str]:
        """Return key → producing unit, for all values that enter a unit."""
        return {one.key: one.producer for one in self.connections if one.consumer == unit}

    def awaited(self, unit: str) -> frozenset[str]:
        """Return the keys from outside whose values begin a round: those of required fresh inputs, else of all."""
        into = self.into(unit)
        fresh = [
            (key, port.is_required)
            for member in self.units[unit]
            for key, port in member.keyed_inputs
            if key in into and not port.is_latest
        ]
        return frozenset(key for key, is_required in fresh if is_required) or frozenset(key for key, _ in fresh)

    def out_of(self, unit: str) -> list[str]:
        """Return the keys that a unit produces for other units."""
        return sorted({one.key for one in self.connections if one.producer == unit})


def faults(units: Mapping[str, Sequence[Member]], given: Mapping[str, str]) -> list[WiringFault]:
    """Return all faults, in the order of the modules."""
    members = [member for _unit, member in _all(units)]
    producers: dict[str, tuple[Member, Port]] = {}
    found = list(_of_names(members))
    for member in members:
        found += _of_outputs(member, producers, given)
    for member in members:
        found += _of_inputs(member, producers, given)
    return [*found, *_cycles(members, {key: member.name for key, (member, _port) in producers.items()})]


def _all(units: Mapping[str, Sequence[Member]]) -> Iterator[tuple[str, Member]]:
    return ((unit, member) for unit, members in units.items() for member in members)


def _of_names(members: Sequence[Member]) -> Iterator[WiringFault]:
    seen: set[str] = set()
    for member in members:
        if not is_legal(member.name):
            yield IllegalModuleName((member.name,), "", f"{member.name!r} is no legal name", "Write it like 'detector'")
        if member.name in seen:
            yield IllegalModuleName(
                (member.name,), "", f"a second module {member.name}", "Give each module its own name"
            )
        seen.add(member.name)
        for given, ports, what in (
            (member.inputs, member.ports.inputs, "input"),
            (member.outputs, member.ports.outputs, "output"),
        ):
            known = [port.name for port in ports]
            for port, key in given.items():
                if port not in known:
                    detail = f"{member.name} has no {what} {port!r}{did_you_mean(port, known)}"
                    yield UnknownPort((member.name,), port, detail, f"There is: {', '.join(known) or 'none'}")
                if not is_legal(key):
                    detail = f"the key {key!r} of {what} {port} of {member.name} is no legal name"
                    yield IllegalModuleName((member.name,), port, detail, "Write it like 'left-picture'")


def _of_outputs(
    member: Member, producers: dict[str, tuple[Member, Port]], given: Mapping[str, str]
) -> Iterator[WiringFault]:
    for key, port in member.keyed_outputs:
        first, _port = producers.setdefault(key, (member, port))
        if key in given:
            detail = f"{member.name} produces {key}, which comes from outside"
            yield SecondProducer((member.name,), port.name, detail, "Give its output another key")
        elif first is not member or producers[key][1] is not port:
            detail = f"{member.name} produces {key}, and so does {first.name}"
            remedy = "Give one of them another key; each module that takes values names the wanted key"
            yield SecondProducer((member.name, first.name), port.name, detail, remedy)


def _of_inputs(
    member: Member, producers: Mapping[str, tuple[Member, Port]], given: Mapping[str, str]
) -> Iterator[WiringFault]:
    for key, port in member.keyed_inputs:
        producer, output = producers.get(key, (None, None))
        if key in given:
            whence, made = "from outside", given[key]
        elif producer is not None and output is not None:
            whence, made = f"from {producer.name}", output.type
        else:
            if port.is_required:
                hint = did_you_mean(key, [*producers, *given])
                detail = f"{member.name} needs {key} ({port.type}), and no module produces it{hint}"
                remedy = "Add a module that does, name another key, or give the input a default"
                yield NoProducer((member.name,), port.name, detail, remedy)
            continue
        if made != port.type:
            detail = f"{member.name} takes {port.type} as {key}, but {whence} comes {made}"
            blamed = [member.name] if producer is None else [member.name, producer.name]
            yield WrongType(
                tuple(blamed), port.name, detail, "Name another key, or declare the same class on both sides"
            )


def _before(members: Sequence[Member], producers: Mapping[str, str]) -> dict[str, set[str]]:
    """Return module → the modules among these that must run before it."""
    names = {member.name for member in members}
    return {
        member.name: {
            producers[key]
            for key, port in member.keyed_inputs
            if port.comes_first and producers.get(key, OUTSIDE) in names
        }
        for member in members
    }


def _ordered(members: Sequence[Member]) -> Iterator[str]:
    """Yield the names in the first possible order, by their places among ``members``."""
    producers = {key: member.name for member in members for key, _port in member.keyed_outputs}
    left = _before(members, producers)
    place = {member.name: number for number, member in enumerate(members)}
    ready = [place[name] for name, before in left.items() if not before]
    heapq.heapify(ready)
    while ready:
        name = members[heapq.heappop(ready)].name
        yield name
        for other, before in left.items():
            if name in before:
                before.remove(name)
                if not before:
                    heapq.heappush(ready, place[other])


def _cycles(members: Sequence[Member], producers: Mapping[str, str]) -> Iterator[WiringFault]:
    """Yield one fault for each set of modules that wait for each other."""
    before = _before(members, producers)
    reached = {name: _reachable(name, before) for name in before}
    told: set[str] = set()
    for name in before:
        if name in reached[name] and name not in told:
            round_trip = tuple(other for other in before if other in reached[name] and name in reached[other])
            told.update(round_trip)
            detail = (
                f"{', '.join(round_trip)} wait for each other" if len(round_trip) > 1 else f"{name} waits for itself"
            )
            yield Cycle(round_trip, "", detail, "Declare one of the inputs between them as LATEST, with a default")


def _reachable(start: str, before: Mapping[str, set[str]]) -> set[str]:
    found: set[str] = set()
    left = [start]
    while left:
        for name in before[left.pop()] - found:
            found.add(name)
            left.append(name)
    return found
