"""When each waiting ARC of a group starts if nothing else happens: rule 3, word by word."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from .state import HOLDING, Arc, Phase
from .world import World

INSTANT_S = 1e-6  # chosen: two times closer than this are one; traces are exact to the microsecond
SOON_S = 1e-5  # chosen: what is being revoked is not free now, however short its release
FIT_S = 1e-3  # chosen: about the time that the RC manager needs to react; a run longer than its gap by this fits


class Busy(NamedTuple):
    """A time in which an ARC has or will have its RCs."""

    begin_s: float
    end_s: float
    arc: Arc


class Plan:
    """The starts of a group's waiting ARCs, worked out at one time.

    Attributes:
        starts: Waiting or revoked ARC → when it starts, in the order of the plan; infinite: not as things are.
    """

    def __init__(
        self,
        world: World,
        group: list[Arc],
        now_s: float,
        *,
        starting: Arc | None = None,
        gone: Arc | None = None,
        longer: tuple[Arc | None, float] = (None, 0.0),
        revoked_are_free: bool = False,
        equals_stay: bool = False,
    ) -> None:
        """Work out the starts.

        Args:
            group: In the order of the plan.
            starting: This waiting ARC starts now, whatever the plan says.
            gone: This holder has left.
            longer: This ARC needs so much longer.
            revoked_are_free: What is being revoked is free now, not after its release time.
            equals_stay: Equal holders keep their RCs although their slices are over.
        """
        self._world, self._now_s = world, now_s
        self._longer = longer
        self._revoked_are_free, self._equals_stay = revoked_are_free, equals_stay
        self._holders = [arc for arc in group if arc.phase not in (Phase.WAITING, Phase.IDLE) and arc is not gone]
        self._taken: list[Busy] = []
        if starting is not None:
            self._taken.append(Busy(now_s, now_s + starting.length_s, starting))
        self.starts: dict[Arc, float] = {}
        for arc in group:
            if arc.phase in HOLDING or not arc.wants or arc is starting or arc is gone:
                continue
            self.starts[arc] = begin_s = self._earliest(arc)
            if begin_s < inf:
                self._taken.append(Busy(begin_s, begin_s + arc.length_s, arc))

    def free_s(self, arc: Arc) -> float:
        """Return when those that conflict with the ARC and hold RCs now will have gone."""
        ends_s = [self._until_s(one, arc) for one in self._holders if one is not arc and self._world.conflict(arc, one)]
        return max([self._now_s, *ends_s])

    def _until_s(self, holder: Arc, arc: Arc) -> float:
        """Return until when the holder is in the way of the ARC."""
        now_s = self._now_s
        if holder.phase is Phase.REVOKING:
            return now_s if self._revoked_are_free else max(now_s + SOON_S, holder.revoke_s + holder.release_s)
        if self._world.is_higher(arc, holder):
            return now_s
        if self._equals_stay or self._world.is_higher(holder, arc):
            return inf
        return max(now_s, holder.slice_end_s(now_s))

    def _earliest(self, arc: Arc) -> float:
        world = self._world
        if not world.is_usable(arc):
            return inf
        begin_s = self._until_s(arc, arc) if arc.phase is Phase.REVOKING else self._now_s
        busy = []
        for holder in self._holders:
            if holder is not arc and holder.uses.keys() & arc.uses.keys():
                until_s = self._until_s(holder, arc)
                if until_s > self._now_s + INSTANT_S:
                    busy.append(Busy(self._now_s, until_s, holder))
        busy += [
            one._replace(end_s=inf) if world.is_higher(one.arc, arc) else one
            for one in self._taken
            if one.arc.uses.keys() & arc.uses.keys()
        ]
        length_s = arc.length_s + (self._longer[1] if self._longer[0] is arc else 0.0)
        while begin_s < inf:
            later_s = self._next_try(arc, begin_s, begin_s + length_s, busy)
            if later_s is None:
                return begin_s
            begin_s = later_s
        return inf

    def _next_try(self, arc: Arc, begin_s: float, end_s: float, busy: list[Busy]) -> float | None:
        """Return nothing if the ARC fits from begin to end; else the next time at which it may."""
        beside = [one for one in busy if one.begin_s < end_s - FIT_S and one.end_s > begin_s + INSTANT_S]
        if not beside or self._fit(arc, beside):
            return None
        for moment_s in sorted({begin_s, *(one.begin_s for one in beside if one.begin_s > begin_s)}):
            together = [one for one in beside if one.begin_s <= moment_s + INSTANT_S < one.end_s]
            if not self._fit(arc, together):
                return min(one.end_s for one in busy if one.end_s > begin_s + INSTANT_S)
        return None

    def _fit(self, arc: Arc, busy: list[Busy]) -> bool:
        for rc in arc.uses:
            together = [one.arc for one in busy if rc in one.arc.uses]
            if together and not self._world.fits(rc, [arc, *together]):
                return False
        return True
