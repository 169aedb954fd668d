"""Checks whether a module can replace another one; reports all faults at once. Pure.

Rules of this file:

* Both have the same outputs by key and class, and the new one has all inputs of the old one, fed in the same way.
* The new one may have further inputs if they are optional, their keys exist in the unit, and they do not begin rounds,
because one module must not change when the unit runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import get_origin

from backbone.errors import defined_at
from backbone.wire import WIRE_VERSION, Envelope, Message, Reader, write
from mission_control.modules.graph import Graph, GraphRefused, Member, WiringFault
from mission_control.modules.module import Module
from mission_control.modules.orders import WrongModule, is_message, unsendable
from mission_control.modules.ports import Port, kinds_of_ports, type_name


class OtherPorts(WiringFault):
    """A module has other ports than the one that it should replace."""


def graph_with(graph: Graph, unit: str, new: Member) -> Graph:
    """Return the graph of a unit in which this member replaces the one of the same name.

    Raises:
        GraphRefused: The member does not fit; the error lists all faults.
    """
    members = graph.units[unit]
    [old] = [one for one in members if one.name == new.name]
    produced = {key for one in members for key, _port in one.keyed_outputs}
    if found := [*_of_outputs(old, new), *_of_inputs(old, new, produced | set(graph.given))]:
        raise GraphRefused(found)
    changed = Graph({unit: [new if one is old else one for one in members]}, graph.given)
    if extra := changed.awaited(unit) - graph.awaited(unit):
        key = min(extra)
        detail = f"{new.name} would begin rounds of {unit} when {key} comes, and the old one does not"
        raise GraphRefused([OtherPorts((new.name,), key, detail, "Mark the input as LATEST")])
    return changed


def _of_outputs(old: Member, new: Member) -> Iterator[WiringFault]:
    had, has = dict(old.keyed_outputs), dict(new.keyed_outputs)
    yield from _missing(new.name, "output", had, has)
    for key, port in has.items():
        if key not in had:
            detail = f"{new.name} has an output {key} ({port.type}), which the old one has not"
            yield OtherPorts((new.name,), port.name, detail, "Leave it out, or change the mission file")
        elif port.type != had[key].type:
            yield _other_type(new.name, key, port, had[key])


def _of_inputs(old: Member, new: Member, known: set[str]) -> Iterator[WiringFault]:
    had, has = dict(old.keyed_inputs), dict(new.keyed_inputs)
    yield from _missing(new.name, "input", had, has)
    for key, port in has.items():
        if key in had:
            if port.type != had[key].type:
                yield _other_type(new.name, key, port, had[key])
            if _fed(port) != _fed(had[key]):
                detail = f"{new.name} has {key} as a {_fed(port)} input, the old one as a {_fed(had[key])} one"
                yield OtherPorts((new.name,), port.name, detail, "Declare it as the old one does")
        elif port.is_required:
            detail = f"{new.name} needs {key} ({port.type}), which the old one does not"
            yield OtherPorts((new.name,), port.name, detail, "Give the input a default, or change the mission file")
        elif key not in known:
            detail = f"{new.name} takes {key} ({port.type}), which does not come into this unit"
            yield OtherPorts((new.name,), port.name, detail, f"There is: {', '.join(sorted(known)) or 'nothing'}")


def _missing(name: str, what: str, had: Mapping[str, Port], has: Mapping[str, Port]) -> Iterator[WiringFault]:
    for key, port in had.items():
        if key not in has:
            detail = f"{name} has no {what} {key} ({port.type}), which the old one has"
            yield OtherPorts((name,), "", detail, "Declare it, or give a port this key with Key")


def _other_type(name: str, key: str, port: Port, had: Port) -> WiringFault:
    detail = f"{name} has {port.type} as {key}, the old one {had.type}"
    return OtherPorts((name,), port.name, detail, "Declare the same class")


def _fed(port: Port) -> str:
    return f"{'required' if port.is_required else 'optional'} {'latest' if port.is_latest else 'fresh'}"


def kinds_made(module: Module | type[Module], member: Member) -> dict[str, object]:
    """Return key → class of the values that a module makes."""
    kinds = kinds_of_ports(module.Outputs)
    return {key: kinds[port.name] for key, port in member.keyed_outputs}


def judge_of(kinds: Mapping[str, object], kind: type[Module], member: Member) -> Callable[[object], None]:
    """Return a function that raises if what the ``update`` of a module of this class returned are no outputs.

    Args:
        kinds: Key → class of its values, as declared by the modules that take them.
    """
    wanted = [(port, key, kinds[key]) for key, port in member.keyed_outputs]

    def wrong(returned: str, remedy: str) -> WrongModule:
        return WrongModule(f"update of {member.name} returned {returned} ({defined_at(kind.update)})", remedy=remedy)

    def judge(outputs: object) -> None:
        if not isinstance(outputs, kind.Outputs):
            names = ", ".join(f"{port.name}=…" for port, _, _ in wanted)
            raise wrong(f"{type_name(type(outputs))}, not its Outputs", f"Write 'return self.Outputs({names})'.")
        for port, key, of in wanted:
            value = getattr(outputs, port.name)
            if value is None and port.is_required:
                remedy = "Give an output that may be left out the default None: 'name: Class | None = None'."
                raise wrong(f"None as {key}, which each round must have", remedy)
            if value is not None and not is_of(value, of):
                remedy = "Return the declared class, made in update; classes of values stay those that run."
                raise wrong(f"{type_name(type(value))} as {key}, not {type_name(of)}", remedy)

    return judge


def is_of(value: object, kind: object) -> bool:
    """Return whether the value is of the class, as far as this can be checked; other processes read no subclass."""
    if is_message(kind):
        return type(value) is kind
    if get_origin(kind) is not None or not isinstance(kind, type):
        return True
    try:
        return isinstance(value, (float, int) if kind is float else kind)
    except TypeError:  # a protocol, a typed dictionary, Any
        return True


def judge_of_sent(
    source: str, most_bytes: Mapping[str, int], kinds: Mapping[str, type[Message]], member: Member
) -> Callable[[object], None]:
    """Return a function that raises if an output cannot be published, or its listeners could not read it.

    Args:
        source: Address of the sender.
        most_bytes: Key of a published output → longest message.
        kinds: Key → class that listeners expect.
    """
    sent = [(port.name, key, Reader(kinds[key])) for key, port in member.keyed_outputs if key in most_bytes]

    def judge(outputs: object) -> None:
        for name, key, reader in sent:
            value = getattr(outputs, name)
            if value is None:
                continue
            most = most_bytes[key]
            try:
                reader.read(write(Envelope(WIRE_VERSION, source, 1, 0.0, "", value), most), most)
            except Exception as error:  # also a field of a class that no message may have
                raise unsendable(f"update of {member.name} returned {key}, which", key, error) from error

    return judge
