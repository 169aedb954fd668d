"""Pictures go on when a board, the memory for one, a process or the hub is lost."""

from __future__ import annotations

import asyncio
import errno
from itertools import cycle
from pathlib import Path

import pytest
from bus_laws import ASKER, SERVER, THIRD, Heard, until_known
from free_ports import free_endpoint
from hosts_with_boards import (
    AT,
    CLOCK,
    MISSION,
    PICTURE,
    SAID,
    Host,
    Map,
    Sketch,
    listened_to,
    sending,
    until,
    until_near,
)

from backbone.blackboard import sealed_memory
from backbone.blackboard.values import MOST_IN_PACKET
from backbone.bus import host_boards
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, hub_config


@pytest.mark.parametrize("at", ["sealed", "mapped"])
async def test_without_memory_or_descriptors_pictures_go_by_the_network(
    folder: Path, network: list[int], monkeypatch: pytest.MonkeyPatch, at: str
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EMFILE, "Too many open files")

    async with listened_to(folder) as (_near, sender, _listener, heard):
        sent: list[int] = []
        send = sending(sender, sent, 2 * MOST_IN_PACKET)
        await until_near(network, send)
        with monkeypatch.context() as patched:
            patched.setattr(sealed_memory, at, refuse)
            send()
            count = len(heard.all)
            await until(lambda: len(heard.all) > count + 5, "they are heard", send)
        await asyncio.sleep(host_boards.LOOK_EACH_S)
        await until_near(network, send)
        assert heard.numbers() == sorted(set(heard.numbers()))


async def test_an_unreadable_value_on_a_board_is_counted_and_skipped(folder: Path, network: list[int]) -> None:
    async with listened_to(folder) as (_near, sender, listener, heard):
        sent: list[int] = []
        await until_near(network, send := sending(sender, sent))
        sender.publish(AT, SAID, Sketch(1, "x" * PICTURE))
        await until(lambda: listener.statistics().unreadable == 1, "it is counted")
        send()
        await heard.until(lambda all_: all_[-1].body.number == len(sent), "the next picture")


async def test_a_lost_board_sends_the_listener_to_the_network_at_once(folder: Path, network: list[int]) -> None:
    """The board alone is lost, such as with a folder that somebody removed; its sender goes on."""
    async with listened_to(folder) as (_near, sender, _listener, heard):
        sent: list[int] = []
        await until_near(network, send := sending(sender, sent))
        sender._outlet(AT, SAID).board.close()  # type: ignore[union-attr]  # noqa: SLF001
        count = len(heard.all)
        await until(lambda: len(heard.all) > count, "it is heard again", send)
        await until_near(network, send)
        assert heard.numbers() == sorted(set(heard.numbers()))


async def test_a_member_that_moved_to_another_process_is_heard_there(folder: Path, network: list[int]) -> None:
    endpoint = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([endpoint]))
    here, there = (SharedSession(MISSION, endpoint, "", str(folder)) for _ in range(2))
    listener, other = here.join(ASKER, CLOCK), there.join(THIRD, CLOCK)
    heard, sent = Heard(), list[int]()
    listener.subscribe(AT, SAID, Map, heard, latest=True)
    for session in (here, there, here):
        sender = session.join(SERVER, CLOCK)
        turns = cycle([sending(other, sent), sending(sender, sent)])  # at once, only the newest would be heard
        before = len(heard.all)
        await until(
            lambda n=before: {SERVER, THIRD} <= {e.source for e in heard.all[n:]},  # type: ignore[misc]
            "both are heard",
            lambda turns=turns: next(turns)(),  # type: ignore[misc]
        )
        await sender.close()
    for bus in (listener, other):
        await bus.close()
    for session in (here, there):
        await session.close()
    await hub.close()


async def test_pictures_go_on_while_there_is_no_hub(folder: Path, network: list[int]) -> None:
    endpoint = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([endpoint]))
    near = Host(endpoint, folder)
    sender, listener = near.join(SERVER), near.join(ASKER)
    heard, sent, links = Heard(), list[int](), Heard()
    listener.watch_link(links)
    listener.subscribe(AT, SAID, Map, heard, latest=True)
    await until_known(listener, sender)
    await until_near(network, send := sending(sender, sent))
    await hub.close()
    await links.until(lambda all_: all_[-1] is False, "the link is lost")
    for _ in range(20):
        send()
        await heard.until(lambda all_: all_[-1].body.number == len(sent), "the newest picture without a hub")
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([endpoint]))
    await links.until(lambda all_: all_[-1] is True, "the link is back")
    await until_near(network, send)
    count = len(heard.all)
    await until(lambda: len(heard.all) > count + 5, "pictures go on", send)
    assert heard.numbers() == sorted(set(heard.numbers()))
    for bus in (sender, listener, hub):
        await bus.close()
