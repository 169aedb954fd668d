"""What a listener of large values decides: whether it needs the network, which values are new, when it looks again."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import pytest
from bus_laws import ASKER, SERVER, Heard, until_known
from hosts_with_boards import AT, SAID, Map, host, sending, until
from hypothesis import given
from hypothesis import strategies as st

from backbone.blackboard import sealed_memory
from backbone.bus import near_listening
from backbone.bus.near_listening import IN_FLIGHT_S, MOST_SENDERS, NewestOnly, SendersHeard
from backbone.wire import MAX_MESSAGE_BYTES

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


async def test_a_listener_that_its_sender_let_go_hears_values_too_long_for_the_network_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when the system has too many descriptors under way."""
    send_packet, refused = sealed_memory.send, list[int]()

    def refuse_once(to: Any, parts: Any, descriptors: Any = ()) -> None:
        if len(descriptors) == 1 and not refused:
            refused.append(1)
            raise OSError(errno.ETOOMANYREFS, "too many descriptors under way")
        send_packet(to, parts, descriptors)

    monkeypatch.setattr(near_listening, "LOOK_EACH_S", 0.2)
    async with host(folder) as near:
        sender, listener = near.join(SERVER), near.join(ASKER)
        heard, sent = Heard(), list[int]()
        listener.subscribe(AT, SAID, Map, heard, latest=True)
        await until_known(listener, sender)
        send = sending(sender, sent, MAX_MESSAGE_BYTES + 1)
        await until(lambda: len(heard.all) > 0, "the first value", send)
        monkeypatch.setattr(sealed_memory, "send", refuse_once)
        await until(lambda: bool(refused), "the listener is let go", send)
        let_go = len(sent)
        await until(lambda: heard.all[-1].body.number > let_go, "a later value", send)
