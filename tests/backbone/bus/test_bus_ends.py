"""Bugs, counts and ends: the same on each bus."""

import asyncio
from typing import Any

import pytest
from bus_laws import (
    ASK_S,
    ASKER,
    SERVER,
    Echo,
    Echoed,
    Heard,
    Net,
    News,
    Runner,
    TooLoud,
    echo,
    pair,
    until_known,
    within,
)

from backbone.bus.interface import BusStatistics
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.wire import Envelope, Message


def test_a_bug_in_an_answer_goes_to_on_bug_and_the_asker_gets_no_responder(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        bugs: list[BaseException] = []

        async def answer(asked: Envelope[Any]) -> Message:
            if asked.body.text == "bug":
                raise KeyError("bug")
            return Echoed()

        async with pair(net, answer) as (asker, server):
            server.on_bug = bugs.append
            with pytest.raises(NoResponder):
                await asker.ask(SERVER, Echo("bug"), Echoed, within_s=60.0)
            assert [repr(bug) for bug in bugs] == ["KeyError('bug')"]
            assert await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S) == Echoed()

    on_bus(law)


def test_a_bug_in_a_listener_goes_to_on_bug_and_does_not_stop_the_others(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard, lives, bugs = Heard(), Heard(), Heard()
        listener.on_bug = bugs

        def stumble(*_what: Any) -> None:
            raise KeyError("bug")

        for listen in (stumble, heard):
            listener.subscribe(SERVER, Conversation.EVENTS, News, listen)
            listener.watch_alive("resource_pool/*", stumble if listen is stumble else lives)
        listener.watch_link(stumble)
        await until_known(listener, source)
        for number in range(3):
            source.publish(SERVER, Conversation.EVENTS, News(number))
        source.declare_alive("resource_pool/scout1")
        await heard.until_count(3)
        await lives.until_count(1)
        await bugs.until_count(5)
        assert [type(bug) for bug in bugs.all] == [KeyError] * 5
        assert heard.numbers() == [0, 1, 2]

    on_bus(law)


def test_a_cancellation_in_an_answer_that_no_caller_asked_for_is_a_bug_with_its_place(on_bus: Runner) -> None:
    """``prepare`` of an ARC that took the result of a cancelled task: only "no component answered" was told."""

    async def law(net: Net) -> None:
        bugs = Heard()

        async def answer(_asked: Envelope[Any]) -> Message:
            raise asyncio.CancelledError

        async with pair(net, answer) as (asker, server):
            server.on_bug = bugs
            with pytest.raises(NoResponder):
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            await bugs.until_count(1)
            line = answer.__code__.co_firstlineno + 1
            assert f"an answer of {SERVER} raised CancelledError: ({__file__}, line {line})" in str(bugs.all[0])

    on_bus(law)


def test_a_listener_that_takes_the_result_of_a_cancelled_task_has_a_bug_like_others(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener, work = net.join(SERVER), net.join(ASKER), asyncio.get_running_loop().create_future()
        heard, lives, bugs = Heard(), Heard(), Heard()
        listener.on_bug = bugs
        work.cancel()

        def stumble(*_what: Any) -> None:
            work.result()

        for listen in (stumble, heard):
            listener.subscribe(SERVER, Conversation.EVENTS, News, listen)
            listener.watch_alive("resource_pool/*", stumble if listen is stumble else lives)
        await until_known(listener, source)
        source.publish(SERVER, Conversation.EVENTS, News(1))
        source.declare_alive("resource_pool/scout1")
        await heard.until_count(1)
        await lives.until_count(1)
        await bugs.until_count(2)
        assert [str(bug) for bug in bugs.all] == [f"a callback of {ASKER} raised CancelledError"] * 2

    on_bus(law)


def test_what_passed_is_counted(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def answer(asked: Envelope[Any]) -> Message:
            if asked.body.text:
                raise TooLoud("no")
            return Echoed()

        heard = Heard()
        async with pair(net, answer) as (asker, server):
            server.subscribe(ASKER, Conversation.EVENTS, News, heard)
            await until_known(server, asker)
            await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            with pytest.raises(TooLoud):
                await asker.ask(SERVER, Echo("x"), Echoed, within_s=ASK_S)
            for number in range(3):
                asker.publish(ASKER, Conversation.EVENTS, News(number))
            await heard.until_count(3)
            assert asker.statistics() == BusStatistics(2, 0, 3, 0, 0, 0)
            assert server.statistics() == BusStatistics(0, 2, 0, 3, 1, 0)

    on_bus(law)


def test_closing_takes_back_everything_and_can_be_repeated(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, server):
            heard = Heard()
            server.subscribe(ASKER, Conversation.EVENTS, News, heard)
            server.watch_alive("*/*", heard)
            server.declare_alive(SERVER)
            falls = Heard()
            asker.watch_alive(SERVER, falls)
            await falls.until_count(1)
            await asyncio.gather(server.close(), server.close())
            await server.close()
            await falls.until_count(2)
            count = len(heard.all)
            asker.publish(ASKER, Conversation.EVENTS, News(1))
            asker.declare_alive("resource_pool/late")
            with pytest.raises(NoResponder):
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            assert len(heard.all) == count

    on_bus(law)


def test_declaring_on_a_closed_bus_is_a_bug(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        bus = net.join(SERVER)
        await bus.close()
        for declare in (
            lambda: bus.serve(SERVER, Echo, echo),
            lambda: bus.subscribe(SERVER, Conversation.EVENTS, News, print),
            lambda: bus.declare_alive(SERVER),
            lambda: bus.watch_alive("*/*", print),
            lambda: bus.watch_link(print),
        ):
            with pytest.raises(RuntimeError, match="closed"):
                declare()

    on_bus(law)


def test_an_answer_may_close_its_own_bus(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        closed = asyncio.Event()

        async def leave(asked: Envelope[Any]) -> Message:
            await server.close()
            closed.set()
            return Echoed()

        server, asker = net.join(SERVER), net.join(ASKER)
        server.serve(SERVER, Echo, leave)
        await until_known(server, asker)
        asking = asyncio.create_task(asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S))
        await within(closed.wait(), "the bus is closed from inside")
        await asyncio.wait({asking})
        assert isinstance(asking.exception(), NoResponder | None)

    on_bus(law)


def test_answers_in_progress_are_cancelled_and_waited_for_by_close(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        order: list[str] = []
        asked_of = asyncio.Event()

        async def tidy(asked: Envelope[Any]) -> Message:
            asked_of.set()
            try:
                await asyncio.Event().wait()
            finally:
                await net.clock.sleep_s(0.02)
                order.append("tidied")
            return Echoed()

        async with pair(net, tidy) as (asker, server):
            asking = asyncio.create_task(asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S))
            await within(asked_of.wait(), "the question arrives")
            await server.close()
            order.append("closed")
            assert order == ["tidied", "closed"]
            with pytest.raises(NoResponder):
                await asking

    on_bus(law)


def test_a_question_that_comes_as_its_component_leaves_ends_without_an_answer(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, server):
            for _ in range(10):  # by queries, and then by a way of its own
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
                await net.clock.sleep_s(0.01)
            start = server.start

            def leave_first(work: Any) -> Any:
                closing.append(asyncio.create_task(server.close()))
                return start(work)

            closing: list[asyncio.Task[None]] = []
            server.start = leave_first
            with pytest.raises(NoResponder):
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            await asyncio.gather(*closing)

    on_bus(law)
