"""Lossless delivery on sessions: who leaves is forgotten, and strangers change nothing."""

import asyncio
import struct
from collections.abc import AsyncIterator, Callable

import pytest
import pytest_asyncio
import zenoh
from bus_laws import ASKER, SERVER, Heard, News, fail_on_bug, until_known
from free_ports import free_endpoint

from backbone.bus import lossless_streams
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation, key, key_of_lossless
from backbone.wire import OversizedMessage

MISSION, SAID = "lossless", Conversation.READINGS


@pytest_asyncio.fixture
async def pair(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[tuple[ZenohBus, ZenohBus, zenoh.Session]]:
    """Give a sender, a listener and a stranger's bare session."""
    monkeypatch.setattr(lossless_streams, "STILL_COME_S", 0.1)
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    sender, listener = (ZenohBus.open(MISSION, one, clock, client_config(endpoint)) for one in (SERVER, ASKER))
    sender.on_bug = listener.on_bug = fail_on_bug
    stranger = zenoh.open(client_config(endpoint))
    yield sender, listener, stranger
    await sender.close()
    await listener.close()
    stranger.close()  # type: ignore[no-untyped-call]
    await hub.close()


def streams(sender: ZenohBus) -> int:
    return len(sender.lossless.to(SERVER, SAID))


async def until_streams(sender: ZenohBus, count: int) -> None:
    await until(lambda: streams(sender) == count, f"{count} streams")


async def until(holds: Callable[[], bool], what: str) -> None:
    for _ in range(500):
        if holds():
            return
        await asyncio.sleep(0.01)
    pytest.fail(f"never: {what}")


Pair = tuple[ZenohBus, ZenohBus, zenoh.Session]


async def test_a_listener_that_leaves_is_forgotten_with_all_that_waits_for_it(pair: Pair) -> None:
    sender, listener, _stranger = pair
    hearing = listener.subscribe(SERVER, SAID, News, Heard(), lossless=True)
    await until_streams(sender, 1)
    hearing.close()
    sender.publish(SERVER, SAID, News(1))
    await until_streams(sender, 0)


async def test_each_of_many_listeners_gets_what_it_listens_to(pair: Pair) -> None:
    sender, listener, _stranger = pair
    heard = {pattern: [Heard() for _ in range(40)] for pattern in (SERVER, "*/*", "backbone/*", ASKER, "*/*/*")}
    for pattern, listeners in heard.items():
        for one in listeners:
            listener.subscribe(pattern, SAID, News, one, lossless=True)
    await until_streams(sender, 120)
    await until(lambda: len(sender.lossless.to(f"{SERVER}/part", SAID)) == 40, "streams of the part")
    sender.publish(SERVER, SAID, News(1))
    sender.publish(f"{SERVER}/part", SAID, News(2))
    for pattern, numbers in {SERVER: [1], "*/*": [1], "backbone/*": [1], "*/*/*": [2]}.items():
        for one in heard[pattern]:
            await one.until_count(1)
            assert one.numbers() == numbers
    assert not any(one.all for one in heard[ASKER])


async def test_a_strangers_tokens_messages_and_acknowledgements_change_nothing(pair: Pair) -> None:
    sender, listener, stranger = pair
    heard = Heard()
    listener.subscribe(SERVER, SAID, News, heard, lossless=True)
    await until_streams(sender, 1)
    of = key(MISSION, SERVER, SAID)
    tokens = [
        stranger.liveliness().declare_token(name)
        for name in (
            key_of_lossless(f"scout/{MISSION}/{SERVER}/nonsense", "x"),
            f"scout/{MISSION}/all/x",
            key_of_lossless(of, "never-answers"),
        )
    ]
    await until_streams(sender, 2)
    inbox = sender.lossless.inbox
    for nonsense in (b"", b"x" * 16, bytes(15), struct.pack("<8sQ", b"unknown!", 2**64 - 1)):
        stranger.put(inbox, nonsense)
    at = next(one.at for one in sender.lossless.to(SERVER, SAID) if "never" not in one.at)
    for attached in (None, b"", b"x" * 23, b"x" * 100, b"x" * 5000, struct.pack("<8sQQ", b"s", 1, 2**64 - 1)):
        stranger.put(at, b"nonsense", attachment=attached)
    for number in range(100):
        sender.publish(SERVER, SAID, News(number))
    await heard.until_count(100)
    assert heard.numbers() == list(range(100))
    await until(lambda: listener.unreadable == 6, "all of the stranger arrived, and was unreadable")
    assert listener.dropped() == {}
    for token in tokens:
        token.undeclare()  # type: ignore[no-untyped-call]
    await until_streams(sender, 1)


async def test_a_message_over_the_limit_of_its_conversation_is_refused_and_goes_to_nobody(pair: Pair) -> None:
    sender, listener, _stranger = pair
    every, also = Heard(), Heard()
    listener.subscribe(SERVER, Conversation.POSES, News, every, lossless=True)
    listener.subscribe(SERVER, Conversation.POSES, News, also)
    await until_known(listener, sender)

    class Long(News, frozen=True):
        text: str = ""

    with pytest.raises(OversizedMessage, match="at most 65536 are admitted") as refused:
        sender.publish(SERVER, Conversation.POSES, Long(1, "x" * 65_536))
    assert "docs/reference/messages.md" in refused.value.remedy
    sender.publish(SERVER, Conversation.POSES, News(2))
    await every.until_count(1)
    await also.until_count(1)
    assert every.numbers() == also.numbers() == [2]


async def test_a_longer_message_than_its_conversation_admits_is_not_read(pair: Pair) -> None:
    _sender, listener, stranger = pair
    heard = Heard()
    listener.subscribe(SERVER, Conversation.POSES, News, heard)
    await asyncio.sleep(0.2)
    stranger.put(key(MISSION, SERVER, Conversation.POSES), bytes(65_537))

    await until(lambda: listener.unreadable > 0, "it is counted")
    assert heard.all == []
