"""Overhearing, and copies for those who overhear: the same on each bus."""

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
    Heard,
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

from backbone.bus.interface import Copies, Told
from backbone.errors import NoResponder, ReplyTimeout
from backbone.keys import Conversation
from backbone.wire import Envelope, Message, Reader, Refused, UnknownMessage, write


def test_a_conversation_is_overheard_whoever_says_what_in_it(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, other, listener = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        heard: list[tuple[str, int]] = []
        came = asyncio.Event()

        def overheard(key: str, raw: bytes) -> None:
            heard.append((key, Reader(News).read(raw).body.number))
            came.set()

        subscribed = listener.overhear(Conversation.POSES, overheard, 1_000_000)
        await until_known(listener, source)
        await until_known(listener, other)
        source.publish("resource_pool/scout1", Conversation.STATUS, News(0))
        source.publish("resource_pool/scout1", Conversation.POSES, News(1))
        source.publish("backbone/scout1/claim", Conversation.POSES, News(2))
        other.publish(THIRD, Conversation.POSES, News(3))

        async def all_came() -> None:
            while len(heard) < 3:
                came.clear()
                await came.wait()

        await within(all_came(), "all three")
        assert sorted(heard, key=lambda one: one[1]) == [
            ("scout/conformance/resource_pool/scout1/poses", 1),
            ("scout/conformance/backbone/scout1/claim/poses", 2),
            (f"scout/conformance/{THIRD}/poses", 3),
        ]
        assert subscribed.dropped == 0
        subscribed.close()
        subscribed.close()

    on_bus(law)


def test_one_component_is_overheard_and_no_other_copies_anything(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, other, listener = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        told, came = list[tuple[str, Copies]](), asyncio.Event()

        def overheard(key: str, raw: bytes) -> None:
            told.extend((key, copies) for copies in Reader(Told).read(raw).body.copies)
            came.set()

        listener.overhear(Conversation.TOLD, overheard, 1_000_000, SERVER)
        await until_known(listener, source)
        await until_known(listener, other)

        while not told:  # the sender knows of a listener a moment later
            source.publish(SERVER, Conversation.STATUS, News(0))
            await net.clock.sleep_s(0.005)
        other.publish(THIRD, Conversation.STATUS, News(1))
        source.publish(SERVER, Conversation.STATUS, News(2))

        async def last_came() -> None:
            while Reader(News).read(told[-1][1].messages[0]).body.number != 2:
                came.clear()
                await came.wait()

        await within(last_came(), "the last copy")
        assert {key for key, _ in told} == {f"scout/conformance/{SERVER}/told"}

    on_bus(law)


def test_who_overhears_too_slowly_loses_messages_and_knows_how_many(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard, last = [0], Heard()
        most = 20 * len(write(Envelope(1, SERVER, 1, 0.0, "", News(1))))

        def overheard(_key: str, _raw: bytes) -> None:
            heard[0] += 1

        listener.subscribe(SERVER, Conversation.STATUS, News, last)
        subscribed = listener.overhear(Conversation.EVENTS, overheard, most)
        await until_known(listener, source)
        for number in range(500):
            source.publish(SERVER, Conversation.EVENTS, News(number))
        await until_known(source, listener)
        while heard[0] + subscribed.dropped < 500:
            await net.clock.sleep_s(0.01)
        source.publish(SERVER, Conversation.EVENTS, News(1))
        source.publish(SERVER, Conversation.STATUS, News(2))
        await last.until_count(1)
        while heard[0] + subscribed.dropped < 501:
            await net.clock.sleep_s(0.01)
        assert heard[0] >= 20

    on_bus(law)


def test_what_is_never_dropped_is_told_in_copies_without_a_number_of_their_own(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        told, heard = list[Copies](), Heard()
        came = asyncio.Event()

        def overheard(_key: str, raw: bytes) -> None:
            told.extend(Reader(Told).read(raw).body.copies)
            came.set()

        listener.overhear(Conversation.TOLD, overheard, 1_000_000)
        listener.subscribe("*/*", Conversation.STATUS, News, heard)
        await until_known(listener, source)
        while not told:  # the sender knows of a listener a moment later
            source.publish(SERVER, Conversation.STATUS, News(0))
            await net.clock.sleep_s(0.005)
        for number in range(1, 4):
            source.publish(THIRD, Conversation.STATUS, News(number))
            source.publish(THIRD, Conversation.POSES, News(10 * number))

        async def all_came() -> None:
            while told[-1].address != THIRD or Reader(News).read(told[-1].messages[0]).body.number < 3:
                came.clear()
                await came.wait()

        await within(all_came(), "the last copy")
        await heard.until(lambda all_: all_ != [] and all_[-1].body.number == 3, "the last status")
        copies = [Reader(News).read(one.messages[0]) for one in told if one.address == THIRD]
        assert [copy.body.number for copy in copies] == [1, 2, 3], "poses can be overheard directly"
        assert copies == heard.all[-3:]
        numbers = [copy.sequence for copy in copies]
        assert numbers == [numbers[0], numbers[0] + 2, numbers[0] + 4], "the poses are between them, and nothing else"

    on_bus(law)


def test_questions_are_told_with_their_answers_while_somebody_overhears_that(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async def answer(asked: Envelope[Any]) -> Message:
            if asked.body.text == "loud":
                raise TooLoud("too loud")
            return Echoed(asked.body.text)

        async with pair(net, answer) as (asker, server):
            await asker.ask(SERVER, Echo("before"), Echoed, within_s=ASK_S)
            published = server.statistics().published
            listener, told = net.join(THIRD), list[tuple[str, Copies]]()
            came = asyncio.Event()

            def overheard(key: str, raw: bytes) -> None:
                told.extend((key, copies) for copies in Reader(Told).read(raw).body.copies)
                came.set()

            subscribed = listener.overhear(Conversation.TOLD, overheard, 1_000_000)
            await until_known(listener, server)
            while not told:  # the answerer knows of a listener a moment later
                await asker.ask(SERVER, Echo("knows"), Echoed, within_s=ASK_S)
                await net.clock.sleep_s(0.005)
            told.clear()
            await asker.ask(SERVER, Echo("hello"), Echoed, within_s=ASK_S)
            with pytest.raises(TooLoud):
                await asker.ask(SERVER, Echo("loud"), Echoed, within_s=ASK_S)

            async def both() -> None:
                while not (told and b"loud" in told[-1][1].messages[0]):
                    came.clear()
                    await came.wait()

            await within(both(), "question and answer")
            key, refused = told[-1]
            assert key == f"scout/conformance/{SERVER}/told"
            assert (refused.address, refused.conversation) == (SERVER, "ask")
            question, reply = Reader(Echo).read(refused.messages[0]), Reader(Refused).read(refused.messages[1])
            assert (question.source, question.body) == (ASKER, Echo("loud"))
            assert (reply.source, reply.cause, reply.body.code) == (SERVER, question.id, "test.loud")
            assert Reader(Echoed).read(told[-2][1].messages[1]).body == Echoed("hello")
            subscribed.close()
            assert server.statistics().told > 0
            assert server.statistics().published == published, "copies are counted apart"

    on_bus(law)


def test_a_question_that_is_not_answered_here_is_told_with_its_refusal(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        listener, told, came = net.join(THIRD), list[Copies](), asyncio.Event()

        def overheard(_key: str, raw: bytes) -> None:
            told.extend(Reader(Told).read(raw).body.copies)
            came.set()

        async with pair(net, echo) as (asker, server):
            listener.overhear(Conversation.TOLD, overheard, 1_000_000)
            await until_known(listener, server)

            async def told_one() -> None:
                while not told:  # the answerer knows of a listener a moment later
                    with pytest.raises(UnknownMessage):
                        await asker.ask(SERVER, Other(), Echoed, within_s=ASK_S)
                    await net.clock.sleep_s(0.02)

            await within(told_one(), "the question and its refusal")
            question, reply = (
                Reader(kind).read(raw) for kind, raw in zip((Other, Refused), told[0].messages, strict=True)
            )
            assert (question.source, question.body) == (ASKER, Other())
            assert (reply.source, reply.cause, reply.body.code) == (SERVER, "", UnknownMessage.code)

    on_bus(law)


@pytest.mark.parametrize("ends", ["no responder", "reply timeout", "cancelled"])
def test_the_asker_copies_a_question_without_an_answer_once(on_bus: Runner, ends: str) -> None:
    async def hang(_asked: Envelope[Any]) -> Message:
        await asyncio.Event().wait()
        raise AssertionError("waits for ever")

    async def law(net: Net) -> None:
        listener, told, came, asked = net.join(THIRD), list[Copies](), asyncio.Event(), list[str]()

        def overheard(_key: str, raw: bytes) -> None:
            told.extend(Reader(Told).read(raw).body.copies)
            came.set()

        async with pair(net, hang) as (asker, server):

            async def ask_in_vain(text: str) -> None:
                asked.append(text)
                within_s = ASK_S if ends == "no responder" else 0.02
                asking = asker.ask(SERVER, Echo(text), Echoed, within_s=within_s)
                match ends:
                    case "no responder":
                        with pytest.raises(NoResponder):
                            await asking
                    case "reply timeout":
                        with pytest.raises(ReplyTimeout):
                            await asking
                    case _:
                        task = asyncio.create_task(asking)
                        await net.clock.sleep_s(0.005)
                        task.cancel()
                        await asyncio.wait({task})

            async def heard_one() -> None:
                while not told:  # the asker knows of a listener a moment later
                    await ask_in_vain(f"number {len(asked)}")
                    await net.clock.sleep_s(0.005)

            async def heard_last() -> None:
                while Reader(Echo).read(told[-1].messages[-1]).body.text != "last":
                    came.clear()
                    await came.wait()

            if ends == "no responder":
                await server.close()
            listener.overhear(Conversation.TOLD, overheard, 1_000_000)
            await until_known(listener, asker)
            await within(heard_one(), "a question without an answer")
            await ask_in_vain("last")
            await within(heard_last(), "the last question")
            assert {(one.address, one.conversation) for one in told} == {(SERVER, "ask")}
            questions = [Reader(Echo).read(raw) for one in told for raw in one.messages]
            assert [question.body.text for question in questions] == asked[-len(questions) :]
            assert {question.source for question in questions} == {ASKER}

    on_bus(law)


def test_nothing_is_published_of_answers_that_nobody_overhears(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, server):
            for number in range(20):
                await asker.ask(SERVER, Echo(f"{number}"), Echoed, within_s=ASK_S)
            assert server.statistics().told == 0

    on_bus(law)


def test_the_copies_of_a_burst_arrive_in_order_although_the_bus_closes_at_once(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        numbers, came = list[int](), asyncio.Event()

        def overheard(_key: str, raw: bytes) -> None:
            for copies in Reader(Told).read(raw).body.copies:
                numbers.extend(Reader(News).read(quoted).body.number for quoted in copies.messages)
            came.set()

        listener.overhear(Conversation.TOLD, overheard, 1_000_000)
        await until_known(listener, source)
        while not numbers:  # the sender knows of a listener a moment later
            source.publish(SERVER, Conversation.STATUS, News(0))
            await net.clock.sleep_s(0.005)
        for number in range(1, 601):
            source.publish(SERVER, Conversation.STATUS, News(number))
        await source.close()

        async def all_came() -> None:
            while numbers[-1] < 600:
                came.clear()
                await came.wait()

        await within(all_came(), "the last copy")
        assert [number for number in numbers if number] == [*range(1, 601)]

    on_bus(law)


def test_who_overhears_without_loss_gets_all_of_a_burst_and_copies_too(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, other, listener = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        frames, told = list[tuple[str, int]](), list[int]()
        came = asyncio.Event()

        def seen(key: str, raw: bytes) -> None:
            frames.append((key, Reader(Picture).read(raw).body.number))
            came.set()

        def copied(_key: str, raw: bytes) -> None:
            for copies in Reader(Told).read(raw).body.copies:
                told.extend(Reader(News).read(one).body.number for one in copies.messages)
            came.set()

        subscribed = [
            listener.overhear(Conversation.TOLD, copied, 1, SERVER, lossless=True),
            listener.overhear(Conversation.FRAMES, seen, 1, lossless=True),
        ]
        for one in (source, other):
            await until_known(listener, one)
        for number in range(200):
            source.publish("resource_pool/a", Conversation.FRAMES, Picture(number, bytes(76_800)))
            source.publish(SERVER, Conversation.EVENTS, News(number))
            other.publish("resource_pool/b/c", Conversation.FRAMES, Picture(number, b""))

        async def all_came() -> None:
            while len(frames) < 400 or len(told) < 200:
                came.clear()
                await came.wait()

        await within(all_came(), "all")
        for of in ("resource_pool/a", "resource_pool/b/c"):
            of_one = [number for key, number in frames if key == f"scout/conformance/{of}/frames"]
            assert of_one == list(range(200))
        assert told == list(range(200))
        assert [one.dropped for one in subscribed] == [0, 0]
        for one in subscribed:
            one.close()

    on_bus(law)


class Picture(Message, frozen=True):
    number: int
    pixels: bytes


def test_a_bus_never_says_that_nobody_hears_it_while_somebody_does(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener, recorder = net.join(SERVER), net.join(ASKER), net.join(THIRD)
        heard = Heard()
        subscribed = listener.subscribe(SERVER, Conversation.POSES, News, heard)
        assert not source.is_unheard(Conversation.POSES)
        subscribed.close()
        recorder.overhear(Conversation.POSES, lambda _key, _raw: None, 1_000_000)
        assert not source.is_unheard(Conversation.POSES)

    on_bus(law)
