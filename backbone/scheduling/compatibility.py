"""Compatibility: which ARCs can hold their RCs together (rule 1).

An exclusive RC has one holder; on a sharable one every stream of every holder meets its deadline. Answers are cached;
``service_changed`` drops the answers that may have changed.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence

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
        self._admitted: dict[str, dict[Collection[Hashable], bool]] = {}
        self._pairs: dict[ArcEntry, dict[ArcEntry, bool]] = {}
        """ARC → another one at a sharable RC → whether it fits beside it."""
        self._roomy = roomy

    def fits(self, arc: ArcEntry, others: Iterable[ArcEntry]) -> bool:
        """Return whether the ARC can hold all its RCs together with these others."""
        touches, excludes, beside = arc.touches, arc.excludes, []
        for other in others:
            common = touches & other.touches
            if common:
                if common & (excludes | other.excludes):
                    return False
                beside.append(other)
        if not arc.shares:
            return True
        if len(beside) != 1:
            return self._fits_sharers(arc, beside)
        (other,), known = beside, self._pairs.get(arc)
        if known is None or len(known) >= SETS_REMEMBERED:  # it may hold ARCs that left while this one was idle
            known = self._pairs[arc] = {}
        if other not in known:
            known[other] = self._fits_sharers(arc, beside)
        return known[other]

    def _fits_sharers(self, arc: ArcEntry, others: Sequence[ArcEntry]) -> bool:
        return all(self.can_share(rc, [arc, *[other for other in others if rc in other.uses]]) for rc in arc.shares)

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
        self._pairs.clear()

    def forget(self, arc: ArcEntry) -> None:
        """Drop the answers about an ARC that left."""
        for kept in (self._usable, self._pairs):
            kept.pop(arc, None)
        for rc in arc.uses:
            users = self._users.get(rc, ())
            for user in users:
                self._pairs.get(user, {}).pop(arc, None)
            left = {arc} if any(user.level is arc.level for user in users) else {arc, arc.level}
            known = self._admitted.get(rc, {})
            for key in [key for key in known if not left.isdisjoint(key)]:
                del known[key]

    def _admissible(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        known, key = self._admitted.setdefault(rc, {}), self._key(rc, users)
        if key not in known:
            if len(known) >= SETS_REMEMBERED:
                known.clear()
            known[key] = self._serves(rc, users, [user.streams[rc] for user in users])
        return known[key]

    def _key(self, rc: str, users: Sequence[ArcEntry]) -> Collection[Hashable]:
        """Return all on which the answer about these users depends: of many pairs it is the same."""
        if len(users) == 2:
            one, other = users
            if one.level.depth == other.level.depth:  # so their levels have one order
                return (*one.streams[rc],), (*other.streams[rc],), one.level, other.level, one.name < other.name
        return frozenset(users)

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
