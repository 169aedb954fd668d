"""Bounds of clocks from causes: they hold the planted offset, and what is taken puts no effect before its cause."""

from __future__ import annotations

import math
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.recording.clock_offsets import EXACT_S, ClockObserver, ClockOffsets, Offset, solved
from backbone.recording.reader import Recorded

BASE, NEAR, FAR = "base", "near", "far"
HOSTS = (BASE, NEAR, FAR)
SENDERS = {
    "backbone/nameserver": BASE,
    "backbone/rc_manager": BASE,
    "resource_pool/scout1": NEAR,
    "resource_pool/scout2": FAR,
    "resource_pool/radio": FAR,
}
REFERENCE = "backbone/nameserver"
offsets_s = st.floats(-30.0, 30.0)


class Step(NamedTuple):
    """A message: who sends it, how long after the one before, and which one led to it, counted back; 0: none."""

    source: str
    after_s: float
    cause_back: int


steps = st.builds(Step, st.sampled_from(sorted(SENDERS)), st.floats(1e-4, 0.5), st.integers(0, 4))


def said(
    source: str, sequence: int, stamp_s: float, cause: str = "", *, host: str = "", schema: str = "Readings/1"
) -> Recorded:
    body = {"address": source, "host": host} if host else {}
    schema = "ComponentState/2" if host else schema
    return Recorded(f"scout/night/{source}/log", source, schema, stamp_s, stamp_s, stamp_s, sequence, cause, body)


def mission(plan: list[Step], offsets: dict[str, float]) -> list[Recorded]:
    """Return the messages of a mission, in the order in which a recording has them."""
    numbers = dict.fromkeys(SENDERS, 1)
    made = [said(source, 1, 100.0 + offsets.get(host, 0.0), host=host) for source, host in SENDERS.items()]
    first, now_s = len(made), 100.0
    for step in plan:
        now_s += step.after_s
        numbers[step.source] += 1
        known = made[first:]
        cause = known[-step.cause_back].id if 0 < step.cause_back <= len(known) else ""
        made.append(said(step.source, numbers[step.source], now_s + offsets.get(SENDERS[step.source], 0.0), cause))
    return sorted(made, key=lambda one: one.at_s)


def learned(messages: list[Recorded]) -> ClockOffsets:
    observer = ClockObserver()
    assert [*observer.watched(messages)] == messages
    return observer.offsets()


def out_of_order(messages: list[Recorded], clocks: ClockOffsets) -> list[str]:
    """Return the messages that stand before their causes."""
    at_s = {one.id: one.at_s - clocks.of(one.source) for one in messages}
    return [one.id for one in messages if one.cause and at_s[one.id] < at_s[one.cause] - EXACT_S]


@given(plan=st.lists(steps, max_size=40), near_s=offsets_s, far_s=offsets_s)
def test_bounds_hold_the_planted_offset_and_what_is_taken_puts_no_effect_before_its_cause(
    plan: list[Step], near_s: float, far_s: float
):
    planted = {NEAR: near_s, FAR: far_s}
    messages = mission(plan, planted)
    clocks = learned(messages)
    assert clocks.reference == BASE
    for host, found in clocks.offsets.items():
        assert found.at_least_s - EXACT_S <= planted[host] <= found.at_most_s + EXACT_S
        assert found.moved_s == 0
        assert found.at_least_s - EXACT_S <= found.taken_s <= found.at_most_s + EXACT_S
    assert out_of_order(messages, clocks) == []


@given(plan=st.lists(steps, max_size=40))
def test_right_clocks_are_never_corrected(plan: list[Step]):
    assert learned(mission(plan, {})).wrong == {}


@given(far_s=offsets_s.filter(lambda s: abs(s) > 1e-3), delay_s=st.floats(1e-5, 4e-4))
def test_one_question_and_its_answer_in_each_direction_bound_the_offset_by_their_delays(far_s: float, delay_s: float):
    base, far = "backbone/nameserver", "resource_pool/scout2"
    plan = [Step(base, 0.1, 0), Step(far, delay_s, 1), Step(far, 0.1, 0), Step(base, delay_s, 1)]
    clocks = learned(mission(plan, {FAR: far_s}))
    found = clocks.wrong[FAR]
    assert found.at_least_s == pytest.approx(far_s - delay_s, abs=EXACT_S)
    assert found.at_most_s == pytest.approx(far_s + delay_s, abs=EXACT_S)
    assert clocks.of(far) == pytest.approx(far_s, abs=EXACT_S)
    assert clocks.of(base) == 0.0


def test_a_cause_in_one_direction_bounds_one_side_and_what_it_excludes_is_corrected_least() -> None:
    answered = [said(REFERENCE, 1, 10.0), said("resource_pool/scout2", 1, 8.0, f"{REFERENCE}#1", host=FAR)]
    clocks = learned(sorted(answered, key=lambda one: one.at_s))
    assert clocks.wrong == {FAR: Offset(-math.inf, -2.0, -2.0)}


def test_hosts_that_no_cause_joins_to_the_reference_are_put_in_order_among_themselves() -> None:
    found = solved({(NEAR, FAR): -2.0, (FAR, NEAR): 2.1}, [BASE, FAR, NEAR])
    assert found[FAR].taken_s == 0.0
    assert found[NEAR].taken_s == pytest.approx(2.05)


def test_a_clock_that_moved_is_corrected_by_the_middle_and_told() -> None:
    gaps = {(BASE, FAR): 0.5, (FAR, BASE): -2.5, (BASE, NEAR): 3.1, (NEAR, BASE): -2.9}
    found = solved(gaps, [BASE, FAR, NEAR])
    assert found == {FAR: Offset(1.5, 1.5, 1.5, 2.0), NEAR: Offset(2.9, 3.1, 3.0)}


gap_tables = st.dictionaries(
    st.tuples(st.sampled_from(HOSTS), st.sampled_from(HOSTS)).filter(lambda pair: pair[0] != pair[1]),
    st.floats(-10.0, 10.0),
)


@given(gaps=gap_tables)
def test_what_is_taken_agrees_with_every_bound_but_for_what_clocks_moved(gaps: dict[tuple[str, str], float]):
    found = solved(gaps, list(HOSTS))
    taken = {BASE: 0.0} | {host: offset.taken_s for host, offset in found.items()}
    moved_s = sum(offset.moved_s for offset in found.values())
    for (host, other), gap_s in gaps.items():
        assert taken[other] - taken[host] <= gap_s + moved_s / 2 + 2 * EXACT_S


def test_a_sender_that_began_anew_is_no_cause_because_its_ids_are_those_of_its_former_life() -> None:
    scout = "resource_pool/scout2"
    messages = [
        said(scout, 7, 1.0, host=FAR),
        said(REFERENCE, 1, 2.0, f"{scout}#8", host=BASE),  # its cause is not in the recording
        said(scout, 1, 3.0, host=FAR),
        said(scout, 8, 40.0),
    ]
    assert learned(messages).offsets == {}


def test_consoles_and_senders_without_a_host_have_clocks_of_their_own() -> None:
    console = "ui_console/anna"
    messages = [
        said(REFERENCE, 1, 1.0, host=BASE),
        said(console, 1, 1.1, host=BASE),
        said(console, 2, 0.5, f"{REFERENCE}#1"),
        said("backbone/recorder-7", 1, 0.7, f"{REFERENCE}#1"),
    ]
    clocks = learned(messages)
    assert clocks.of(console) == pytest.approx(-0.5)
    assert clocks.of("backbone/recorder-7") == pytest.approx(-0.3)
    assert clocks.of(REFERENCE) == 0.0
