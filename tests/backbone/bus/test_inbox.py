"""The inbox of a bus whose arrivals come in other threads: a flood of messages delays nothing else for long."""

from __future__ import annotations

import asyncio
import itertools
import weakref
from dataclasses import dataclass

import pytest

from backbone.bus import inbox
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.inbox import BATCH_BYTES, InboxBus, OverheardSamples
from backbone.keys import Conversation
from backbone.wire import Message


class Arrivals(InboxBus):
    """A bus without a network."""

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        raise NotImplementedError

    def is_overheard(self, conversation: Conversation) -> bool:
        return False

    def dropped(self) -> dict[str, int]:
        return {}

    def take_back(self) -> None:
        self.empty_inbox()

    async def leave(self) -> None:
        pass


def test_while_messages_flood_in_the_rest_of_the_loop_has_its_turns_and_their_order_is_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spent_s, heard, turns = 0.0, list[int](), list[int]()
    monkeypatch.setattr(inbox.time, "monotonic", lambda: spent_s)

    async def scene() -> None:
        bus = Arrivals("m", "mission_control/ear", VirtualClock())

        def take(number: int) -> None:
            nonlocal spent_s
            spent_s += inbox.AT_ONCE_S / 4
            heard.append(number)
            if number < 200:  # as many more come meanwhile as are handed over
                bus.push(take, number + 100)

        for number in range(100):
            bus.push(take, number)
        while len(heard) < 300:
            await asyncio.sleep(0)
            turns.append(len(heard))
        await bus.close()

    run_virtual(scene())
    assert heard == list(range(300))
    assert max(later - earlier for earlier, later in itertools.pairwise(turns)) <= 5


@dataclass
class Piece:
    """A part of a batch that the network brought."""

    length: int

    def __len__(self) -> int:
        return self.length

    def to_bytes(self) -> bytes:
        return bytes(self.length)


@dataclass
class Came:
    """A publication as it arrives."""

    payload: Piece
    key_expr: object = "scout/m/a/status"
    attachment: None = None


@pytest.mark.parametrize(("length", "keeps_batch"), [(1, False), (BATCH_BYTES - 1, False), (BATCH_BYTES, True)])
def test_a_message_that_waits_keeps_its_batch_only_if_it_is_as_long(length: int, keeps_batch: bool) -> None:
    async def scene() -> tuple[str, bytes]:
        bus, heard = Arrivals("m", "mission_control/ear", VirtualClock()), asyncio.Queue[tuple[str, bytes]]()
        receive = OverheardSamples(bus, lambda key, raw: heard.put_nowait((key, raw)), BATCH_BYTES)
        came = Came(Piece(length))
        batch = weakref.ref(came.payload)
        receive(came)
        del came
        assert (batch() is not None) is keeps_batch
        taken = await heard.get()
        await bus.close()
        return taken

    assert run_virtual(scene()) == ("scout/m/a/status", bytes(length))
