"""Converts a claim to the scheduling request that an ARC sends to the RC manager for its owner.

Rule of this file: pure, so that a rehearsal can use exactly the requests that the mission's ARCs will send.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

from backbone.scheduling.requests import PathNode, RcUse, SchedulingRequest, Usage


def scheduling_request(
    arc: str,
    sets: Sequence[Mapping[str, str]],
    *,
    owner: str,
    path: Sequence[tuple[str, int]],
    streams: Sequence[Usage],
    minimum_runtime_s: float,
    maximum_runtime_s: float = 0.0,
    sharable: AbstractSet[str] = frozenset(),
    console: bool = False,
    idle: bool = False,
    stops_at_once: bool = False,
) -> SchedulingRequest:
    """Return the request of an ARC.

    Args:
        sets: The acceptable sets of RCs, best first: role → name.
        path: Names and priorities from the mission's root, or of the console alone.
        streams: The ARC's streams on each sharable RC.
        minimum_runtime_s: Shortest useful time, seconds.
        maximum_runtime_s: End of all extensions, seconds; 0: the minimum.
        sharable: Names of the RCs that it uses by streams; all others exclusively.
        console: True if the owner is a console.
        idle: True: no time is wanted yet.
        stops_at_once: True: the owner needs no time to stop at the end of a slice.
    """

    def use(rc: str) -> RcUse:
        return RcUse(list(streams)) if rc in sharable else RcUse()

    return SchedulingRequest(
        arc=arc,
        owner=owner,
        path=[PathNode(name, priority) for name, priority in path],
        console=console,
        alternatives=[{rc: use(rc) for rc in rcs.values()} for rcs in sets],
        minimum_runtime_s=minimum_runtime_s,
        maximum_runtime_s=maximum_runtime_s,
        idle=idle,
        stops_at_once=stops_at_once,
    )
