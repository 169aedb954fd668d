"""What a listener of large values decides: whether it needs the network, and which values are new."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.near_listening import IN_FLIGHT_S, MOST_SENDERS, NewestOnly, SendersHeard

SOURCES = st.sampled_from(["a", "b", "c"])


@given(st.lists(st.tuples(st.sampled_from(["rose", "fell", "gave", "ended"]), SOURCES), max_size=40))
def test_the_network_is_not_needed_only_if_every_standing_sender_gives_its_values_by_a_board(
    events: list[tuple[str, str]],
) -> None:
    heard, standing, near = SendersHeard(), set[str](), set[str]()
    assert heard.need_network
    for event, source in events:
        getattr(heard, event)(source)
        match event:
            case "rose":
                standing.add(source)
            case "fell":
                standing.discard(source)
            case "gave":
                near.add(source)
            case "ended":
                near.discard(source)
        assert heard.need_network is (not standing or any(one not in near for one in standing))


@given(st.lists(st.tuples(SOURCES, st.integers(0, 20)), max_size=60))
def test_of_each_sender_numbers_only_grow_whichever_way_they_come(came: list[tuple[str, int]]) -> None:
    order, delivered = NewestOnly(), list[tuple[str, int]]()
    for source, number in came:
        if order.admits(source, number, number / 10, 0.0):
            delivered.append((source, number))
    for one in "abc":
        numbers = [number for source, number in delivered if source == one]
        assert numbers == sorted(set(numbers))
        assert max(numbers, default=None) == max((n for source, n in came if source == one), default=None)


def test_a_later_life_of_a_sender_is_new_although_its_numbers_begin_anew() -> None:
    order = NewestOnly()
    assert order.admits("a", 500, 10.0, 100.0)
    assert order.admits("a", 1, 10.5, 100.5)
    assert order.admits("a", 2, 10.6, 100.6)
    assert not order.admits("a", 1, 10.5, 100.7)


def test_a_later_life_on_a_host_whose_clock_is_behind_is_heard_soon() -> None:
    order = NewestOnly()
    assert order.admits("a", 500, 10.0, 100.0)
    assert not order.admits("a", 1, 8.0, 100.0 + IN_FLIGHT_S / 2)
    assert order.admits("a", 2, 8.1, 100.0 + IN_FLIGHT_S)


def test_very_many_senders_are_not_remembered() -> None:
    order = NewestOnly()
    for number in range(2 * MOST_SENDERS):
        assert order.admits(f"sender-{number}", 7, 1.0, 0.0)
    assert order.admits("sender-0", 1, 0.5, 0.0)
    assert not order.admits(f"sender-{2 * MOST_SENDERS - 1}", 7, 1.0, 0.0)
