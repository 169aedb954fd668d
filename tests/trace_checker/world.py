"""All RCs and ARCs of a trace, and which sets of ARCs fit on an RC together."""

from __future__ import annotations

from collections.abc import Iterable

from .admission import Stream, all_in_time, within_capacity
from .priority_order import NodeTree, connected, higher, ranked
from .state import HOLDING, Arc, Phase, Rc


class World:
    """What holds at the line that was read last.

    Attributes:
        rcs: RC name → RC.
        arcs: ARC name → ARC that has asked and not left.
        nodes: The behavior tree.
    """

    def __init__(self) -> None:
        self.rcs: dict[str, Rc] = {}
        self.arcs: dict[str, Arc] = {}
        self.nodes = NodeTree()
        self._higher: dict[tuple[Arc, Arc], bool] = {}
        self._fits: dict[tuple[str, frozenset[Arc]], bool] = {}
        self._groups: list[list[Arc]] | None = None

    def forget(self) -> None:
        """Work out again all that depends on requests, numbers and capacities."""
        self._higher.clear()
        self._fits.clear()
        self._groups = None

    def forget_groups(self) -> None:
        self._groups = None

    def is_higher(self, one: Arc, other: Arc) -> bool:
        known = self._higher.get((one, other))
        if known is None:
            known = self._higher[one, other] = higher(one.path, other.path)
        return known

    def are_equal(self, one: Arc, other: Arc) -> bool:
        return not self.is_higher(one, other) and not self.is_higher(other, one)

    def is_usable(self, arc: Arc) -> bool:
        """Whether its RCs are up and it would fit on them alone."""
        return all(self.rcs[rc].up and self.fits(rc, (arc,)) for rc in arc.uses)

    def fits(self, rc: str, arcs: Iterable[Arc]) -> bool:
        """Whether these ARCs can hold the RC at the same time."""
        together = frozenset(arcs)
        known = self._fits.get((rc, together))
        if known is None:
            known = self._fits[rc, together] = self.why_not(rc, together) == ""
        return known

    def why_not(self, rc: str, together: frozenset[Arc]) -> str:
        """Return which rule forbids that they hold the RC together, or nothing."""
        of = self.rcs[rc]
        if len(together) > 1 and (not of.sharable or any(not arc.uses[rc] for arc in together)):
            return "EXCL"
        if not of.sharable or any(not arc.uses[rc] for arc in together):
            return ""
        streams = self._streams(rc, together)
        if not within_capacity(streams, of.capacity):
            return "CAP"
        return "" if all_in_time(streams) else "RTA"

    def _streams(self, rc: str, arcs: Iterable[Arc]) -> tuple[Stream, ...]:
        sent = [(arc, stream, place) for arc in arcs for place, stream in enumerate(arc.uses[rc])]
        order = ranked(
            sent,
            lambda one, other: self.is_higher(one[0], other[0]),
            lambda one: (one[1].period, one[0].name, one[2]),
        )
        return tuple(stream for _, stream, _ in order)

    def keepers(self, rc: str) -> list[Arc]:
        """Return the ARCs that connect or run on the RC."""
        return [arc for arc in self.rcs[rc].holders.values() if arc.phase in HOLDING]

    def conflict(self, one: Arc, other: Arc) -> bool:
        """Whether the two can never run at the same time."""
        return any(rc in other.uses and not self.fits(rc, (one, other)) for rc in one.uses)

    def groups(self) -> list[list[Arc]]:
        """Return the groups of active ARCs, each in the order of its plan."""
        if self._groups is None:
            active = [arc for arc in self.arcs.values() if arc.phase not in (Phase.IDLE, Phase.GONE)]
            self._groups = [self._in_order(group) for group in connected(active, lambda arc: arc.uses)]
        return self._groups

    def group_of(self, arc: Arc) -> list[Arc]:
        return next((group for group in self.groups() if arc in group), [arc])

    def forget_holder(self, arc: Arc) -> None:
        for rc in arc.uses:
            self.rcs[rc].holders.pop(arc.name, None)

    def _in_order(self, group: list[Arc]) -> list[Arc]:
        """Return those that wait or are being revoked in the order of the plan, then the others.

        An ARC that runs holds back no ARC in this order: it is in no plan, and in the way where it holds RCs.
        """
        queue = [arc for arc in group if arc.wants and arc.phase not in HOLDING]
        return ranked(queue, self.is_higher, lambda arc: arc.rank) + [arc for arc in group if arc not in queue]

    def ranked_with_last(self, group: list[Arc], last: Arc) -> list[Arc]:
        """Return the order of the plan if this ARC were the youngest of the group."""
        return ranked(group, self.is_higher, lambda arc: (arc is last, arc.rank))
