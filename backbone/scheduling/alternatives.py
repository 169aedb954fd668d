"""Alternatives: chooses the set of RCs that an ARC waits for, or refuses a request that can never run.

Rule of this file: it chooses once, when an ARC sends its request; time does not matter. The chosen set stays.

Source: RAM 2002, resource controllers: a robot "not in use by another process" is selected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from backbone.ranges import MOST_STREAMS
from backbone.scheduling.entries import CONNECTED
from backbone.scheduling.requests import CapacityExceeded, RcUse, SchedulingRefusal, SchedulingRequest, UnknownRc, Usage
from backbone.scheduling.response_time import admissible, remedy
from backbone.scheduling.run_times import require_runtime
from backbone.scheduling.state import ScheduleState
from backbone.scheduling.streams import stream, utilization

Wish = Mapping[str, RcUse]


def choose(state: ScheduleState, request: SchedulingRequest) -> tuple[str, ...]:
    """Return the set of RCs that this request should wait for.

    A set that it already waits for or holds stays. Otherwise the preferences are, in this order: RCs that did not fail;
    RCs without another ARC's exclusive request, so that two claims of any robot get two robots; running RCs; the
    request's own order.

    Raises:
        MissingRuntime: The request has no valid minimum run time.
        UnknownRc: All alternatives name RCs that do not exist.
        CapacityExceeded: It could not run even alone; facts ``demanded``, ``used`` and ``free``.
        SchedulingRefusal: The request has no RC, or a stream with impossible times.
    """
    _check_form(request)
    known = [wish for wish in request.alternatives if wish.keys() <= state.rcs.keys()]
    if not known:
        missing = sorted({rc for wish in request.alternatives for rc in wish} - state.rcs.keys())
        raise UnknownRc(f"{request.arc} asks for {', '.join(missing)}, which this mission does not have", rc=missing[0])
    overloads = [_overloaded_alone(state, wish) for wish in known]
    possible = [wish for wish, overloaded in zip(known, overloads, strict=True) if overloaded is None]
    if possible:
        best = min(possible, key=lambda wish: _reluctance(state, request.arc, wish))
        return tuple(best)
    raise _overload(state, request.arc, known[0], overloads[0] or "")


def _reluctance(state: ScheduleState, arc: str, wish: Wish) -> tuple[bool, int, int, int]:
    """Return the sort key of a choice: smaller is better; of equal ones the first in the request is chosen."""
    present = state.arcs.get(arc)
    rcs = [state.rcs[rc] for rc in wish]
    return (
        present is None or present.uses.keys() != wish.keys(),
        sum(rc.failed for rc in rcs),
        sum(
            rc in other.uses and other.name != arc and not (use.streams and other.uses[rc].streams)
            for rc, use in wish.items()
            for other in state.arcs.values()
        ),
        sum(not rc.up for rc in rcs),
    )


def _overloaded_alone(state: ScheduleState, wish: Wish) -> str | None:
    """Return an RC that could not serve the wish alone; None: all RCs could."""
    for name, use in wish.items():
        rc, admission = state.rcs[name], state.compatibility.admission
        streams = sorted((stream(usage) for usage in use.streams), key=lambda one: one.period_us)
        if not admissible(streams, rc.capacity, admission):
            return name
    return None


def _overload(state: ScheduleState, arc: str, wish: Wish, rc: str) -> CapacityExceeded:
    demanded = _share(wish[rc].streams)
    capacity = state.rcs[rc].capacity
    used = sum(_share(other.uses[rc].streams) for other in state.rcs[rc].holders if other.state in CONNECTED)
    streams = sorted(wish[rc].streams, key=lambda usage: usage.period_s)
    advice = remedy([(usage.kind, stream(usage)) for usage in streams], capacity)
    reason = "more than it can ever give" if demanded > capacity else "and not every packet can be in time"
    return CapacityExceeded(
        f"{arc} demands {demanded:.1%} of {rc}, {reason}: capacity {capacity:.1%}, {used:.1%} used now",
        remedy=advice or CapacityExceeded.remedy,
        rc=rc,
        demanded=demanded,
        used=used,
        free=max(0.0, capacity - used),
    )


def _share(streams: Sequence[Usage]) -> float:
    return utilization([stream(usage) for usage in streams])


def _check_form(request: SchedulingRequest) -> None:
    require_runtime(request.arc, request.minimum_runtime_s, request.maximum_runtime_s)
    if not request.alternatives or not all(request.alternatives):
        raise SchedulingRefusal(f"{request.arc} asks for no RC", arc=request.arc)
    for wish in request.alternatives:
        for rc, use in wish.items():
            if len(use.streams) > MOST_STREAMS:
                raise SchedulingRefusal(
                    f"{request.arc} asks {rc} for {len(use.streams)} streams",
                    remedy=f"Ask for at most {MOST_STREAMS} streams on one RC.",
                    rc=rc,
                )
            if not all(_makes_sense(usage) for usage in use.streams):
                raise SchedulingRefusal(
                    f"{request.arc} asks {rc} for a stream without a period and packet time of at least 1 µs",
                    remedy="Give each stream a period and a packet time above 0, a deadline and jitter of at least 0.",
                    rc=rc,
                )


def _makes_sense(usage: Usage) -> bool:
    times_s = (usage.period_s, usage.packet_time_s, usage.deadline_s, usage.jitter_s)
    return all(0 <= time_s < math.inf for time_s in times_s) and round(min(times_s[:2]) * 1e6) >= 1
