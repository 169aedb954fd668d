"""Laws of the hold table over random histories."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.rc_manager.messages import Held, StaleEpoch
from resource_pool.holds import Hold, HoldTable

ARCS = st.sampled_from(["one", "two", "three"])
EPOCHS = st.integers(0, 12)
TIMES = st.floats(0, 10, allow_nan=False)
STEPS = st.one_of(
    st.tuples(st.just("connect"), ARCS, EPOCHS, TIMES),
    st.tuples(st.just("disconnect"), ARCS, EPOCHS, TIMES),
    st.tuples(st.just("renew"), ARCS, EPOCHS, TIMES),
    st.tuples(st.just("expire"), ARCS, EPOCHS, TIMES),
    st.tuples(st.just("admit"), ARCS, EPOCHS, TIMES),
)


def hold(arc: str = "one", epoch: int = 1, until_s: float = 1.0, rank: int = 0) -> Hold:
    return Hold(arc, epoch, 0.0, until_s, rank=rank)


def take(table: HoldTable, step: tuple[str, str, int, float]) -> Any:
    what, arc, epoch, time_s = step
    match what:
        case "connect":
            return table.connect(hold(arc, epoch, time_s))
        case "disconnect":
            return table.disconnect(arc, epoch)
        case "renew":
            return table.renew(arc, epoch, time_s)
        case "expire":
            return table.expire(time_s)
    return table.admit(arc, epoch, time_s)


@given(st.booleans(), st.lists(STEPS, max_size=40))
def test_epochs_only_grow_a_unit_rc_has_one_holder_and_a_refusal_changes_nothing(
    sharable: bool, steps: list[tuple[str, str, int, float]]
) -> None:
    table = HoldTable("rc", sharable=sharable, last_epoch=3)
    connected: list[int] = []
    for step in steps:
        what, arc, epoch, time_s = step
        before, last = table.holds(), table.last_epoch
        try:
            outcome = take(table, step)
        except (StaleEpoch, Held):
            assert (table.holds(), table.last_epoch) == (before, last)
            assert not (
                what == "admit"
                and any(one.epoch == epoch and one.lease_until_s > time_s for one in before if one.arc == arc)
            )
            continue
        assert table.last_epoch >= last
        assert sharable or len(table.holds()) <= 1
        match what:
            case "connect":
                connected.append(epoch)
                assert epoch > last
                assert table.has(arc, epoch)
            case "disconnect":
                assert not any(left.arc == arc and left.epoch <= epoch for left in table.holds())
            case "expire":
                assert all(over.lease_until_s <= time_s for over in outcome)
                assert all(left.lease_until_s > time_s for left in table.holds())
            case "admit":
                assert (outcome.arc, outcome.epoch) == (arc, epoch)
                assert outcome in before
                assert outcome.lease_until_s > time_s
        expiry_s = table.next_expiry_s()
        assert expiry_s == min((left.lease_until_s for left in table.holds()), default=None)
    assert connected == sorted(set(connected))


@given(st.lists(st.tuples(ARCS, TIMES), min_size=1))
def test_a_lease_is_never_shortened_by_a_renewal_and_nothing_else_of_the_hold_changes(
    renewals: list[tuple[str, float]],
) -> None:
    table = HoldTable("rc", sharable=False, last_epoch=0)
    table.connect(Hold("one", 5, 0.5, 1.0, companions={"radio": 9}, rank=2))
    for arc, until_s in renewals:
        before = table.holds()[0]
        assert table.renew(arc, 5, until_s) == (arc == "one")
        after = table.holds()[0]
        assert after.lease_until_s == (max(before.lease_until_s, until_s) if arc == "one" else before.lease_until_s)
        assert (after.arc, after.epoch, after.since_s, after.companions, after.rank) == ("one", 5, 0.5, {"radio": 9}, 2)


def test_a_command_of_the_hold_before_is_stale_and_says_so_in_numbers() -> None:
    table = HoldTable("rc", sharable=False, last_epoch=0)
    table.connect(hold("one", 1))
    table.disconnect("one", 1)
    table.connect(hold("one", 2))
    with pytest.raises(StaleEpoch) as refused:
        table.admit("one", 1, 0.5)
    assert refused.value.facts == {"epoch": 1, "last_epoch": 2}


def test_a_disconnection_that_overtook_its_connection_makes_that_stale() -> None:
    table = HoldTable("rc", sharable=False, last_epoch=0)
    assert table.disconnect("one", 4) is None
    with pytest.raises(StaleEpoch):
        table.connect(hold("one", 4))


def test_holders_are_listed_by_user_priority_then_name() -> None:
    table = HoldTable("rc", sharable=True, last_epoch=0)
    for epoch, (arc, rank) in enumerate([("c", 1), ("b", 1), ("a", 2), ("d", 0)], start=1):
        table.connect(hold(arc, epoch, rank=rank))
    assert [held.arc for held in table.holds()] == ["d", "b", "c", "a"]


def test_checking_returns_what_would_be_replaced_and_replaces_nothing() -> None:
    table = HoldTable("rc", sharable=False, last_epoch=0)
    table.connect(hold("one", 1))
    former = table.check(hold("one", 2))
    assert former is not None
    assert former.epoch == 1
    assert table.has("one", 1)
    with pytest.raises(Held):
        table.check(hold("two", 2))
