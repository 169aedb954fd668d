"""The page's views of a draft: plain values, ready for JSON.

Pure: a draft goes in, views come out.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from backbone.dry_run.run import DryRun
from backbone.mission.class_facts import ClassFacts
from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.edit import Element, Path
from backbone.scheduling.rehearsal import Run
from backbone.spoken import counted
from ui_console.design.catalogue import Role, TypeEntry, description, entries
from ui_console.design.draft import Draft
from ui_console.design.offers import Offer, Prompt, offers
from ui_console.design.properties import Property, class_of, properties

ROLES_ADDED = (Role.BEHAVIOR, Role.ARC, Role.RESOURCE)
GROUPS = {Role.BEHAVIOR: "behaviors", Role.ARC: "ARCs", Role.RESOURCE: "resources"}
WISHES, ROOM = "wishes", "the room"


class DesignerWelcomed(msgspec.Struct, frozen=True):
    """The person was authenticated."""

    user: str


class DraftStatus(msgspec.Struct, frozen=True):
    """State of the draft.

    Attributes:
        source: The mission file.
        revision: Counts changes; a change names its revision.
        is_changed: True: the draft differs from the file.
        is_new: True: there is no such file yet.
        problems: Number of faults ``scout-backbone check`` would report.
        can_undo: True: there is a change to undo.
        can_redo: True: there is an undone change.
        changed_by: Author of the last change; empty: none yet.
    """

    source: str
    revision: int
    is_changed: bool
    is_new: bool
    problems: int
    can_undo: bool
    can_redo: bool
    changed_by: str


class ElementRow(msgspec.Struct, frozen=True):
    """A row of the tree: one element.

    Attributes:
        path: Its path.
        tag: Its tag.
        told: Words that distinguish it from its siblings.
        problems: Faults of it and its parameters, with remedies.
    """

    path: Path
    tag: str
    told: str
    problems: tuple[str, ...]


class ProblemRow(msgspec.Struct, frozen=True):
    """A problem, as ``scout-backbone check`` reports it.

    Attributes:
        line: Line in the text to be saved, from 1.
        column: Column, from 1.
        message: The fault.
        remedy: Advice.
        path: Its element.
    """

    line: int
    column: int
    message: str
    remedy: str
    path: Path


class PaletteRow(msgspec.Struct, frozen=True):
    """A possible addition.

    Attributes:
        label: Its offer's, see ``offers``.
        group: Heading of its group.
        name: Its name on the page.
        tag: Of its element.
        type: Component type whose class can be looked up; empty: none.
        is_known: True: its class was looked up.
        doc: Its meaning, as lines.
    """

    label: str
    group: str
    name: str
    tag: str
    type: str
    is_known: bool
    doc: tuple[str, ...]


class OfferView(msgspec.Struct, frozen=True):
    """A possible addition here, or to an ancestor."""

    label: str
    doc: str
    asks: tuple[Prompt, ...]


class ElementView(msgspec.Struct, frozen=True):
    """The element a person has chosen.

    Attributes:
        path: Its path.
        tag: Its tag.
        told: Words that distinguish it from its siblings.
        line: Its line in the text.
        doc: Meaning of its tag.
        type_doc: Documentation of its component's class, as lines; may be empty.
        properties: Its attributes and parameters.
        offers: Possible additions to it, or to its ancestors.
    """

    path: Path
    tag: str
    told: str
    line: int
    doc: str
    type_doc: tuple[str, ...]
    properties: tuple[Property, ...]
    offers: tuple[OfferView, ...]


class TurnView(msgspec.Struct, frozen=True):
    """A turn of an ARC with a resource.

    Attributes:
        from_s: Time at which its RCs began to settle.
        open_s: Time at which the gate opened; ``to_s`` if it never opened.
        to_s: Time at which the resource was free again.
        who: In an ARC's row, the resources that it used; else the ARC.
    """

    from_s: float
    open_s: float
    to_s: float
    who: str


class RehearsalRow(msgspec.Struct, frozen=True):
    """One ARC or resource and its turns."""

    name: str
    is_arc: bool
    turns: tuple[TurnView, ...]


class RehearsalView(msgspec.Struct, frozen=True):
    """The mission's first minute.

    Attributes:
        end_s: Its length, mission seconds.
        rows: ARCs, then resources.
        told: Outcome of each request, one line each.
        never: Requests that never run and components without a host, with the reason.
    """

    end_s: float
    rows: tuple[RehearsalRow, ...]
    told: tuple[str, ...]
    never: tuple[str, ...]


def status_view(draft: Draft, revision: int, changed_by: str) -> DraftStatus:
    """Return the state of a draft.

    Args:
        revision: Number of changes.
        changed_by: Author of the last change.
    """
    return DraftStatus(
        draft.source,
        revision,
        draft.is_changed,
        is_new=draft.saved is None,
        problems=len(draft.problems),
        can_undo=bool(draft.past),
        can_redo=bool(draft.future),
        changed_by=changed_by,
    )


def tree_view(draft: Draft) -> list[ElementRow]:
    """Return every element except parameters, in the order of the text, each with its problems."""
    about: dict[Path, list[str]] = {}
    for fault in draft.problems:
        path = draft.element_of(fault)
        shown = path[:-1] if draft.mission.at(path).tag == "parameter" else path
        about.setdefault(shown, []).append(f"{fault.message} ({fault.remedy})")
    return [
        ElementRow(node.path, node.tag, summary(node), tuple(about.get(node.path, ())))
        for node in draft.mission
        if node.tag != "parameter"
    ]


def summary(node: Element) -> str:
    """Return a few words that distinguish an element from its siblings."""
    words = [node.text(name) for name in ("name", "type", "kind") if node.text(name)]
    if node.tag in ("wish", "uses"):
        words = [part for part in (node.text("type"), node.text("name"), node.text("features")) if part]
    if node.text("priority"):
        words.append(f"priority {node.text('priority')}")
    if node.text("minimum-runtime-s"):
        words.append(f"at least {node.text('minimum-runtime-s')} s")
    if node.text("within-s"):
        words.append(f"within {node.text('within-s')} s")
    if node.text("x-m"):
        words.append(f"at {node.text('x-m')}, {node.text('y-m')}")
    if node.text("width-m") and not node.text("x-m"):
        words.append(f"{node.text('width-m')} m × {node.text('depth-m')} m")
    return " ".join(words)


def problems_view(draft: Draft) -> list[ProblemRow]:
    """Return all problems in the order of the text."""
    return [
        ProblemRow(fault.line, fault.column, fault.message, fault.remedy, draft.element_of(fault))
        for fault in draft.problems
    ]


def places() -> dict[str, list[str]]:
    """Return for each tag the tags of its children."""
    return {tag: list(rule.children) for tag, rule in vocabulary().items()}


def palette(mission: Element, facts: Mapping[str, ClassFacts]) -> list[PaletteRow]:
    """Return the rows that a person can drag into the tree: component types, wishes for resources, parts of a room.

    Args:
        mission: The designed file.
        facts: Class path → facts of the class.
    """
    at_hand = entries(mission)
    found = [_type_row(entry, facts) for role in ROLES_ADDED for entry in at_hand if entry.role is role]
    found += [
        PaletteRow(f"wish {kind}", WISHES, kind, "wish", "", is_known=True, doc=(vocabulary()["wish"].documentation,))
        for kind in dict.fromkeys(need for entry in at_hand if entry.role is Role.ARC for need in entry.needs)
    ]
    inside = [tag for tag in vocabulary()["world"].children if tag != "parameter"]
    tags = inside if mission.first("world") is not None else ["world", *inside]
    return found + [
        PaletteRow(tag, ROOM, tag, tag, "", is_known=True, doc=(vocabulary()[tag].documentation,)) for tag in tags
    ]


def element_view(draft: Draft, path: Path, facts: Mapping[str, ClassFacts]) -> ElementView:
    """Return the view of one element.

    Args:
        path: The element; must exist.
        facts: Class path → facts of the class.
    """
    mission = draft.mission
    node = mission.at(path)
    rule = vocabulary().get(node.tag)
    known = facts.get(class_of(mission, node)) if node.text("type") else None
    docs = {_label(one): facts[one.class_path].doc for one in entries(mission) if one.class_path in facts}
    return ElementView(
        path,
        node.tag,
        summary(node),
        node.place.line,
        "" if rule is None else rule.documentation,
        () if known is None else tuple(known.doc.splitlines()),
        tuple(properties(mission, node, facts)),
        tuple(offer_view(offer, docs.get(offer.label, "")) for offer in offers(mission, path)),
    )


def offer_view(offer: Offer, class_doc: str = "") -> OfferView:
    """Return an offer without its command.

    Args:
        class_doc: Documentation of its type's class; the first line is shown. Empty: not known.
    """
    return OfferView(offer.label, class_doc.partition("\n")[0] or offer.doc, offer.asks)


def rehearsal_view(dry: DryRun) -> RehearsalView:
    """Return the turns of a dry run; for its last branch, only the outcome of each request."""
    seen = dry.timetable
    arcs = [
        RehearsalRow(one.arc, is_arc=True, turns=tuple(_turn(run, ", ".join(run.uses)) for run in seen.of_arc(one.arc)))
        for one in dry.claimed
    ]
    rcs = [
        RehearsalRow(rc, is_arc=False, turns=tuple(_turn(run, run.arc) for run in seen.runs if rc in run.uses))
        for rc in seen.utilization()
    ]
    told = [
        f"{one.arc}: {counted(one.turns, 'turn')}, longest wait {one.worst_wait_s:.1f} s, with {', '.join(one.rcs)}"
        for one in dry.claimed
        if not one.never_runs
    ]
    never = [
        f"{one.arc} never runs: {one.refused or 'nothing of what it needs is ever left over'}"
        for one in dry.claimed
        if one.never_runs
    ]
    never += [f"{one.name} has no host: {'; '.join(one.reasons)}" for one in dry.placed if not one.host]
    if dry.last is not None:
        of_last = rehearsal_view(dry.last)
        told += [f"last branch {dry.last_name}: {line}" for line in of_last.told]
        never += [f"last branch {dry.last_name}: {line}" for line in of_last.never if line not in never]
    return RehearsalView(seen.end_s, tuple(arcs + rcs), tuple(told), tuple(never))


def _type_row(entry: TypeEntry, facts: Mapping[str, ClassFacts]) -> PaletteRow:
    return PaletteRow(
        _label(entry),
        GROUPS[entry.role],
        entry.name,
        _tag(entry),
        entry.name,
        is_known=entry.class_path in facts,
        doc=tuple(description(entry, facts)),
    )


def _tag(entry: TypeEntry) -> str:
    return "arc" if entry.role is Role.ARC else str(entry.role)


def _label(entry: TypeEntry) -> str:
    """Return the label of the offer of this type."""
    return f"{_tag(entry)} {entry.name}"


def _turn(run: Run, who: str) -> TurnView:
    return TurnView(run.connect_s, run.free_s if run.grant_s is None else run.grant_s, run.free_s, who)
