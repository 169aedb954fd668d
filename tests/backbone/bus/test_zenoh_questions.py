"""Questions to a component that is asked repeatedly: they hold what queries hold, by another way."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
import zenoh
from bus_laws import Echo, Echoed, TooLoud
from free_ports import free_endpoint

from backbone.bus import host_entries, zenoh_questions
from backbone.bus.answers import Came, NoInbox
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Answer
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.errors import NoResponder, ReplyTimeout
from backbone.wire import MAX_MESSAGE_BYTES, Envelope, Message

MISSION, SERVER, ASKER = "direct", "backbone/server", "ui_console/asker"
CLOCK = MissionClock.started_now()
DEADLINE_S = 10.0


async def echo(asked: Envelope[Echo]) -> Message:
    """Answer with the same text; ``loud`` is refused, ``slow`` is never answered, ``bug`` is one."""
    match asked.body.text:
        case "loud":
            raise TooLoud("too loud")
        case "slow":
            await asyncio.Event().wait()
        case "bug":
            raise ZeroDivisionError
        case text:
            return Echoed(text)
    raise AssertionError


@pytest.fixture(params=["through the hub", "by a line"])
def way(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return which way questions go that are asked again, also in further processes."""
    monkeypatch.setenv("FOLDER", str(tmp_path) if request.param == "by a line" else "")
    return request.param


@pytest.fixture
async def endpoint(way: str) -> AsyncIterator[str]:
    """Return the endpoint of a hub."""
    at = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([at]))
    yield at
    await hub.close()


@asynccontextmanager
async def joined(endpoint: str, source: str) -> AsyncIterator[ZenohBus]:
    """Give a bus that ignores bugs of answers."""
    bus = ZenohBus.open(MISSION, source, CLOCK, client_config(endpoint))
    bus.use_host(os.environ.get("FOLDER", ""))
    bus.on_bug = lambda bug: None if isinstance(bug, ZeroDivisionError) else pytest.fail(repr(bug))
    try:
        yield bus
    finally:
        await bus.close()


@asynccontextmanager
async def serving(endpoint: str, answer: Answer = echo) -> AsyncIterator[ZenohBus]:
    """Give a server that echoes."""
    async with joined(endpoint, SERVER) as server:
        server.serve(SERVER, Echo, answer)
        server.declare_alive(SERVER)
        yield server


async def ask(asker: ZenohBus, text: str, within_s: float = DEADLINE_S) -> str:
    return (await asker.ask(SERVER, Echo(text), Echoed, within_s=within_s)).text


async def until_served(asker: ZenohBus) -> None:
    """Return when the server's token stands."""
    risen = asyncio.Event()
    watching = asker.watch_alive(SERVER, lambda _address, alive: risen.set() if alive else None)
    await asyncio.wait_for(risen.wait(), DEADLINE_S)
    watching.close()


async def on_the_way(asker: ZenohBus) -> None:
    """Return when the asker has a way to the server."""
    await until_served(asker)
    async with asyncio.timeout(DEADLINE_S):
        while asker.ways.way_to(SERVER) is None:
            await ask(asker, "again")


async def test_after_two_answers_there_is_a_way_and_all_answers_are_as_by_queries(endpoint: str) -> None:
    async with serving(endpoint), joined(endpoint, ASKER) as asker:
        await on_the_way(asker)
        assert [await ask(asker, str(number)) for number in range(20)] == [str(number) for number in range(20)]
        with pytest.raises(TooLoud, match="too loud"):
            await ask(asker, "loud")
        with pytest.raises(ReplyTimeout):
            await ask(asker, "slow", 0.05)
        with pytest.raises(NoResponder):
            await ask(asker, "bug")
        assert asker.ways.way_to(SERVER) is not None


async def test_a_question_that_goes_a_second_way_has_no_more_time_than_was_given(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def nobody_has_the_inbox_any_more(*_asked: object) -> Came:
        await asyncio.sleep(0.8)
        return NoInbox

    loop = asyncio.get_running_loop()
    async with serving(endpoint), joined(endpoint, ASKER) as asker:
        await on_the_way(asker)
        monkeypatch.setattr(asker.ways, "ask", nobody_has_the_inbox_any_more)
        began_s = loop.time()
        with pytest.raises(ReplyTimeout, match="within 1 s"):
            await ask(asker, "slow", 1.0)
        assert loop.time() - began_s < 1.5


async def test_whoever_is_asked_beyond_the_most_ways_makes_none_change(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zenoh_questions, "MOST_WAYS", 1)
    async with serving(endpoint), joined(endpoint, "backbone/other") as other, joined(endpoint, ASKER) as asker:
        other.serve("backbone/other", Echo, echo)
        await on_the_way(asker)
        kept = asker.ways.way_to(SERVER)
        for _ in range(10):
            assert (await asker.ask("backbone/other", Echo("b"), Echoed, within_s=DEADLINE_S)).text == "b"
            assert await ask(asker, "a") == "a"
        assert asker.ways.way_to(SERVER) is kept


async def test_a_component_that_is_asked_once_has_no_way_unless_it_is_on_this_host(endpoint: str, way: str) -> None:
    async with serving(endpoint), joined(endpoint, ASKER) as asker:
        await until_served(asker)
        assert await ask(asker, "once") == "once"
        await asyncio.sleep(0.1)  # a way would open within milliseconds
        assert (asker.ways.way_to(SERVER) is None) is (way == "through the hub")


async def test_questions_keep_their_order_over_the_change_from_queries_to_the_way(endpoint: str) -> None:
    came: list[str] = []

    async def note(asked: Envelope[Echo]) -> Message:
        came.append(asked.body.text)
        return Echoed(asked.body.text)

    async with serving(endpoint, note), joined(endpoint, ASKER) as asker:
        await until_served(asker)
        sent = [str(number) for number in range(400)]
        tasks = []
        for text in sent:
            tasks.append(asyncio.create_task(ask(asker, text)))
            if len(tasks) % 7 == 0:
                await asyncio.sleep(0.001)
        assert await asyncio.gather(*tasks) == sent
        assert came == sent


async def test_a_server_that_begins_anew_is_found_again_and_open_questions_end(endpoint: str) -> None:
    async with joined(endpoint, ASKER) as asker:
        for _life in range(5):
            async with serving(endpoint):
                await on_the_way(asker)
                waiting = asyncio.create_task(ask(asker, "slow"))
                await ask(asker, "behind it")
            with pytest.raises(NoResponder):
                await asyncio.wait_for(waiting, DEADLINE_S)
            with pytest.raises(NoResponder):
                await ask(asker, "nobody")


async def test_an_answer_that_was_given_before_the_end_arrives(endpoint: str) -> None:
    """The report that the inbox has no owner may overtake the answer."""
    given = asyncio.Event()

    async def last_words(asked: Envelope[Echo]) -> Message:
        if asked.body.text == "last":
            given.set()  # the answer is sent in the same step
        return Echoed(asked.body.text)

    async with joined(endpoint, ASKER) as asker:
        for _life in range(40):
            given.clear()
            async with serving(endpoint, last_words):
                await on_the_way(asker)
                last = asyncio.create_task(ask(asker, "last"))
                await asyncio.wait_for(given.wait(), DEADLINE_S)
            assert await last == "last"


async def test_on_one_host_questions_are_answered_without_the_hub(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FOLDER", str(tmp_path))
    at = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([at]))
    async with serving(at), joined(at, ASKER) as asker:
        await hub.close()
        assert [await ask(asker, str(number)) for number in range(10)] == [str(number) for number in range(10)]


@pytest.mark.parametrize("entry", [b"0ff\nan/inbox", b"0ff", b"a\nb\nc", b"\xff\n\xff", b"", b"\0\n\0"])
async def test_a_component_is_asked_through_the_hub_if_its_entry_leads_to_no_process(
    entry: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a killed process leaves it, or as no component writes it."""
    monkeypatch.setenv("FOLDER", str(tmp_path))
    at = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([at]))
    async with serving(at), joined(at, ASKER) as asker:
        [own] = [file for file in (tmp_path / host_entries.FOLDER).iterdir() if not file.name.startswith(".")]
        own.write_bytes(entry)
        await until_served(asker)
        assert [await ask(asker, str(number)) for number in range(5)] == [str(number) for number in range(5)]
    await hub.close()


async def test_bytes_of_any_kind_end_neither_server_nor_asker(endpoint: str) -> None:
    async with serving(endpoint) as server, joined(endpoint, ASKER) as asker:
        await on_the_way(asker)
        inbox, answers = asker.ways.way_to(SERVER), asker.ways.questions.answers
        assert inbox is not None
        with zenoh.open(client_config(endpoint)) as stranger:
            for attachment in (
                None,
                b"",
                b"\xff" * 8,
                b"\0" * 2000,
                b"\0" * 8 + b"scout/direct/**/answers/0",
                b"\2",
                b"\1" * 9,
            ):
                for payload in (b"", b"\xc1", os.urandom(100)):
                    for name in (inbox.inbox, answers):
                        stranger.put(name, payload, attachment=attachment)
            for name in (inbox.inbox, answers):
                stranger.put(name, bytes(MAX_MESSAGE_BYTES + 1), attachment=b"\1" * 9)
            async with asyncio.timeout(DEADLINE_S):
                while server.statistics().unreadable < 20:
                    with suppress(NoResponder):  # on a busy machine the long values may cost a link
                        await ask(asker, "meanwhile")
        assert await ask(asker, "still there") == "still there"


PROGRAM = """
import asyncio, sys
sys.path[:0] = {path!r}
from test_zenoh_questions import SERVER, serving
async def main():
    async with serving(sys.argv[1]):
        await asyncio.Event().wait()
asyncio.run(main())
"""


@pytest.mark.processes
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
async def test_a_killed_server_ends_the_open_questions(endpoint: str, number: signal.Signals) -> None:
    path = [entry for entry in sys.path if "tests" in entry]
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", PROGRAM.format(path=path), endpoint)
    try:
        async with joined(endpoint, ASKER) as asker:
            await on_the_way(asker)
            waiting = [asyncio.create_task(ask(asker, "slow")) for _ in range(3)]
            await ask(asker, "behind them")
            process.send_signal(number)
            for one in waiting:
                with pytest.raises(NoResponder):
                    await asyncio.wait_for(one, DEADLINE_S / 2)
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()
