"""One suite for all buses: what holds on one holds on the others.

The local bus runs in virtual time; the others run over a real hub on the loopback interface: the Zenoh
bus with a session for each component, the shared bus with one session for all of them (neighbors), and
with two sessions that take the components in turn (neighbors and strangers).
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
import uvloop
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock, VirtualClock, VirtualLoop
from backbone.bus.interface import Bus, BusStatistics, Clock, Copies, current_cause
from backbone.bus.local_bus import LocalNetwork
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.errors import NoResponder, Refusal, ReplyTimeout, UnknownRefusal
from backbone.keys import Conversation
from backbone.naming import IllegalName
from backbone.wire import Envelope, MalformedMessage, Message, Reader, Refused, UnknownMessage, write

marks = itertools.count()
DEADLINE_S = 10.0  # of real or virtual time, for anything that must happen; a test fails with a message after it
ASK_S = 5.0
SERVER, ASKER, THIRD = "backbone/server", "ui_console/asker", "resource_pool/third"


class Echo(Message, frozen=True):
    text: str = ""


class Echoed(Message, frozen=True):
    text: str = ""


class Other(Message, frozen=True):
    """A message that no component of these tests accepts."""


class News(Message, frozen=True):
    number: int


class TooLoud(Refusal):
    code = "test.loud"
    remedy = "Whisper."


class Net:
    """Somewhere buses can be opened; closes those it opened."""

    def __init__(self, join: Callable[[str, Clock], Bus], clock: Clock) -> None:
        self._join, self.clock = join, clock
        self.buses: list[Bus] = []

    def join(self, source: str) -> Bus:
        bus = self._join(source, self.clock)
        bus.on_bug = fail_on_bug
        self.buses.append(bus)
        return bus

    async def close(self) -> None:
        for bus in self.buses:
            await bus.close()


Law = Callable[[Net], Awaitable[None]]
Runner = Callable[[Law], None]


def fail_on_bug(bug: BaseException) -> None:
    raise AssertionError("a bug nobody expected here") from bug


@pytest.fixture(params=["local", "zenoh", "shared", "shared by turns"])
def on_bus(request: pytest.FixtureRequest) -> Runner:
    """Return what runs a law on one of the buses."""

    async def on_local(law: Law) -> None:
        network = LocalNetwork("conformance")
        await run_and_close(law, Net(network.join, VirtualClock()))

    async def on_zenoh(law: Law) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        try:
            net = Net(lambda source, own: ZenohBus.open("conformance", source, own, client_config(endpoint)), clock)
            await run_and_close(law, net)
        finally:
            await hub.close()

    async def on_shared(law: Law, processes: int) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        sessions = [SharedSession("conformance", endpoint) for _ in range(processes)]
        turns = itertools.cycle(sessions)
        try:
            await run_and_close(law, Net(lambda source, own: next(turns).join(source, own), clock))
        finally:
            for session in sessions:
                await session.close()
            await hub.close()

    runs: dict[str, Any] = {
        "local": on_local,
        "zenoh": on_zenoh,
        "shared": lambda law: on_shared(law, 1),
        "shared by turns": lambda law: on_shared(law, 2),
    }

    def run(law: Law) -> None:
        local = request.param == "local"
        with asyncio.Runner(loop_factory=VirtualLoop if local else uvloop.new_event_loop) as runner:
            runner.run(runs[request.param](law))

    return run


async def run_and_close(law: Law, net: Net) -> None:
    try:
        await within(law(net), "the whole test")
    finally:
        await net.close()


async def within(work: Awaitable[Any], what: str, limit_s: float = DEADLINE_S) -> Any:
    try:
        async with asyncio.timeout(limit_s):
            return await work
    except TimeoutError:
        pytest.fail(f"not within {limit_s:g} s: {what}")


async def until_known(declared_on: Bus, to: Bus) -> None:
    """Return when what was declared on one bus so far is known on the other: a token declared last says so."""
    risen = asyncio.Event()
    address = f"{declared_on.source}-mark-{next(marks)}"
    token = declared_on.declare_alive(address)
    watching = to.watch_alive(address, lambda _address, alive: risen.set() if alive else None)
    await within(risen.wait(), f"{to.source} hears of {declared_on.source}")
    watching.close()
    token.close()


@asynccontextmanager
async def pair(net: Net, answer: Callable[[Envelope[Any]], Awaitable[Message]], accepts: Any = Echo) -> Any:
    """Give an asker and a server that answers at ``SERVER``."""
    server, asker = net.join(SERVER), net.join(ASKER)
    server.serve(SERVER, accepts, answer)
    await until_known(server, asker)
    yield asker, server


async def echo(asked: Envelope[Any]) -> Message:
    return Echoed(asked.body.text)


class Heard:
    """A listener that can be waited on."""

    def __init__(self) -> None:
        self.all: list[Any] = []
        self._more = asyncio.Event()

    def __call__(self, *what: Any) -> None:
        self.all.append(what[0] if len(what) == 1 else what)
        self._more.set()

    async def until(self, holds: Callable[[list[Any]], bool], what: str) -> list[Any]:
        async def wait() -> None:
            while not holds(self.all):
                self._more.clear()
                await self._more.wait()

        await within(wait(), f"{what}; heard {self.all!r}")
        return self.all

    async def until_count(self, count: int) -> list[Any]:
        return await self.until(lambda heard: len(heard) >= count, f"{count} heard")

    def numbers(self) -> list[int]:
        return [envelope.body.number for envelope in self.all]


# Questions


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


# Publications


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
            told.append((key, Reader(Copies).read(raw).body))
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
            told.append(Reader(Copies).read(raw).body)
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
                told.append((key, Reader(Copies).read(raw).body))
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
            assert server.statistics().published > published

    on_bus(law)


def test_nothing_is_published_of_answers_that_nobody_overhears(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        async with pair(net, echo) as (asker, server):
            for number in range(20):
                await asker.ask(SERVER, Echo(f"{number}"), Echoed, within_s=ASK_S)
            assert server.statistics().published == 0

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


def test_a_publication_of_an_unexpected_schema_is_counted_and_skipped(on_bus: Runner) -> None:
    async def law(net: Net) -> None:
        source, listener = net.join(SERVER), net.join(ASKER)
        heard = Heard()
        listener.subscribe(SERVER, Conversation.EVENTS, News, heard)
        await until_known(listener, source)
        source.publish(SERVER, Conversation.EVENTS, Other())
        source.publish(SERVER, Conversation.EVENTS, News(1))
        await heard.until_count(1)
        assert heard.numbers() == [1]
        assert listener.statistics().unreadable == 1

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


# Causes


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


# Life


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


# Bugs


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


# Statistics and leaving


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
