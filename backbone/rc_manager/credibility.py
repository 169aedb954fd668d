"""Credibility: checks the state that an RC reports.

If an RC contradicts itself, its hardware or its grants, only this RC is put aside: the RC manager plans nothing on it,
publishes the reason, and asks it again until its answer is credible. Meanwhile it ignores the RC's publications.

Rule of this file: pure; time is an argument. ``ranges`` has validated each number; this file compares the numbers.
"""

from __future__ import annotations

from collections import Counter

from backbone.dependency_database.messages import Resource
from backbone.ranges import LONGEST_LEASE_S
from backbone.rc_manager.messages import LONGEST_PACKET_S, RcState, most_epoch

SKEW = 2  # chosen: clocks of two hosts may differ, so an RC may be as far ahead as two RCs together


def contradiction(state: RcState, resource: Resource, now_s: float, given: int | None = None) -> str:
    """Return the contradiction in the state of an RC, for people; empty if there is none.

    Args:
        state: The RC's report.
        resource: Its declaration in the mission file.
        given: Largest epoch given for this RC so far; None if an earlier RC manager may have given larger ones.
    """
    if state.name != resource.name:
        return f"it reports the name {state.name}"
    if not 0 <= state.capacity <= 1:
        return f"it reports a capacity of {state.capacity}, outside 0 to 1"
    if not 0 <= state.last_epoch <= SKEW * most_epoch(now_s):
        return f"it reports epoch {state.last_epoch}, outside all epochs given until now"
    return _contradiction_of_holders(state, resource, now_s, given) or _contradiction_of_packets(state, resource)


def _contradiction_of_holders(state: RcState, resource: Resource, now_s: float, given: int | None) -> str:
    if len(state.holders) > 1 and not resource.sharable:
        return f"it reports {len(state.holders)} holders, but is not sharable"
    for arc, times in Counter(holder.arc for holder in state.holders).items():
        if times > 1:
            return f"it reports {arc} {times} times as a holder"
    for holder in state.holders:
        if holder.epoch > state.last_epoch:
            return f"it reports {holder.arc} as a holder under epoch {holder.epoch}, above its last, {state.last_epoch}"
        if given is not None and holder.epoch > given:
            return f"it reports {holder.arc} as a holder under epoch {holder.epoch}, which was never granted"
        if not holder.lease_until_s <= now_s + SKEW * LONGEST_LEASE_S:
            return f"it reports that {holder.arc} holds it until {holder.lease_until_s:g} s"
    return ""


def _contradiction_of_packets(state: RcState, resource: Resource) -> str:
    if state.measured and not resource.sharable:
        return "it reports packet times, but is not sharable"
    holders = {holder.arc for holder in state.holders}
    for (arc, kind), times in Counter((one.arc, one.kind) for one in state.measured).items():
        if arc not in holders:
            return f"it reports packet times of {arc}, which does not hold it"
        if times > 1:
            return f"it reports the time of the {kind} packets of {arc} {times} times"
    for one in state.measured:
        if not 0 < one.packet_time_s <= LONGEST_PACKET_S:
            return f"it reports that a packet of {one.arc} takes {one.packet_time_s:g} s"
    return ""
