"""What only the bus inside one process promises: the same objects, the same order, virtual deadlines."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from backbone.bus.clock import NothingLeftToHappen, VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.errors import NoResponder, ReplyTimeout
from backbone.keys import Conversation
from backbone.wire import MAX_MESSAGE_BYTES, Envelope, Message


class Picture(Message, frozen=True):
    pixels: bytes


def test_objects_are_handed_over_not_copied() -> None:
    async def main() -> None:
        network = LocalNetwork()
        source, listener = (network.join(f"backbone/{name}", VirtualClock()) for name in ("source", "listener"))
        heard: list[Message] = []

        async def answer(asked: Envelope[Any]) -> Message:
            return asked.body

        source.serve("backbone/source", Picture, answer)
        listener.subscribe("backbone/source", Conversation.FRAMES, Picture, lambda e: heard.append(e.body))
        picture = Picture(bytes(10))
        source.publish("backbone/source", Conversation.FRAMES, picture)
        assert await listener.ask("backbone/source", picture, Picture, within_s=1.0) is picture
        assert heard == [picture]
        assert heard[0] is picture

    run_virtual(main())


def test_latest_hands_over_one_of_a_burst() -> None:
    async def main() -> None:
        bus = LocalNetwork().join("backbone/source", VirtualClock())
        heard: list[bytes] = []
        bus.subscribe(
            "*/*", Conversation.FRAMES, Picture, lambda envelope: heard.append(envelope.body.pixels), latest=True
        )
        for number in range(50):
            bus.publish("backbone/source", Conversation.FRAMES, Picture(bytes([number])))
        await VirtualClock().sleep_s(0.0)
        assert heard == [bytes([49])]

    run_virtual(main())


def test_a_question_takes_no_virtual_time() -> None:
    async def main() -> None:
        bus = LocalNetwork().join("backbone/source", VirtualClock())

        async def answer(asked: Envelope[Any]) -> Message:
            return asked.body

        bus.serve("backbone/source", Picture, answer)
        await bus.ask("backbone/source", Picture(b""), Picture, within_s=1.0)
        assert VirtualClock().now_s() == 0.0

    run_virtual(main())


@pytest.mark.virtual_limit(1e5)
def test_a_deadline_is_exact_in_virtual_time() -> None:
    async def main() -> None:
        bus = LocalNetwork().join("backbone/source", VirtualClock())

        async def never(asked: Envelope[Any]) -> Message:
            await asyncio.Event().wait()
            return asked.body

        bus.serve("backbone/source", Picture, never)
        with pytest.raises(ReplyTimeout):
            await bus.ask("backbone/source", Picture(b""), Picture, within_s=86_400.0)
        assert VirtualClock().now_s() == 86_400.0
        await bus.close()

    run_virtual(main())


def test_an_asker_of_a_server_taken_back_before_its_bus_closed_is_not_left_waiting() -> None:
    async def main() -> None:
        network = LocalNetwork()
        server, asker = (network.join(f"backbone/{name}", VirtualClock()) for name in ("server", "asker"))

        async def never(asked: Envelope[Any]) -> Message:
            await asyncio.Event().wait()
            return asked.body

        serving = server.serve("backbone/server", Picture, never)
        asking = asyncio.create_task(asker.ask("backbone/server", Picture(b""), Picture, within_s=60.0))
        await VirtualClock().sleep_s(0.1)
        serving.close()
        await server.close()
        with pytest.raises(NoResponder):
            await asking
        assert VirtualClock().now_s() == pytest.approx(0.1)

    run_virtual(main())


def test_two_components_that_wait_for_each_other_are_found_at_once() -> None:
    async def main() -> None:
        network = LocalNetwork()
        network.join("backbone/a", VirtualClock())
        await asyncio.Event().wait()

    with pytest.raises(NothingLeftToHappen):
        run_virtual(main())


def test_a_message_that_is_too_long_to_be_overheard_reaches_its_listeners_all_the_same() -> None:
    async def scene() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        sender, listener = network.join("resource_pool/a", clock), network.join("resource_pool/b", clock)
        heard, overheard = list[int](), list[str]()
        listener.subscribe(sender.source, Conversation.OUTPUTS, Picture, lambda e: heard.append(len(e.body.pixels)))
        ear = listener.overhear(Conversation.OUTPUTS, lambda key, _raw: overheard.append(key), 2 * MAX_MESSAGE_BYTES)
        for size in (MAX_MESSAGE_BYTES + 1, 1):
            sender.publish(sender.source, Conversation.OUTPUTS, Picture(bytes(size)))
        await clock.sleep_s(1.0)
        assert heard == [MAX_MESSAGE_BYTES + 1, 1]
        assert (len(overheard), ear.dropped) == (1, 1)

    run_virtual(scene())


def test_inside_one_process_a_bus_knows_that_nobody_hears_it() -> None:
    async def main() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        source, listener = network.join("backbone/source", clock), network.join("backbone/listener", clock)
        assert source.is_unheard(Conversation.POSES)
        elsewhere = listener.subscribe("backbone/other", Conversation.POSES, Picture, lambda _: None)
        assert source.is_unheard(Conversation.POSES)
        subscribed = listener.subscribe("backbone/*", Conversation.POSES, Picture, lambda _: None)
        assert not source.is_unheard(Conversation.POSES)
        assert source.is_unheard(Conversation.EVENTS)
        subscribed.close()
        elsewhere.close()
        assert source.is_unheard(Conversation.POSES)
        listener.overhear(Conversation.TOLD, lambda _key, _raw: None, 1_000_000)
        assert not source.is_unheard(Conversation.POSES), "copies of some conversations go to a recorder"

    run_virtual(main())
