"""Questions and answers: the same on each bus."""

import asyncio
from typing import Any

import pytest
from bus_laws import (
    ASK_S,
    ASKER,
    SERVER,
    THIRD,
    Echo,
    Echoed,
    Net,
    News,
    Other,
    Runner,
    TooLoud,
    echo,
    pair,
    until_known,
    within,
)

from backbone.errors import NoResponder, ReplyTimeout, UnknownRefusal
from backbone.keys import Conversation
from backbone.naming import IllegalName
from backbone.wire import Envelope, MalformedMessage, Message, UnknownMessage


def test_a_question_is_answered(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, _server):
            assert await asker.ask(SERVER, Echo("hello"), Echoed, within_s=ASK_S) == Echoed("hello")
            assert (asker.mission, asker.source) == ("conformance", ASKER)

    on_bus(law)


def test_the_answerer_sees_who_asked_and_when(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        seen: list[Envelope[Any]] = []

        async def answer(asked: Envelope[Any]) -> Message:
            seen.append(asked)
            return Echoed()

        async with pair(net, answer) as (asker, _server):
            before_s = net.clock.now_s()
            await asker.ask(SERVER, Echo("x"), Echoed, within_s=ASK_S)
            assert seen[0].source == ASKER
            assert before_s <= seen[0].stamp_s <= net.clock.now_s()

    on_bus(law)


def test_a_refusal_is_raised_as_the_class_it_had_with_its_facts(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def answer(asked: Envelope[Any]) -> Message:
            raise TooLoud("90 dB", remedy="Go away.", decibels=90, where="hall", indoors=True)

        async with pair(net, answer) as (asker, server):
            with pytest.raises(TooLoud) as refused:
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            assert (refused.value.detail, refused.value.remedy) == ("90 dB", "Go away.")
            assert refused.value.facts == {"decibels": 90, "where": "hall", "indoors": True}
            assert server.statistics().refused == 1

    on_bus(law)


def test_a_refusal_passed_on_by_a_third_keeps_its_class(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def refuse(asked: Envelope[Any]) -> Message:
            raise TooLoud("90 dB")

        async with pair(net, refuse) as (asker, _server):
            third = net.join(THIRD)

            async def pass_on(asked: Envelope[Any]) -> Message:
                return await third.ask(SERVER, asked.body, Echoed, within_s=ASK_S)

            third.serve(THIRD, Echo, pass_on)
            await until_known(third, asker)
            with pytest.raises(TooLoud):
                await asker.ask(THIRD, Echo(), Echoed, within_s=ASK_S)

    on_bus(law)


def test_a_refusal_of_a_class_unknown_to_the_asker_keeps_its_code(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def answer(asked: Envelope[Any]) -> Message:
            raise UnknownRefusal("no", remedy="Ask there.", code="elsewhere.defined")

        async with pair(net, answer) as (asker, _server):
            with pytest.raises(UnknownRefusal) as refused:
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            assert refused.value.facts["code"] == "elsewhere.defined"

    on_bus(law)


def test_nobody_at_the_address_is_no_responder(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        with pytest.raises(NoResponder, match="backbone/nobody"):
            await net.join(ASKER).ask("backbone/nobody", Echo(), Echoed, within_s=ASK_S)

    on_bus(law)


def test_a_server_that_was_closed_is_no_responder(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        server, asker = net.join(SERVER), net.join(ASKER)
        serving = server.serve(SERVER, Echo, echo)
        await until_known(server, asker)
        serving.close()
        serving.close()
        await until_known(server, asker)
        with pytest.raises(NoResponder):
            await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)

    on_bus(law)


def test_a_bus_that_closes_while_it_answers_is_no_responder(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        asked_of = asyncio.Event()

        async def never(asked: Envelope[Any]) -> Message:
            asked_of.set()
            await asyncio.Event().wait()
            return Echoed()

        async with pair(net, never) as (asker, server):
            asking = asyncio.create_task(asker.ask(SERVER, Echo(), Echoed, within_s=60.0))
            await within(asked_of.wait(), "the question arrives")
            await server.close()
            with pytest.raises(NoResponder):
                await within(asking, "the asker hears that the server is gone", 5.0)

    on_bus(law)


def test_a_server_taken_back_while_it_answers_still_answers_what_had_arrived(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        asked_of, go_on = asyncio.Event(), asyncio.Event()

        async def answer(asked: Envelope[Any]) -> Message:
            asked_of.set()
            await go_on.wait()
            return Echoed("late")

        server, asker = net.join(SERVER), net.join(ASKER)
        serving = server.serve(SERVER, Echo, answer)
        await until_known(server, asker)
        asking = asyncio.create_task(asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S))
        await within(asked_of.wait(), "the question arrives")
        serving.close()
        await until_known(server, asker)
        go_on.set()
        assert await asking == Echoed("late")

    on_bus(law)


def test_an_answer_that_does_not_come_is_a_reply_timeout(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def never(asked: Envelope[Any]) -> Message:
            await asyncio.Event().wait()
            return Echoed()

        async with pair(net, never) as (asker, server):
            began_s = net.clock.now_s()
            with pytest.raises(ReplyTimeout, match=r"did not answer Echo within 0\.2 s"):
                await asker.ask(SERVER, Echo(), Echoed, within_s=0.2)
            assert 0.19 <= net.clock.now_s() - began_s < 5.0
            await server.close()

    on_bus(law)


def test_no_time_to_answer_is_a_reply_timeout(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def never(asked: Envelope[Any]) -> Message:
            await asyncio.Event().wait()
            return Echoed()

        async with pair(net, never) as (asker, server):
            for within_s in (0.0, -1.0):
                with pytest.raises(ReplyTimeout):
                    await asker.ask(SERVER, Echo(), Echoed, within_s=within_s)
            await server.close()

    on_bus(law)


def test_an_answer_of_another_class_is_malformed_and_counted(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def wrong(asked: Envelope[Any]) -> Message:
            return Other()

        async with pair(net, wrong) as (asker, _server):
            with pytest.raises(MalformedMessage, match=SERVER):
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            assert asker.statistics().unreadable == 1

    on_bus(law)


def test_an_unknown_question_is_refused_without_calling_the_handler(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def answer(asked: Envelope[Any]) -> Message:
            pytest.fail("called with what it does not accept")

        async with pair(net, answer, Echo | News) as (asker, server):
            with pytest.raises(UnknownMessage) as refused:
                await asker.ask(SERVER, Other(), Echoed, within_s=ASK_S)
            assert refused.value.facts == {"schema": "Other/1", "accepted": "Echo/1, News/1"}
            assert server.statistics().unreadable == 1
            assert server.statistics().answered == 0

    on_bus(law)


def test_questions_are_answered_side_by_side(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        free = asyncio.Event()

        async def answer(asked: Envelope[Any]) -> Message:
            if asked.body.text == "wait":
                await free.wait()
            else:
                free.set()
            return Echoed(asked.body.text)

        async with pair(net, answer) as (asker, _server):
            asking = [asyncio.create_task(asker.ask(SERVER, Echo("wait"), Echoed, within_s=ASK_S)) for _ in range(20)]
            assert await asker.ask(SERVER, Echo("go"), Echoed, within_s=ASK_S) == Echoed("go")
            assert await asyncio.gather(*asking) == [Echoed("wait")] * 20

    on_bus(law)


def test_each_of_many_askers_gets_its_own_answer(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, _server):
            answers = await asyncio.gather(
                *(asker.ask(SERVER, Echo(str(n)), Echoed, within_s=ASK_S) for n in range(100))
            )
            assert [answer.text for answer in answers] == [str(n) for n in range(100)]

    on_bus(law)


def test_a_component_can_ask_itself(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        bus = net.join(SERVER)
        bus.serve(SERVER, Echo, echo)
        assert await bus.ask(SERVER, Echo("me"), Echoed, within_s=ASK_S) == Echoed("me")

    on_bus(law)


def test_asking_can_be_cancelled(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        asked_of, go_on = asyncio.Event(), asyncio.Event()

        async def answer(asked: Envelope[Any]) -> Message:
            asked_of.set()
            await go_on.wait()
            return Echoed(asked.body.text)

        async with pair(net, answer) as (asker, _server):
            asking = asyncio.create_task(asker.ask(SERVER, Echo("first"), Echoed, within_s=60.0))
            await within(asked_of.wait(), "the question arrives")
            asking.cancel()
            with pytest.raises(asyncio.CancelledError):
                await within(asking, "the cancelled question ends")
            go_on.set()
            assert await asker.ask(SERVER, Echo("second"), Echoed, within_s=ASK_S) == Echoed("second")

    on_bus(law)


def test_asking_on_a_closed_bus_is_no_responder(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, _server):
            await asker.close()
            with pytest.raises(NoResponder, match="closed"):
                await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)

    on_bus(law)


def test_closing_ends_the_questions_asked_on_this_bus(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        asked_of = asyncio.Event()

        async def never(asked: Envelope[Any]) -> Message:
            asked_of.set()
            await asyncio.Event().wait()
            return Echoed()

        async with pair(net, never) as (asker, server):
            asking = asyncio.create_task(asker.ask(SERVER, Echo(), Echoed, within_s=60.0))
            await within(asked_of.wait(), "the question arrives")
            await asker.close()
            with pytest.raises(NoResponder):
                await within(asking, "the open question ends", 5.0)
            await server.close()

    on_bus(law)


@pytest.mark.parametrize("address", ["", "backbone//x", "backbone/**", "backbone/a?b", "backbone/#"])
def test_an_address_that_cannot_be_one_is_refused(on_bus: Runner, address: str) -> None:
    async def law(net: Net) -> None:
        bus = net.join(ASKER)
        with pytest.raises(IllegalName):
            await bus.ask(address, Echo(), Echoed, within_s=ASK_S)
        with pytest.raises(IllegalName):
            bus.publish(address, Conversation.EVENTS, News(1))
        with pytest.raises(IllegalName):
            bus.serve(address, Echo, echo)
        with pytest.raises(IllegalName):
            bus.subscribe(address, Conversation.EVENTS, News, print)
        with pytest.raises(IllegalName):
            bus.declare_alive(address)
        with pytest.raises(IllegalName):
            bus.watch_alive(address, print)

    on_bus(law)
