"""Consistency checks of the behavior tree: types, parameters, and the ARCs its nodes claim."""

from __future__ import annotations

from backbone.component.abilities import NO_ABILITIES
from backbone.mission.behavior_orders import TREE_PARAMETERS
from backbone.mission.class_facts import ANY_ARC, ClassFacts
from backbone.mission.document import Element
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission.parameter_checks import check_class_parameters
from backbone.mission.place_checks import check_places
from backbone.mission.reading_checks import check_named, check_own_branch, check_readings
from backbone.mission.report import Report, listed
from backbone.mission.tables import (
    Tables,
    check_multiplicity,
    check_parameters,
    check_unique,
    is_known,
    parameter_value,
)
from backbone.naming import Subsystem
from backbone.scheduling.run_times import SHORTEST_RUNTIME_S
from backbone.spoken import counted

TRIES_AT_MOST = 100_000  # chosen: a third of a second; a set that fits is found in the first few tries


def check_behaviors(tables: Tables, report: Report) -> None:
    """Report every fault in the behavior tree."""
    of_one: dict[str, Element] = {}
    behavior_types = [
        known
        for known in tables.types
        if tables.belongs_to(known, Subsystem.MISSION_CONTROL) and known != EXECUTION_UNIT
    ]
    for behavior in tables.behaviors:
        kind, name = behavior.text("type"), behavior.text("name")
        if name and name == tables.root.text("name"):
            report.fault(
                behavior.place_of("name"),
                f"behavior {name} has the name of the mission, which is its tree's root",
                "Choose another name",
            )
        if kind in tables.types and kind not in behavior_types:
            report.fault(
                behavior.place_of("type"),
                f"type {kind} is no behavior",
                f"Behaviors are types of subsystem mission_control: {listed(behavior_types) or 'there is none'}",
            )
            continue
        if is_known(behavior, "type", "type of behavior", behavior_types, report):
            check_multiplicity(behavior, "type", kind, tables, of_one, report)
        facts = tables.facts_of(kind)
        if facts is not None and not set(TREE_PARAMETERS) <= set(facts.given):
            report.fault(
                behavior.place_of("type"),
                f"type {kind} is no behavior: its class {tables.types[kind].text('class')} is none",
                "Derive the class from mission_control.behavior:Behavior",
            )
            continue
        check_parameters(behavior, TREE_PARAMETERS, report)
        check_class_parameters(behavior, TREE_PARAMETERS, tables, report)
        _check_inside(behavior, tables, report)
        check_readings(behavior, tables, report)
        check_own_branch(behavior, tables, report)
        check_named(behavior, tables, report)
        check_places(behavior, tables, report)
    sets = _Sets(tables)
    arc_kinds = [name for name in tables.types if tables.needs(name)]
    for behavior, arc in tables.claims():
        _check_runtime(behavior, arc, report)
        if not is_known(arc, "kind", "kind of ARC", arc_kinds, report):
            continue
        check_multiplicity(arc, "kind", arc.text("kind"), tables, of_one, report)
        if _wishes_fit(arc, tables, report):
            _check_set(behavior, arc, tables, sets, report)


def _check_inside(behavior: Element, tables: Tables, report: Report) -> None:
    """Report children and an ARC that the behavior's class does not allow."""
    facts = tables.facts_of(behavior.text("type"))
    if facts is None:
        return
    if not facts.may_claim and (arc := behavior.first("arc")) is not None:
        report.fault(arc.place, f"{behavior.text('type')} {behavior.text('name')} needs no ARC", "Remove it")
    _check_needed(behavior, facts.needs_arc, tables, report)
    if facts.children is None:
        return
    (fewest, most), given = facts.children, behavior.all("behavior")
    if fewest <= len(given) <= most:
        _check_counts(behavior, facts, report)
        return
    wanted = "none" if most == 0 else "exactly one" if fewest == most == 1 else f"{fewest} to {most}"
    report.fault(
        given[most].place if len(given) > most else behavior.place,
        f"{behavior.text('type')} {behavior.text('name')} has {counted(len(given), 'behavior')} inside",
        f"Give it {wanted}",
    )


def _check_counts(behavior: Element, facts: ClassFacts, report: Report) -> None:
    """Report numbers of children that are never reached, because the behavior has fewer."""
    counts = {one.name: one for one in facts.parameters if one.schema.get("counts") == "children"}
    there = len(behavior.all("behavior"))
    for parameter in behavior.all("parameter"):
        one, value = counts.get(parameter.text("name")), parameter_value(parameter.text("value"))
        if one is not None and isinstance(value, int) and value > there and one.accepts(value):
            report.fault(
                parameter.place_of("value"),
                f"{one.name} is {value}, but {behavior.text('name')} has {counted(there, 'behavior')} inside",
                f"Write at most {there}, or -1 for all",
            )


def _check_needed(behavior: Element, needed: str, tables: Tables, report: Report) -> None:
    """Report a behavior without the ARC, or without the pictures, that its class needs."""
    arc, like = behavior.first("arc"), tables.facts_of(needed)
    kinds = [name for name in tables.types if tables.needs(name)]
    if needed not in ("", ANY_ARC, *kinds):
        report.fault(
            behavior.place_of("type"),
            f"the class of {behavior.text('type')} needs an ARC of kind {needed!r}, and there is none"
            f"{report.hint(needed, kinds)}",
            f"Write one of these as needs_arc in the class: {listed(kinds)}",
        )
    elif needed and arc is None:
        report.fault(
            behavior.place,
            f"{behavior.text('type')} {behavior.text('name')} has no ARC, and needs one",
            'Write into it <arc kind="…" minimum-runtime-s="5"/>; without an ARC act does not run'
            if needed == ANY_ARC
            else f'Write into it <arc kind="{needed}" minimum-runtime-s="5"/>, or one of a similar kind',
        )
    claimed = None if arc is None else tables.facts_of(arc.text("kind"))
    if arc is None or claimed is None or like is None or claimed.abilities == NO_ABILITIES:
        return
    if like.abilities.gives_pictures and not claimed.abilities.gives_pictures:
        report.fault(
            arc.place_of("kind"),
            f"an ARC of kind {arc.text('kind')} gives no pictures, which {behavior.text('name')} needs",
            f'Write kind="{needed}", or another kind with pictures',
        )


def _check_runtime(behavior: Element, arc: Element, report: Report) -> None:
    minimum_s, maximum_s = arc.number("minimum-runtime-s"), arc.number("maximum-runtime-s")
    if minimum_s is not None and 0 < minimum_s < SHORTEST_RUNTIME_S:
        report.fault(
            arc.place_of("minimum-runtime-s"),
            f"minimum run time {minimum_s:g} s of {behavior.text('name')} is shorter than a context switch",
            f"Write at least {SHORTEST_RUNTIME_S:g}",
        )
    if minimum_s is not None and maximum_s is not None and 0 < maximum_s < minimum_s:
        report.fault(
            arc.place_of("maximum-runtime-s"),
            f"maximum run time {maximum_s:g} s of {behavior.text('name')} is less than the minimum, {minimum_s:g} s",
            "Write at least the minimum, or leave it out",
        )


def _wishes_fit(arc: Element, tables: Tables, report: Report) -> bool:
    """Report wishes that no resource can fulfil; return whether all can be fulfilled."""
    kind, needs = arc.text("kind"), tables.needs(arc.text("kind"))
    wishes = arc.all("wish")
    check_unique(wishes, "type", "wish for type", report)
    fits = True
    for wish in wishes:
        wanted, name, features = wish.text("type"), wish.text("name"), wish.words("features")
        if wanted not in needs:
            fits = False
            roles = {*tables.types, *needs}
            if is_known(wish, "type", "component type", roles, report):
                report.fault(
                    wish.place_of("type"),
                    f"an ARC of kind {kind} has no {wanted}{report.hint(wanted, needs)}",
                    f"It needs: {listed(needs)}",
                )
            continue
        there = tables.resources_of(needs[wanted])
        if name and not is_known(wish, "name", wanted, [resource.text("name") for resource in there], report):
            fits = False
            continue
        if not name and not features:
            report.fault(
                wish.place,
                f"a wish for a {wanted} without name and features",
                "Add a name or features, or remove the wish",
            )
        candidates = [tables.resources[name]] if name else there
        if there and not any(_has(resource, features) for resource in candidates):
            fits = False
            known = sorted({feature for resource in candidates for feature in resource.words("features")})
            hints = "".join(report.hint(feature, known) for feature in features if feature not in known)
            report.fault(
                wish.place_of("features"),
                f"{name or f'no {wanted}'} {'lacks' if name else 'has'} {listed(features)}{hints}",
                f"There is: {listed(known) or 'no feature at all'}",
            )
    for needed in dict.fromkeys(needs.values()):
        if not tables.resources_of(needed) and tables.is_resource_type(needed):
            fits = False
            report.fault(
                arc.place_of("kind"),
                f"an ARC of kind {kind} needs a {needed}, but the mission has none",
                f'Add <resource type="{needed}" name="…"/>, or claim another kind',
            )
    return fits


def _check_set(behavior: Element, arc: Element, tables: Tables, sets: _Sets, report: Report) -> None:
    """Report a demand that no sharable resource can serve, and resources that cannot be used together."""
    kinds = tables.needs(arc.text("kind"))
    needs = [role for role, kind in kinds.items() if tables.resources_of(kind)]
    wishes = {wish.text("type"): wish for wish in arc.all("wish")}
    roles = {
        needed: [resource for resource in tables.resources_of(kinds[needed]) if _wanted(resource, wishes.get(needed))]
        for needed in needs
    }
    demand = _check_demand(behavior, arc, report)
    if demand is None:
        return
    enough = {
        needed: [resource for resource in candidates if not resource.flag("sharable") or demand <= _capacity(resource)]
        for needed, candidates in roles.items()
    }
    tight = [needed for needed in needs if not enough[needed]]
    for needed in tight:
        best = max(_capacity(resource) for resource in roles[needed])
        report.fault(
            arc.place_of("period-s"),
            f"{behavior.text('name')} alone asks for {demand:.0%} of a {needed}; "
            f"{listed([resource.text('name') for resource in roles[needed]])} can give {best:.0%}",
            "Write a longer period-s or a shorter packet-time-s, or raise the capacity",
        )
    if not tight and not sets.any_fits(list(enough.values())):
        report.fault(
            arc.place_of("kind"),
            f"no {listed(needs)} that {behavior.text('name')} may have can be used together",
            "Look at the <uses> of these resources, or wish for others",
        )


def _check_demand(behavior: Element, arc: Element, report: Report) -> float | None:
    """Return the share of a sharable resource that the ARC asks for; None if it is unknown or already a fault."""
    period_s, packet_time_s = arc.number("period-s"), arc.number("packet-time-s")
    if period_s is None or packet_time_s is None or period_s <= 0 or packet_time_s <= 0:
        return None
    if packet_time_s > period_s:
        report.fault(
            arc.place_of("packet-time-s"),
            f"a packet of {behavior.text('name')} takes {packet_time_s:g} s, but the next is due after {period_s:g} s",
            "Write a longer period-s or a shorter packet-time-s",
        )
        return None
    return packet_time_s / period_s


class _Sets:
    """Searches for compatible resources, one of each role, with a limited number of tries for a whole file."""

    def __init__(self, tables: Tables) -> None:
        self._tables, self._tries_left = tables, TRIES_AT_MOST

    def any_fits(self, roles: list[list[Element]]) -> bool:
        """Return whether a set fits; True if the search is too long, because the dependency database will decide."""
        return self._extend([], roles)

    def _extend(self, chosen: list[Element], roles: list[list[Element]]) -> bool:
        if len(chosen) == len(roles):
            return True
        for candidate in roles[len(chosen)]:
            if self._tries_left == 0:
                return True
            self._tries_left -= 1
            fits = all(
                _together(candidate, other, self._tables) and _together(other, candidate, self._tables)
                for other in chosen
            )
            if fits and self._extend([*chosen, candidate], roles):
                return True
        return False


def _together(resource: Element, other: Element, tables: Tables) -> bool:
    if resource is other:
        return False
    named = [used.text("name") for used in resource.all("uses") if used.text("type") == other.text("type")]
    if not all(tables.is_resource_of(name, other.text("type")) for name in named):
        return True  # an unknown name is already reported
    return not named or other.text("name") in named


def _capacity(resource: Element) -> float:
    capacity = resource.number("capacity")
    return capacity if capacity is not None and 0 < capacity <= 1 else 1.0  # an illegal one is already reported


def _wanted(resource: Element, wish: Element | None) -> bool:
    if wish is None:
        return True
    return wish.text("name") in ("", resource.text("name")) and _has(resource, wish.words("features"))


def _has(resource: Element, features: list[str]) -> bool:
    return set(features) <= set(resource.words("features"))
