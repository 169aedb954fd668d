"""The inbox of a bus whose arrivals come in other threads: a flood of messages delays nothing else for long."""

from __future__ import annotations

import asyncio
import itertools

import pytest

from backbone.bus import inbox
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.inbox import InboxBus
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
