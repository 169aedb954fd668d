"""Compatibility: which ARCs can hold their RCs together (rule 1).

An exclusive RC has one holder; on a sharable one every stream of every holder meets its deadline. Answers are cached;
``service_changed`` drops the answers that may have changed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.scheduling.entries import ArcEntry, RcEntry
from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.response_time import Analysis, admissible
from backbone.scheduling.streams import Stream, exceeds

SETS_REMEMBERED = 4096  # chosen: sets of users of one RC; a group of 30 has some hundred between two arrivals


class Compatibility:
    """Answers for the ARCs and RCs of one schedule.

    Attributes:
        admission: Test of the demand that a sharable RC can serve.
    """

    def __init__(
        self,
        rcs: Mapping[str, RcEntry],
        users: Mapping[str, Collection[ArcEntry]],
        admission: Analysis,
        roomy: dict[str, bool],
    ) -> None:
        """Begin with no answers.

        Args:
            users: RC → the active ARCs that use it.
            admission: Test of the demand that a sharable RC can serve.
            roomy: RC → known answer of ``has_room_for_all``; a change of ``users`` drops it.
        """
        self._rcs = rcs
        self._users = users
        self.admission: Analysis = admission
        self._usable: dict[ArcEntry, bool] = {}
        self._admitted: dict[str, dict[frozenset[ArcEntry], bool]] = {}
        self._roomy = roomy

    def fits(self, arc: ArcEntry, others: Iterable[ArcEntry]) -> bool:
        """Return whether the ARC can hold all its RCs together with these others."""
        beside = []
        for other in others:
            common = arc.touches & other.touches
            if common:
                if common & (arc.excludes | other.excludes):
                    return False
                beside.append(other)
        return not arc.shares or all(
            self.can_share(rc, [arc, *(other for other in beside if rc in other.uses)]) for rc in arc.shares
        )

    def usable(self, arc: ArcEntry) -> bool:
        """Return whether the ARC could run alone: its RCs are up and can serve it."""
        known = self._usable.get(arc)
        if known is None:
            known = self._usable[arc] = all(self._rcs[rc].up for rc in arc.uses) and self.fits(arc, ())
        return known

    def can_share(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        """Return whether the sharable RC can serve all of these."""
        return self.has_room_for_all(rc) or self._admissible(rc, users)

    def serves_measured(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        """Return whether the sharable RC can serve all of these with the packet times that were measured."""
        return self._serves(rc, users, [user.measured[rc] for user in users])

    def has_room_for_all(self, rc: str) -> bool:
        """Return whether the whole active demand fits at once (rule 15): then every part of it does."""
        if rc not in self._roomy:
            users = [*self._users.get(rc, ())]
            self._roomy[rc] = all(rc in user.shares for user in users) and self._admissible(rc, users)
        return self._roomy[rc]

    def service_changed(self, rcs: Iterable[str]) -> None:
        """Drop all answers about these RCs: their states, capacities or their users' priorities have changed."""
        for rc in rcs:
            self._roomy.pop(rc, None)
            self._admitted.pop(rc, None)
        self._usable.clear()

    def forget(self, arc: ArcEntry) -> None:
        """Drop the answers about an ARC that left."""
        self._usable.pop(arc, None)
        for rc in arc.uses:
            known = self._admitted.get(rc, {})
            for users in [users for users in known if arc in users]:
                del known[users]

    def _admissible(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        known = self._admitted.setdefault(rc, {})
        key = frozenset(users)
        if key not in known:
            if len(known) >= SETS_REMEMBERED:
                known.clear()
            known[key] = self._serves(rc, users, [user.streams[rc] for user in users])
        return known[key]

    def _serves(self, rc: str, users: Sequence[ArcEntry], demands: Sequence[Sequence[Stream]]) -> bool:
        capacity = self._rcs[rc].capacity
        streams = [
            (user, packets, number)
            for user, demand in zip(users, demands, strict=True)
            for number, packets in enumerate(demand)
        ]
        if exceeds(capacity, [packets for _, packets, _ in streams]):
            return False
        ranked = by_precedence(streams, lambda s: s[0].path, lambda s: (s[1].period_us, s[0].name, s[2]))
        return admissible([packets for _, packets, _ in ranked], capacity, self.admission)
