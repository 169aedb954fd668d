"""Publications: the same on each bus."""

import asyncio
from typing import Any

from bus_laws import ASK_S, ASKER, SERVER, THIRD, Echo, Echoed, Heard, Net, News, Other, Runner, pair, until_known

from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.wire import Envelope, Message


def test_all_publications_of_a_burst_arrive_in_the_order_of_each_source(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        first, second, listener = net.join(SERVER), net.join(THIRD), net.join(ASKER)
        heard = Heard()
        listener.subscribe("*/*", Conversation.EVENTS, News, heard)
        for source in (first, second):
            await until_known(listener, source)
        for number in range(1000):
            first.publish(SERVER, Conversation.EVENTS, News(number))
            second.publish(THIRD, Conversation.EVENTS, News(number))
        await heard.until_count(2000)
        for source in (SERVER, THIRD):
            assert [e.body.number for e in heard.all if e.source == source] == list(range(1000))

    on_bus(law)


def test_sequence_numbers_grow_by_one_with_everything_said(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        heard = Heard()
        seen: list[Envelope[Any]] = []

        async def answer(asked: Envelope[Any]) -> Message:
            seen.append(asked)
            return Echoed()

        async with pair(net, answer) as (asker, server):
            server.subscribe(ASKER, Conversation.EVENTS, News, heard)
            await until_known(server, asker)
            asker.publish(ASKER, Conversation.EVENTS, News(0))
            await asker.ask(SERVER, Echo(), Echoed, within_s=ASK_S)
            asker.publish(ASKER, Conversation.EVENTS, News(1))
            await heard.until_count(2)
            said = [heard.all[0], seen[0], heard.all[1]]
            assert [envelope.sequence for envelope in said] == [1, 2, 3]
            assert [envelope.id for envelope in said] == [f"{ASKER}#{number}" for number in (1, 2, 3)]

    on_bus(law)


def test_only_the_address_and_conversation_subscribed_to_are_heard(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        exact, subsystem, everything = Heard(), Heard(), Heard()
        listener.subscribe("resource_pool/scout1", Conversation.EVENTS, News, exact)
        listener.subscribe("resource_pool/*", Conversation.EVENTS, News, subsystem)
        listener.subscribe("*/*", Conversation.EVENTS, News, everything)
        await until_known(listener, source)
        source.publish("resource_pool/scout1", Conversation.STATUS, News(0))
        source.publish("resource_pool/scout1", Conversation.EVENTS, News(1))
        source.publish("resource_pool/scout10", Conversation.EVENTS, News(2))
        source.publish("backbone/scout1", Conversation.EVENTS, News(3))
        source.publish("backbone/scout1/claim", Conversation.EVENTS, News(4))
        source.publish("resource_pool/scout1", Conversation.EVENTS, News(5))
        for heard in (exact, subsystem, everything):
            await heard.until(lambda all_: all_ != [] and all_[-1].body.number == 5, "the last publication")
        assert exact.numbers() == [1, 5]
        assert subsystem.numbers() == [1, 2, 5]
        assert everything.numbers() == [1, 2, 3, 5]

    on_bus(law)


def test_latest_keeps_the_newest_of_each_address(on_bus: Runner) -> None:
    """Each delivery may overtake older ones, but the last said at an address is always delivered, and last."""

    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard, every = Heard(), Heard()
        listener.subscribe("resource_pool/*", Conversation.STATUS, News, heard, latest=True)
        listener.subscribe("resource_pool/*", Conversation.STATUS, News, every)
        await until_known(listener, source)
        for number in range(200):
            source.publish(f"resource_pool/scout{number % 2}", Conversation.STATUS, News(number))
        await every.until_count(200)
        await heard.until(lambda _all: {198, 199} <= set(heard.numbers()), "the newest of both addresses")
        for robot in (0, 1):
            numbers = [number for number in heard.numbers() if number % 2 == robot]
            assert numbers == sorted(set(numbers))

    on_bus(law)


def test_latest_ends_with_the_newest_of_a_burst(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard, every = Heard(), Heard()
        listener.subscribe(SERVER, Conversation.FRAMES, News, heard, latest=True)
        listener.subscribe(SERVER, Conversation.FRAMES, News, every)
        await until_known(listener, source)
        for number in range(50):
            source.publish(SERVER, Conversation.FRAMES, News(number))
        await every.until(lambda _all: 49 in every.numbers(), "the whole burst")
        await heard.until(lambda _all: 49 in heard.numbers(), "the newest")
        assert heard.numbers() == sorted(set(heard.numbers()))

    on_bus(law)


def test_a_newcomer_hears_nothing_from_before_also_if_another_listener_heard_it(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, first, second = net.join(SERVER), net.join(ASKER), net.join(THIRD)
        early, late, sent = Heard(), Heard(), 20
        first.subscribe(SERVER, Conversation.FRAMES, News, early, latest=True)
        await until_known(first, source)
        for number in range(sent):
            source.publish(SERVER, Conversation.FRAMES, News(number))
            await net.clock.sleep_s(0.01)  # so that the first listener has found its way to the sender
        await early.until(lambda all_: all_[-1].body.number == sent - 1, "the newest of the early ones")
        second.subscribe(SERVER, Conversation.FRAMES, News, late, latest=True)
        await until_known(second, source)
        await net.clock.sleep_s(0.1)
        source.publish(SERVER, Conversation.FRAMES, News(sent))
        for heard in (early, late):
            await heard.until(lambda all_: bool(all_) and all_[-1].body.number == sent, "the next one")
        assert late.numbers() == [sent]

    on_bus(law)


def test_a_publication_of_an_unexpected_schema_is_counted_and_skipped(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard, told = Heard(), dict[str, Refusal]()
        listener.on_unreadable = told.__setitem__
        listener.subscribe(SERVER, Conversation.EVENTS, News, heard)
        await until_known(listener, source)
        source.publish(SERVER, Conversation.EVENTS, Other())
        source.publish(SERVER, Conversation.EVENTS, News(1))
        await heard.until_count(1)
        assert heard.numbers() == [1]
        assert listener.statistics().unreadable == 1
        [(key, why)] = told.items()
        assert key.endswith(f"{SERVER}/events")
        assert "Other" in why.detail

    on_bus(law)


def test_a_closed_subscription_hears_nothing_more(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        closed, open_ = Heard(), Heard()
        subscription = listener.subscribe(SERVER, Conversation.EVENTS, News, closed)
        listener.subscribe(SERVER, Conversation.EVENTS, News, open_)
        await until_known(listener, source)
        source.publish(SERVER, Conversation.EVENTS, News(1))
        await open_.until_count(1)
        await closed.until_count(1)
        subscription.close()
        subscription.close()
        await until_known(listener, source)
        source.publish(SERVER, Conversation.EVENTS, News(2))
        await open_.until_count(2)
        assert closed.numbers() == [1]

    on_bus(law)


def test_publishing_to_nobody_and_on_a_closed_bus_does_nothing(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        bus = net.join(SERVER)
        bus.publish(SERVER, Conversation.EVENTS, News(1))
        await bus.close()
        bus.publish(SERVER, Conversation.EVENTS, News(2))
        assert bus.statistics().published == 1

    on_bus(law)


class Picture(Message, frozen=True):
    number: int
    pixels: bytes


def test_a_lossless_listener_gets_every_picture_of_a_burst_in_order(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        sender, keen, idle = net.join(SERVER), net.join(ASKER), net.join(THIRD)
        every, also, newest = Heard(), Heard(), Heard()
        keen.subscribe(SERVER, Conversation.FRAMES, Picture, every, lossless=True)
        keen.subscribe("*/*", Conversation.FRAMES, Picture, also, lossless=True)
        idle.subscribe(SERVER, Conversation.FRAMES, Picture, newest, latest=True)
        for listener in (keen, idle):
            await until_known(listener, sender)
        for number in range(200):
            sender.publish(SERVER, Conversation.FRAMES, Picture(number, bytes(76_800)))
        for heard in (every, also):
            await heard.until_count(200)
            assert heard.numbers() == list(range(200))
        number = 200
        while not any(one.body.number > 0 for one in newest.all):  # all of a burst but its first may be dropped for it
            sender.publish(SERVER, Conversation.FRAMES, Picture(number, bytes(76_800)))
            number += 1
            await asyncio.sleep(0.05)
        assert SERVER + "/frames" not in keen.dropped()

    on_bus(law)


def test_a_lossless_listener_gets_what_is_sent_once_and_repeated_things_too_and_nothing_after_its_close(
    on_bus: Runner,
) -> None:
    async def law(net: Net) -> None:
        sender, keen = net.join(SERVER), net.join(ASKER)
        heard = Heard()
        subscriptions = [
            keen.subscribe(SERVER, conversation, News, heard, lossless=True)
            for conversation in (Conversation.EVENTS, Conversation.READINGS)
        ]
        await until_known(keen, sender)
        for conversation in (Conversation.EVENTS, Conversation.READINGS, Conversation.TELEMETRY):
            sender.publish(SERVER, conversation, News(1))
        await heard.until_count(2)
        for one in subscriptions:
            one.close()
        await until_known(keen, sender)
        sender.publish(SERVER, Conversation.EVENTS, News(2))
        sender.publish(SERVER, Conversation.READINGS, News(2))
        await until_known(sender, keen)
        assert heard.numbers() == [1, 1]

    on_bus(law)


def test_what_a_listener_of_the_newest_did_not_get_is_counted_by_key(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        sender, listener = net.join(SERVER), net.join(ASKER)
        newest = Heard()
        listener.subscribe(SERVER, Conversation.STATUS, News, newest, latest=True)
        await until_known(listener, sender)
        for number in range(100):
            sender.publish(SERVER, Conversation.STATUS, News(number))
        await newest.until(lambda heard: bool(heard) and heard[-1].body.number == 99, "the newest")
        assert listener.dropped().get(f"{SERVER}/status", 0) == 100 - len(newest.all)

    on_bus(law)
