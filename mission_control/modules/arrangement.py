"""Arrangement: the units of a mission file, with the computed connections between them.

The same modules may be put into other units; that changes only the arrangement.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence

import msgspec

from backbone.errors import Refusal, complaint
from backbone.exchange_course import UNPROVED
from backbone.import_faults import MEND
from backbone.mission.arranged import CLASS, Arranged, UnitFault, UnitsQuestion
from backbone.naming import Subsystem, address, did_you_mean
from backbone.quality import OutputQuality, Quality
from mission_control.modules.choice import CLASS_PATH as CHOICE
from mission_control.modules.choice import ChoiceOrder, choice_faults
from mission_control.modules.graph import OUTSIDE, Graph, GraphRefused, Member, WiringFault
from mission_control.modules.orders import (
    ModuleOrder,
    Running,
    Source,
    UnitParameters,
    is_message,
    load_at,
    output_address,
)
from mission_control.modules.ports import kinds_of_ports, type_name

_NAMED = re.compile(r"`(?:\$\.)?(\w+)`")  # the parameter in msgspec's error text


class UnitOrder(Running, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A unit.

    Attributes:
        name: Name of the component that runs the unit.
        modules: Its modules; unless connections demand otherwise, they run in this order.
        choices: Keys that get the values of one of several other keys.
    """

    name: str
    modules: list[ModuleOrder]
    choices: list[ChoiceOrder] = []


class GivenKey(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A key whose values come from outside.

    Attributes:
        type: Class of the values, ``package.module:Class``.
        source: Place of their publication.
    """

    type: str
    source: Source


class NoMessage(WiringFault):
    """Values that must cross the bus are not messages."""


class NoRounds(WiringFault):
    """A unit would never have a round; the port is the unit."""


class NoQuality(WiringFault):
    """A key cannot have its declared quality; the port is the key."""


def arranged(
    units: Sequence[UnitOrder], given: Mapping[str, GivenKey], qualities: Mapping[str, Quality] | None = None
) -> dict[str, UnitParameters]:
    """Return unit → parameters of the component that runs it.

    Outputs that another unit takes are published. Outputs that no module takes are published, too, if they are
    messages, for use by other components; and so are all sources of a choice.

    Raises:
        WrongModule: A class path does not name a module.
        GraphRefused: The modules cannot be connected; the error lists all faults.
    """
    given_kinds = {key: load_at(one.type) for key, one in given.items()}
    kinds = dict(given_kinds)
    members: dict[str, list[Member]] = {}
    for unit in units:
        members[unit.name] = [_member(one, kinds) for one in unit.modules]
    if found := [fault for unit in units for fault in choice_faults(unit.choices, kinds)]:
        raise GraphRefused(found)
    units = [_with_choices(unit, kinds, members[unit.name]) for unit in units]
    graph = Graph(members, {key: type_name(kind) for key, kind in given_kinds.items()})
    qualities = qualities or {}
    if found := [*_no_messages(graph, kinds), *_no_rounds(graph, units), *_no_qualities(qualities, kinds, given)]:
        raise GraphRefused(found)
    final = _final(units, members, kinds)
    parameters = {unit.name: _parameters(unit, graph, given, final) for unit in units}
    return {unit: _with_qualities(one, qualities) for unit, one in parameters.items()}


def _member(order: ModuleOrder, kinds: dict[str, object]) -> Member:
    """Return a module's place in the graph, and add the classes of its outputs to the kinds."""
    module = order.load()
    member, declared = order.member(module), kinds_of_ports(module.Outputs)
    for key, port in member.keyed_outputs:
        kinds.setdefault(key, declared[port.name])
    return member


def _with_choices(unit: UnitOrder, kinds: dict[str, object], members: list[Member]) -> UnitOrder:
    """Return the unit with its choosing modules, and add these to the members."""
    orders = [choice.order(kinds[choice.source]) for choice in unit.choices]
    members += [_member(order, kinds) for order in orders]
    return msgspec.structs.replace(unit, modules=[*unit.modules, *orders], choices=[])


def _final(
    units: Sequence[UnitOrder], members: Mapping[str, Sequence[Member]], kinds: Mapping[str, object]
) -> set[str]:
    """Return the keys that are published although no other unit takes them."""
    chooses = {one.name for unit in units for one in unit.modules if one.class_path == CHOICE}
    every = [member for of in members.values() for member in of]
    taken = {key: {one.name for one in every if key in dict(one.keyed_inputs)} for key in kinds}
    return {
        key
        for member in every
        for key, _port in member.keyed_outputs
        if is_message(kinds[key]) and (taken[key] & chooses or not taken[key] - {member.name})
    }


def _parameters(unit: UnitOrder, graph: Graph, given: Mapping[str, GivenKey], final: Collection[str]) -> UnitParameters:
    made = {key for member in graph.units[unit.name] for key, _port in member.keyed_outputs}
    return UnitParameters(
        **{name: getattr(unit, name) for name in Running.__struct_fields__},
        modules=unit.modules,
        sources={
            key: given[key].source
            if producer == OUTSIDE
            else Source(output_address(address(Subsystem.MISSION_CONTROL, producer), key))
            for key, producer in graph.into(unit.name).items()
        },
        published=sorted({*graph.out_of(unit.name), *(made & set(final))}),
    )


def _with_qualities(unit: UnitParameters, qualities: Mapping[str, Quality]) -> UnitParameters:
    own = {*unit.published, *unit.sources}
    return msgspec.structs.replace(unit, qualities={key: one for key, one in qualities.items() if key in own})


def _no_qualities(
    qualities: Mapping[str, Quality], kinds: Mapping[str, object], given: Mapping[str, GivenKey]
) -> Iterator[WiringFault]:
    for key, quality in qualities.items():
        if key not in kinds:
            detail = f"a quality is declared for {key}, which no module produces{did_you_mean(key, kinds)}"
            yield NoQuality((), key, detail, "Name the key of an output, or of a <given>")
        elif key in given and quality != OutputQuality(deadline_s=quality.deadline_s).quality:
            detail = f"{key} comes from {given[key].source.address}, which sends it in its own quality"
            yield NoQuality((), key, detail, "Declare nothing but a deadline for what is given from outside")


def _no_messages(graph: Graph, kinds: Mapping[str, object]) -> Iterator[WiringFault]:
    """Yield a fault for each value that cannot cross between units, at the module that takes it."""
    for one in graph.connections:
        if not is_message(kinds[one.key]):
            [taker, *_] = [m for m in graph.units[one.consumer] if one.key in dict(m.keyed_inputs)]
            port = dict(taker.keyed_inputs)[one.key].name
            detail = f"{taker.name} takes {one.key} from another unit, and its class {one.type} is no message"
            remedy = "Derive the class from backbone.wire:Message, or put both modules into one unit"
            yield NoMessage((taker.name,), port, detail, remedy)


def _no_rounds(graph: Graph, units: Sequence[UnitOrder]) -> Iterator[WiringFault]:
    for unit in units:
        if not unit.frequency_hz and not graph.awaited(unit.name):
            detail = f"unit {unit.name} never runs: it has no frequency, and no fresh input from outside"
            yield NoRounds((), unit.name, detail, 'Write frequency-hz="…"')


def judged(question: UnitsQuestion) -> Arranged:
    """Return the parameters of all units, or all faults."""
    units: list[UnitOrder] = []
    found: list[UnitFault] = []
    for declared in question.units:
        try:
            units.append(msgspec.convert(declared, UnitOrder))
        except msgspec.ValidationError as error:
            remedy = "Give the unit a frequency or an input, and a thread of its own if it needs one"
            found.append(UnitFault(str(error), remedy, unit=str(declared["name"])))
    given = {key: msgspec.convert(one, GivenKey) for key, one in question.given.items()}
    qualities = {key: msgspec.convert(one, OutputQuality).quality for key, one in question.qualities.items()}
    found += [fault for unit in units for order in unit.modules for fault in _of_class(order)]
    found += [fault for key, one in given.items() for fault in _of_given(key, one)]
    if found:
        return Arranged(faults=tuple(found))
    try:
        parameters = arranged(units, given, qualities)
    except GraphRefused as refused:
        return Arranged(faults=tuple(_of_graph(fault) for fault in refused.faults))
    return Arranged({unit: msgspec.to_builtins(one) for unit, one in parameters.items()})


def _of_class(order: ModuleOrder) -> Iterator[UnitFault]:
    try:
        order.load().ports()
    except Refusal as refusal:
        about = next((name for name in _NAMED.findall(refusal.detail) if name in order.parameters), CLASS)
        yield UnitFault(refusal.detail, refusal.remedy, module=order.name, port=about)
    except UNPROVED as error:  # a class that is being written raises anything
        told = f"{order.name} ({order.class_path}) cannot be made: {complaint(error)}"
        yield UnitFault(told, "Mend the class where the message points", module=order.name, port=CLASS)


def _of_given(key: str, declared: GivenKey) -> Iterator[UnitFault]:
    try:
        if not is_message(load_at(declared.type)):
            remedy = "Name a class that derives from backbone.wire:Message"
            yield UnitFault(f"{declared.type}, the class of {key}, is no message", remedy, given=key)
    except Refusal as refusal:
        remedy = MEND if refusal.remedy == MEND else "Write the class as package.module:Class"
        yield UnitFault(refusal.detail, remedy, given=key)


def _of_graph(fault: WiringFault) -> UnitFault:
    about, *_ = (*fault.modules, "")
    if isinstance(fault, NoQuality):
        return UnitFault(fault.detail, fault.remedy, quality=fault.port)
    if isinstance(fault, NoRounds):
        return UnitFault(fault.detail, fault.remedy, unit=fault.port)
    return UnitFault(fault.detail, fault.remedy, module=about, port=fault.port)
