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
        return f"it calls itself {state.name}"
    if not 0 <= state.capacity <= 1:
        return f"it says that it can give {state.capacity} of its time"
    if not 0 <= state.last_epoch <= SKEW * most_epoch(now_s):
        return f"it says that it saw epoch {state.last_epoch}, above any epoch given until now"
    return _contradiction_of_holders(state, resource, now_s, given) or _contradiction_of_packets(state, resource)


def _contradiction_of_holders(state: RcState, resource: Resource, now_s: float, given: int | None) -> str:
    if len(state.holders) > 1 and not resource.sharable:
        return f"it says that {len(state.holders)} ARCs hold it, and is not sharable"
    for arc, times in Counter(holder.arc for holder in state.holders).items():
        if times > 1:
            return f"it says that {arc} holds it {times} times"
    for holder in state.holders:
        if holder.epoch > state.last_epoch:
            return f"it says that {holder.arc} holds it under epoch {holder.epoch}, after its last, {state.last_epoch}"
        if given is not None and holder.epoch > given:
            return f"it says that {holder.arc} holds it under epoch {holder.epoch}, which was never granted"
        if not holder.lease_until_s <= now_s + SKEW * LONGEST_LEASE_S:
            return f"it says that {holder.arc} holds it until {holder.lease_until_s:g} s"
    return ""


def _contradiction_of_packets(state: RcState, resource: Resource) -> str:
    if state.measured and not resource.sharable:
        return "it says how long packets take, and is not sharable"
    holders = {holder.arc for holder in state.holders}
    for (arc, kind), times in Counter((one.arc, one.kind) for one in state.measured).items():
        if arc not in holders:
            return f"it says how long packets of {arc} take, which does not hold it"
        if times > 1:
            return f"it says {times} times how long the {kind} packets of {arc} take"
    for one in state.measured:
        if not 0 < one.packet_time_s <= LONGEST_PACKET_S:
            return f"it says that a packet of {one.arc} takes {one.packet_time_s:g} s"
    return ""
