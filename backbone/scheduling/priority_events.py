"""Priority events: changes of the behavior tree and its numbers, and aging (rules 2 and 8)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import RenewLeases
from backbone.scheduling.preemption import overloading
from backbone.scheduling.priority_tree import PriorityTree, carried
from backbone.scheduling.requests import RequestState
from backbone.scheduling.rules import ROUNDING
from backbone.scheduling.transitions import Transitions

Place = tuple[str, ...]
"""Names from the root to a node."""


class PriorityEvents:
    """Applies changes of the tree."""

    def __init__(self, transitions: Transitions, tree: PriorityTree) -> None:
        self._decision, self._transitions, self._trace = transitions.decision, transitions, transitions.trace
        self._state, self._table = transitions.schedule.state, transitions.schedule.table
        self._tree = tree
        self._aging_s = transitions.rules.aging_s

    def priority_changed(self, node: str, priority: int) -> None:
        """Set the number of a node or console."""
        self._change(lambda: self._tree.change(node, priority))

    def node_moved(self, node: str, parent: str) -> None:
        """Move a node below another parent, if possible."""
        if self._tree.obstacle(node, parent):
            return
        old, new = self._tree.move(node, parent)
        self._trace.nodes_moved(old, new)
        self._change(moved=lambda place: carried(place, old, new))

    def age(self) -> None:
        """Raise ARCs that wait long, if the rules demand aging; they keep their level until they are served or idle.

        An ARC that its own parent keeps waiting does not rise, because its parent would rise with it.
        """
        rising = self._rising()
        for arc in self._state.arcs.values():
            if arc in rising:
                levels = int((self._decision.now_s - arc.since_s) / self._aging_s + ROUNDING)
                self._state.raise_to(arc, max(arc.raised, levels))  # it has some already if its slice was cut
            elif arc.served(self._decision.now_s) or not arc.active or arc.state is RequestState.WAITING:
                self._state.raise_to(arc, 0)
        if self._tree.age((arc.place_in_tree, arc.raised) for arc in self._state.arcs.values() if arc.raised):
            self._change()

    def next_aging_s(self) -> float | None:
        """Return when the next ARC rises; None if no ARC will."""
        return min((arc.since_s + (arc.raised + 1) * self._aging_s for arc in self._rising()), default=None)

    def _rising(self) -> dict[ArcEntry, None]:
        """Return the waiting ARCs that no active ARC of an ancestor in the tree keeps waiting."""
        arcs = self._state.arcs.values()
        active: dict[Place, list[ArcEntry]] = {}
        for arc in arcs:
            if arc.active:
                active.setdefault(arc.place_in_tree, []).append(arc)
        return {arc: None for arc in arcs if arc.state is RequestState.WAITING and not self._has_rival(arc, active)}

    def _has_rival(self, arc: ArcEntry, active: Mapping[Place, Sequence[ArcEntry]]) -> bool:
        """Return whether the ARC cannot run beside one of these that is above it in the tree."""
        place = arc.place_in_tree
        above = [other for depth in range(1, len(place)) for other in active.get(place[:depth], ())]
        return any(not self._table.fits(arc, [other]) for other in above)

    def _change(self, change: Callable[[], None] | None = None, moved: Callable[[Place], Place] | None = None) -> None:
        """Change the tree, move ARCs, and apply the numbers of the tree from now on."""
        if change is not None:
            change()
        places = [(arc, moved(arc.place_in_tree) if moved else arc.place_in_tree) for arc in self._state.arcs.values()]
        self._state.set_paths([(arc, place, self._tree.path(place)) for arc, place in places])
        for names in self._trace.nodes():
            self._trace.introduce_nodes(self._tree.path(names))
        for rc in self._state.rcs.values():
            for holder in overloading(self._table, rc.name) if rc.sharable else ():
                self._transitions.revoke(holder, "order", rc.name)
        self._decision.instructions.append(RenewLeases())

    def renumber(self) -> None:
        """Set the present numbers of their nodes in all ARCs."""
        arcs = self._state.arcs.values()
        self._state.set_paths([(arc, arc.place_in_tree, self._tree.path(arc.place_in_tree)) for arc in arcs])
