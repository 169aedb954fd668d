"""Commands to listeners of the same host: each goes over a blackboard, in order, and not through the hub."""

from __future__ import annotations

from pathlib import Path

import pytest
from bus_laws import ASKER, SERVER, THIRD, Heard, until_known
from hosts_with_boards import AT, Map, host, picture, until

from backbone.bus import zenoh_outlets
from backbone.keys import Conversation

BURST = 100


@pytest.fixture(autouse=True)
def _known_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_outlets, "KNOWN_AFTER_S", 0.1)


async def test_each_command_comes_once_and_in_order_also_while_the_board_opens(folder: Path) -> None:
    async with host(folder) as near:
        sender, listener = near.join(SERVER), near.join(ASKER)
        heard, sent = Heard(), 0
        listener.subscribe(AT, Conversation.COMMAND, Map, heard)
        await until_known(listener, sender)

        def send() -> None:
            nonlocal sent
            sent += 1
            sender.publish(AT, Conversation.COMMAND, picture(sent, 10))

        def is_near() -> bool:
            return not sender._outlet(AT, Conversation.COMMAND).has_subscriber  # noqa: SLF001  no subscription by network

        send()
        await until(is_near, "commands go by the board alone", send)
        for _ in range(BURST):
            send()
        await heard.until_count(sent)
        assert heard.numbers() == [*range(1, sent + 1)]


async def test_a_listener_gets_no_command_from_before_it_came_and_one_that_goes_disturbs_nobody(folder: Path) -> None:
    async with host(folder) as near:
        sender, first, second = near.join(SERVER), near.join(ASKER), near.join(THIRD)
        early, late, sent = Heard(), Heard(), 0

        def send() -> None:
            nonlocal sent
            sent += 1
            sender.publish(AT, Conversation.COMMAND, picture(sent, 10))

        hearing = first.subscribe(AT, Conversation.COMMAND, Map, early)
        await until_known(first, sender)
        await until(lambda: len(early.all) > 5, "the first listener hears", send)
        before = sent
        second.subscribe(AT, Conversation.COMMAND, Map, late)
        await until(lambda: len(late.all) > 5, "the second listener hears", send)
        assert min(late.numbers()) > before
        hearing.close()
        gone = sent
        await until(lambda: late.all[-1].body.number > gone + 5, "the second listener still hears", send)
        assert late.numbers() == [*range(late.numbers()[0], late.numbers()[-1] + 1)]


async def test_a_listener_of_many_keys_and_one_of_another_host_get_them_by_the_network(folder: Path) -> None:
    async with host(folder) as near:
        sender, wide, far = near.join(SERVER), near.join(ASKER), near.join(THIRD, is_near=False)
        by_pattern, elsewhere, sent = Heard(), Heard(), 0

        def send() -> None:
            nonlocal sent
            sent += 1
            sender.publish(AT, Conversation.COMMAND, picture(sent, 10))

        wide.subscribe("*/*", Conversation.COMMAND, Map, by_pattern)
        far.subscribe(AT, Conversation.COMMAND, Map, elsewhere)
        await until_known(far, sender)
        await until_known(wide, sender)
        await until(lambda: min(len(by_pattern.all), len(elsewhere.all)) > 20, "both hear", send)
        for heard in (by_pattern, elsewhere):
            assert heard.numbers() == [*range(heard.numbers()[0], heard.numbers()[-1] + 1)]
