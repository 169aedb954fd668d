"""Large values to listeners of the same host: over a blackboard, and over the network where there is none.

The laws of all publications hold for them as well (``test_bus_publications``); here is what is new.
"""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import numpy as np
import pytest
from bus_laws import ASKER, SERVER, THIRD, Heard, until_known
from free_ports import free_endpoint
from hosts_with_boards import (
    AT,
    CLOCK,
    MISSION,
    PICTURE,
    SAID,
    Map,
    Sketch,
    host,
    listened_to,
    picture,
    sending,
    until,
    until_near,
)

from backbone.bus.host_boards import LARGE_BYTES, boards_for
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.bus.zenoh_outlets import MISSED_AFTER_S, MOST_PUBLISHERS
from backbone.keys import Conversation
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES, WIRE_VERSION, Envelope, OversizedMessage


async def test_pictures_leave_the_network_and_are_neither_old_nor_doubled(folder: Path, network: list[int]) -> None:
    async with listened_to(folder) as (_near, sender, _listener, heard):
        sent: list[int] = []
        send = sending(sender, sent)
        await until(lambda: len(heard.all) > 0, "the first picture", send)
        await until_near(network, send)
        by_network = len(network)
        for _ in range(50):
            send()
            await heard.until(lambda all_: all_[-1].body.number == len(sent), "the newest picture")
        assert len(network) == by_network
        assert heard.numbers() == sorted(set(heard.numbers()))
        assert all(set(np.unique(np.frombuffer(e.body.cells, np.uint8))) == {e.body.number % 256} for e in heard.all)
        assert heard.all[-1].body.cells.readonly


@pytest.mark.parametrize(
    ("conversation", "size", "is_near"),
    [
        (Conversation.FRAMES, LARGE_BYTES, True),
        (Conversation.VIEWS, LARGE_BYTES, True),
        (Conversation.OUTPUTS, LARGE_BYTES, True),
        (Conversation.OUTPUTS, LARGE_BYTES // 2, False),
        (Conversation.BODIES, 10, True),
        (Conversation.COMMAND, 10, True),
        (Conversation.EVENTS, LARGE_BYTES, False),
    ],
)
async def test_only_large_values_of_large_conversations_and_all_bodies_and_commands_have_a_board(
    folder: Path, conversation: Conversation, size: int, is_near: bool
) -> None:
    async with listened_to(folder, conversation) as (_near, sender, _listener, heard):
        sender.publish(AT, conversation, picture(1, size))
        await heard.until_count(1)
        assert (folder / "board").exists() is is_near
        await sender.close()
        assert list((folder / "board").glob("*")) == []


async def test_small_values_between_large_ones_come_in_order(folder: Path, network: list[int]) -> None:
    async with listened_to(folder, Conversation.OUTPUTS) as (_near, sender, _listener, heard):
        sent: list[int] = []
        await until_near(network, sending(sender, sent, conversation=Conversation.OUTPUTS))
        for size in (10, PICTURE, 10, 10, 200_000, 0):
            sending(sender, sent, size, Conversation.OUTPUTS)()
            await heard.until(lambda all_: all_[-1].body.number == len(sent), "the newest")
            assert len(heard.all[-1].body.cells) == size
        assert heard.numbers() == sorted(set(heard.numbers()))


async def test_without_a_listener_a_picture_is_not_even_written(
    folder: Path, network: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with host(folder) as near:
        sender = near.join(SERVER)
        sent: list[int] = []
        await until_near(network, sending(sender, sent))
        monkeypatch.setattr("backbone.bus.zenoh_outlets.write", lambda *_: pytest.fail("written for nobody"))
        sending(sender, sent)()
        assert sender.statistics().published == len(sent)


@pytest.mark.parametrize("how", ["far", "wildcard", "all", "overhears"])
async def test_other_listeners_get_every_picture_by_the_network(folder: Path, network: list[int], how: str) -> None:
    """Of another host (without the folder), by wildcard, those that want all, and those that overhear."""
    async with listened_to(folder) as (near, sender, _listener, heard):
        other, also, sent = near.join(THIRD, is_near=how != "far"), Heard(), list[int]()
        await until_near(network, send := sending(sender, sent))
        if how == "overhears":
            other.overhear(SAID, also, 10**9)
        else:
            other.subscribe("*/*" if how == "wildcard" else AT, SAID, Map, also, latest=how != "all")
        await until(lambda: len(also.all) > 0, "the other listener hears", send)
        await asyncio.sleep(0.1)  # what is under way comes
        before = len(also.all)
        for count in range(1, 21):
            send()
            await heard.until(lambda all_: all_[-1].body.number == len(sent), "the newest")
            await also.until_count(before + count)
        assert heard.numbers() == sorted(set(heard.numbers()))


async def test_a_second_sender_is_heard_while_the_first_goes_on(folder: Path, network: list[int]) -> None:
    """From another host, from a system without blackboards, and on this host."""
    async with listened_to(folder) as (near, first, _listener, heard):
        sent: list[int] = []
        await until_near(network, sending(first, sent))
        (folder / "elsewhere").mkdir()
        for source, its_folder in (
            ("resource_pool/far", folder / "elsewhere"),  # a sender of another host has a board there
            ("resource_pool/boardless", None),
            ("resource_pool/near", folder),
        ):
            other = near.join(source)
            other.boards = boards_for(str(its_folder)) if its_folder else None

            def both(other: ZenohBus = other) -> None:
                sending(first, sent)()
                sending(other, sent)()

            await until(lambda s=source: any(e.source == s for e in heard.all), f"{source} is heard", both)  # type: ignore[misc]
            seen = len(heard.all)
            await until(
                lambda s=source, n=seen: {s, SERVER} <= {e.source for e in heard.all[n:]},
                "both are heard",
                both,  # type: ignore[misc]
            )
        for source in {e.source for e in heard.all}:
            numbers = [e.sequence for e in heard.all if e.source == source]
            assert numbers == sorted(set(numbers))


async def test_a_replay_is_heard_beside_a_board(folder: Path, network: list[int]) -> None:
    async with listened_to(folder) as (near, sender, _listener, heard):
        player, sent = near.join(THIRD), list[int]()
        await until_near(network, send := sending(sender, sent))
        recorded = Envelope(WIRE_VERSION, "resource_pool/then", 5, 1.0, "", picture(77))

        def play() -> None:
            player.pass_on(AT, SAID, recorded)
            send()

        await until(lambda: any(e.source == recorded.source for e in heard.all), "the replay is heard", play)


async def test_a_sender_that_ends_and_begins_anew_is_heard_again(folder: Path, network: list[int]) -> None:
    async with host(folder) as near:
        listener = near.join(ASKER)
        heard = Heard()
        listener.subscribe(AT, SAID, Map, heard, latest=True)
        for _life in range(3):
            sender, sent = near.join(SERVER), list[int]()
            await until_known(listener, sender)
            before = len(heard.all)
            await until(lambda n=before: len(heard.all) > n, "it is heard", sending(sender, sent))  # type: ignore[misc]
            await until_near(network, sending(sender, sent))
            lives = [e.sequence for e in heard.all[before:]]
            assert lives == sorted(set(lives))
            await sender.close()


async def test_a_withdrawn_subscription_leaves_the_board(folder: Path, network: list[int]) -> None:
    async with host(folder) as near:
        sender, listener = near.join(SERVER), near.join(ASKER)
        heard, sent = Heard(), list[int]()
        hearing = listener.subscribe(AT, SAID, Map, heard, latest=True)
        await until_known(listener, sender)
        await until_near(network, send := sending(sender, sent))
        before = len(os.listdir("/proc/self/fd"))
        hearing.close()
        hearing.close()
        count = len(heard.all)
        for _ in range(3):
            send()
            await asyncio.sleep(0.02)
        assert len(heard.all) == count
        assert len(os.listdir("/proc/self/fd")) < before


async def test_a_large_output_reaches_this_host_and_a_longer_one_is_refused(folder: Path) -> None:
    size = 3 * MAX_MESSAGE_BYTES
    async with listened_to(folder, Conversation.OUTPUTS) as (near, sender, _listener, heard):
        far = near.join(THIRD, is_near=False)
        sender.publish(AT, Conversation.OUTPUTS, picture(7, size))  # too long for the network, and yet the first
        await heard.until_count(1)
        assert bytes(heard.all[0].body.cells) == bytes([7]) * size
        with pytest.raises(OversizedMessage, match="Sketch"):
            sender.publish(AT, Conversation.OUTPUTS, Sketch(1, "x" * MAX_LARGE_MESSAGE_BYTES))
        with pytest.raises(OversizedMessage):
            far.publish(AT, Conversation.OUTPUTS, picture(8, size))
        with pytest.raises(OversizedMessage):
            sender.publish(AT, Conversation.EVENTS, picture(8, size))


@pytest.mark.slow
@pytest.mark.parametrize("is_far_there", [True, False])
async def test_a_log_says_that_another_host_misses_values_that_are_too_long_for_the_network(
    folder: Path, caplog: pytest.LogCaptureFixture, is_far_there: bool
) -> None:
    """Otherwise a module there waits for ever, and nothing says why."""
    async with listened_to(folder, Conversation.OUTPUTS) as (near, sender, _listener, heard):
        far, missed = near.join(THIRD, is_near=False), Heard()
        if is_far_there:
            far.subscribe(AT, Conversation.OUTPUTS, Map, missed, latest=True)
            await until_known(far, sender)
        ends_s = CLOCK.now_s() + 2 * MISSED_AFTER_S
        while CLOCK.now_s() < ends_s:
            sender.publish(AT, Conversation.OUTPUTS, picture(7, 2 * MAX_MESSAGE_BYTES))
            await asyncio.sleep(0.1)
        assert heard.all
        assert not missed.all
        told = [one for one in caplog.records if "subscribers on other hosts miss" in one.getMessage()]
        assert len(told) == is_far_there


async def test_neighbors_get_the_object_and_other_processes_the_board(folder: Path, network: list[int]) -> None:
    endpoint = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([endpoint]))
    here, there = (SharedSession(MISSION, endpoint, "", str(folder)) for _ in range(2))
    sender, neighbor, stranger = here.join(SERVER, CLOCK), here.join(THIRD, CLOCK), there.join(ASKER, CLOCK)
    close, far, sent = Heard(), Heard(), list[int]()
    neighbor.subscribe(AT, SAID, Map, close, latest=True)
    stranger.subscribe(AT, SAID, Map, far, latest=True)
    await until_known(stranger, sender)
    await until(lambda: len(far.all) > 0, "the stranger hears", sending(sender, sent))
    await until_near(network, sending(sender, sent))
    shown = picture(len(sent) + 1)
    sender.publish(AT, SAID, shown)
    await close.until(lambda all_: all_[-1].body.number == shown.number, "the neighbor hears")
    await far.until(lambda all_: all_[-1].body.number == shown.number, "the stranger hears")
    assert close.all[-1].body is shown
    for heard in (close, far):
        assert heard.numbers() == sorted(set(heard.numbers()))
    for bus in (sender, neighbor, stranger):
        await bus.close()
    for session in (here, there):
        await session.close()
    await hub.close()
    assert list((folder / "board").iterdir()) == []


async def test_who_publishes_under_ever_new_addresses_does_not_collect_boards(folder: Path) -> None:
    """As a framegrabber does for each ARC that holds it."""
    async with host(folder) as near:
        sender = near.join(SERVER)
        for number in range(MOST_PUBLISHERS + 20):
            sender.publish(f"resource_pool/arc-{number}", SAID, picture(number))
        files = list((folder / "board").iterdir())
        assert len(files) <= 2 * MOST_PUBLISHERS
        await sender.close()
        assert list((folder / "board").iterdir()) == []
