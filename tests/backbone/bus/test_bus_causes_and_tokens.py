"""Causes, liveliness tokens and links: the same on each bus."""

import asyncio
from typing import Any

from bus_laws import (
    ASK_S,
    ASKER,
    SERVER,
    THIRD,
    Echo,
    Echoed,
    Heard,
    Net,
    News,
    Runner,
    pair,
    until_known,
)

from backbone.bus.interface import current_cause
from backbone.keys import Conversation
from backbone.wire import Envelope, Message


def test_causes_run_through_listeners_questions_and_tasks(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        """ASKER says news → THIRD hears, a task of it asks SERVER → SERVER, in a task, says news."""
        asker, third, server = net.join(ASKER), net.join(THIRD), net.join(SERVER)
        tasks: list[asyncio.Task[None]] = []
        questions: list[Envelope[Any]] = []
        results = Heard()

        async def say_later() -> None:
            await net.clock.sleep_s(0.01)
            server.publish(SERVER, Conversation.EVENTS, News(2))

        async def answer(asked: Envelope[Any]) -> Message:
            questions.append(asked)
            tasks.append(asyncio.create_task(say_later()))
            return Echoed()

        async def ask() -> None:
            await net.clock.sleep_s(0.01)
            await third.ask(SERVER, Echo(), Echoed, within_s=ASK_S)

        server.serve(SERVER, Echo, answer)
        third.subscribe(ASKER, Conversation.EVENTS, News, lambda _news: tasks.append(asyncio.create_task(ask())))
        asker.subscribe(SERVER, Conversation.EVENTS, News, results)
        for declared, user in ((server, third), (third, asker), (asker, server)):
            await until_known(declared, user)
        asker.publish(ASKER, Conversation.EVENTS, News(1))
        await results.until_count(1)
        await asyncio.gather(*tasks)
        assert questions[0].cause == f"{ASKER}#1"
        assert results.all[0].cause == questions[0].id
        assert current_cause.get() == ""

    on_bus(law)


def test_what_nothing_led_to_has_no_cause(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        seen: list[str] = []

        async def answer(asked: Envelope[Any]) -> Message:
            seen.append(asked.cause)
            return Echoed()

        async with pair(net, answer) as (asker, _server):
            await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            assert seen == [""]

    on_bus(law)


def test_a_token_is_no_message_and_no_cause(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        watcher, other = net.join(ASKER), net.join(SERVER)
        causes = Heard()
        watcher.watch_alive(THIRD, lambda _address, _alive: causes(current_cause.get()))
        current_cause.set("something#1")
        other.declare_alive(THIRD)
        await causes.until_count(1)
        assert causes.all == [""]

    on_bus(law)


def test_tokens_that_stand_are_told_at_once_and_falls_when_they_happen(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        old, new, watcher = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        old.declare_alive("resource_pool/old")
        await until_known(old, watcher)
        heard = Heard()
        watcher.watch_alive("resource_pool/*", heard)
        await heard.until_count(1)
        token = new.declare_alive("resource_pool/new")
        await heard.until_count(2)
        token.close()
        token.close()
        await heard.until_count(3)
        await old.close()
        assert await heard.until_count(4) == [
            ("resource_pool/old", True),
            ("resource_pool/new", True),
            ("resource_pool/new", False),
            ("resource_pool/old", False),
        ]

    on_bus(law)


def test_tokens_elsewhere_are_not_told(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, watcher = net.join(SERVER), net.join(ASKER)
        heard, claims = Heard(), Heard()
        watcher.watch_alive("resource_pool/*", heard)
        watcher.watch_alive("*/*/*", claims)
        source.declare_alive("backbone/elsewhere")
        source.declare_alive("resource_pool/scout1/host.17")
        source.declare_alive("resource_pool/scout1")
        await heard.until_count(1)
        await claims.until_count(1)
        assert heard.all == [("resource_pool/scout1", True)]
        assert claims.all == [("resource_pool/scout1/host.17", True)]

    on_bus(law)


def test_a_closed_watch_is_told_nothing_more(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, watcher = net.join(SERVER), net.join(ASKER)
        closed, open_ = Heard(), Heard()
        watching = watcher.watch_alive("resource_pool/*", closed)
        watcher.watch_alive("resource_pool/*", open_)
        source.declare_alive("resource_pool/first")
        await closed.until_count(1)
        await open_.until_count(1)
        watching.close()
        source.declare_alive("resource_pool/second")
        await open_.until_count(2)
        assert closed.all == [("resource_pool/first", True)]

    on_bus(law)


def test_a_token_that_stands_on_two_buses_falls_with_the_second(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        first, second, watcher = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        first.declare_alive("resource_pool/twice")
        second.declare_alive("resource_pool/twice")
        for source in (first, second):
            await until_known(source, watcher)
        heard = Heard()
        watcher.watch_alive("resource_pool/*", heard)
        await heard.until_count(1)
        await first.close()
        marks = Heard()
        watcher.watch_alive("backbone/mark", marks)
        second.declare_alive("backbone/mark")
        await marks.until_count(1)
        assert ("resource_pool/twice", False) not in heard.all
        await second.close()
        await heard.until(lambda all_: ("resource_pool/twice", False) in all_, "the fall of the last")

    on_bus(law)


def test_the_link_is_reported_up(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        heard = Heard()
        watching = net.join(ASKER).watch_link(heard)
        await heard.until_count(1)
        assert heard.all == [True]
        watching.close()
        watching.close()

    on_bus(law)
