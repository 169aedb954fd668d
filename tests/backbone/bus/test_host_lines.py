"""Lines between processes of one host: whole messages in order, and an end that nobody misses."""

from __future__ import annotations

import asyncio
import errno
import os
import select
import signal
import socket
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from pathlib import Path

import pytest
import uvloop
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus import host_lines
from backbone.bus.answers import Came, NoInbox
from backbone.bus.host_entries import Entry, HostEntries
from backbone.bus.host_lines import (
    MOST_AT_ONCE,
    MOST_PACKET_BYTES,
    Gathering,
    HostLines,
    HostQuestion,
    Kind,
    LineWay,
    packets_of,
    question_of,
)
from backbone.operating_system import local_sockets

SERVER, INBOX = "backbone/server", "scout/direct/backbone/server/asked/000000000001"
DEADLINE_S = 10.0
pytestmark = pytest.mark.skipif(not local_sockets.IS_POSSIBLE, reason="this system has no such sockets")
bodies = st.one_of(
    st.binary(max_size=20),
    st.integers(MOST_PACKET_BYTES - 12, 3 * MOST_PACKET_BYTES).map(lambda length: os.urandom(16) * (length // 16)),
)


@given(
    messages=st.dictionaries(st.integers(0, 2**64 - 1), st.tuples(st.sampled_from(Kind), bodies), max_size=5),
    data=st.data(),
)
def test_messages_whose_packets_come_in_any_mixture_are_whole(
    messages: dict[int, tuple[Kind, bytes]], data: st.DataObject
) -> None:
    packets = {number: list(packets_of(number, *message)) for number, message in messages.items()}
    assert all(len(packet) <= MOST_PACKET_BYTES for each in packets.values() for packet in each)
    gathering, came = Gathering(), dict[int, tuple[Kind, bytes]]()
    while packets:
        number = data.draw(st.sampled_from(sorted(packets)))
        whole = gathering.take(packets[number].pop(0))
        assert (whole is None) is bool(packets[number])
        if whole is not None:
            came[whole[0]] = whole[1:]
            del packets[number]
    assert came == messages


@given(packet=st.binary(max_size=40))
def test_any_packet_is_taken_or_refused(packet: bytes) -> None:
    with suppress(ValueError):
        Gathering().take(packet)


def test_a_message_that_never_ends_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_lines, "MOST_WAITING_BYTES", 1000)
    gathering, (part, *_rest) = Gathering(), packets_of(1, Kind.ANSWER, bytes(2 * MOST_PACKET_BYTES))
    with pytest.raises(ValueError, match="not whole"):
        gathering.take(part)


def test_messages_that_only_begin_are_refused_however_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_lines, "MOST_WAITING_BYTES", 1000)
    gathering = Gathering()
    heads = [next(packets_of(number, Kind.QUESTION, b"ab", 10))[:9] for number in range(1000)]  # each: more follows
    with pytest.raises(ValueError, match="not whole"):
        list(map(gathering.take, heads))


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[HostLines]:
    lines = HostLines(tmp_path)
    yield lines
    lines.close()


@pytest.fixture
async def asker(tmp_path: Path) -> AsyncIterator[HostLines]:
    lines = HostLines(tmp_path)
    yield lines
    lines.close()


def way_from(asker: HostLines, lost: Callable[[LineWay], None] = lambda _way: None) -> LineWay:
    way = asker.way(SERVER, lost)
    assert way is not None
    return way


async def ask(way: LineWay, payload: bytes) -> Came:
    return await asyncio.wait_for(way.ask(payload, asyncio.get_running_loop().create_future()), DEADLINE_S)


def echo(question: HostQuestion) -> None:
    question.answer(question.payload.to_bytes())
    question.drop()


async def test_questions_of_any_length_are_answered_in_their_order(server: HostLines, asker: HostLines) -> None:
    came: list[bytes] = []

    def note(question: HostQuestion) -> None:
        came.append(question.payload.to_bytes())
        echo(question)

    server.serve(SERVER, INBOX, note)
    way = way_from(asker)
    sent = [b"", b"a", bytes(8 << 20), *(os.urandom(length) for length in range(0, 300_000, 7919))]
    assert await asyncio.gather(*(ask(way, payload) for payload in sent)) == sent
    assert came == sent


@pytest.mark.parametrize("small", ["connect", "accept"])
async def test_sockets_with_little_room_carry_messages_of_any_length(
    small: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where net.core.wmem_default is small; the other side's socket is as the system makes it."""
    make = getattr(local_sockets, small)

    def made(of: object) -> socket.socket:
        one: socket.socket = make(of)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)  # the system takes its least
        return one

    monkeypatch.setattr(local_sockets, small, made)
    server, asker = HostLines(tmp_path), HostLines(tmp_path)
    came: list[int] = []

    def note(question: HostQuestion) -> None:
        came.append(len(question.payload))
        echo(question)

    server.serve(SERVER, INBOX, note)
    way, sent = way_from(asker), [os.urandom(length) for length in (0, 4_000, 9_000, 70_000, 300_000)]
    try:
        assert await asyncio.gather(*(ask(way, payload) for payload in sent)) == sent
        assert came == [*map(len, sent)]
    finally:
        asker.close()
        server.close()


async def test_a_question_that_is_dropped_or_that_nobody_takes_ends(server: HostLines, asker: HostLines) -> None:
    lost: list[LineWay] = []
    served = server.serve(SERVER, INBOX, HostQuestion.drop)
    way = way_from(asker, lost.append)
    assert await ask(way, b"?") is None
    assert way.is_open
    served.undeclare()
    assert await ask(way, b"?") is NoInbox
    assert lost == [way]
    assert not way.is_open


async def test_the_end_of_a_process_ends_its_open_questions_after_the_answers_that_it_gave(
    server: HostLines, asker: HostLines
) -> None:
    lost: list[LineWay] = []

    def answer(question: HostQuestion) -> None:
        if question.payload != b"slow":
            echo(question)
            server.close()

    server.serve(SERVER, INBOX, answer)
    way = way_from(asker, lost.append)
    slow, last = asyncio.create_task(ask(way, b"slow")), asyncio.create_task(ask(way, b"last"))
    assert await last == b"last"
    assert await slow is None
    assert lost == [way]
    assert asker.way(SERVER, lost.append) is None


@pytest.mark.parametrize("make_loop", [asyncio.new_event_loop, uvloop.new_event_loop], ids=["asyncio", "uvloop"])
@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("count", [1, 2 * MOST_AT_ONCE])
def test_answers_of_a_process_that_ended_come_although_it_left_a_question_unread(
    count: int, when: str, make_loop: Callable[[], asyncio.AbstractEventLoop], tmp_path: Path
) -> None:
    """The question came before the end, or after it. The system reports its loss before it gives the answers."""

    async def law() -> None:
        loop, (listening, name), asker = asyncio.get_running_loop(), local_sockets.listen(), HostLines(tmp_path)
        HostEntries(tmp_path).write(SERVER, Entry(name, INBOX))
        way = way_from(asker)
        peer = local_sockets.accept(listening)

        async def ask_if_open(payload: bytes) -> Came:
            return await way.ask(payload, loop.create_future()) if way.is_open else None

        asked = [loop.create_task(ask_if_open(b"%d" % number)) for number in range(count)]
        if when == "before":
            asked.append(loop.create_task(ask_if_open(b"unread")))
        await asyncio.sleep(0.01)
        for _ in range(count):
            question = Gathering().take(peer.recv(MOST_PACKET_BYTES))
            assert question is not None
            [answer] = packets_of(question[0], Kind.ANSWER, b"here")
            peer.send(answer)
        peer.close()
        if when == "after":
            asked.append(loop.create_task(ask_if_open(b"unread")))
        async with asyncio.timeout(DEADLINE_S):
            assert await asyncio.gather(*asked) == [*[b"here"] * count, None]
        assert not way.is_open
        listening.close()
        asker.close()

    with asyncio.Runner(loop_factory=make_loop) as runner:
        runner.run(law())


async def test_a_peer_that_takes_nothing_costs_little(
    server: HostLines, asker: HostLines, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its line ends, and the others go on."""
    monkeypatch.setattr(host_lines, "MOST_WAITING_BYTES", 1 << 20)
    server.serve(SERVER, INBOX, echo)
    deaf, closed = local_sockets.connect(server.name), select.poll()
    closed.register(deaf, select.POLLHUP)
    body = question_of(INBOX, bytes(60_000))
    way = way_from(asker)
    for number in range(1000):
        with suppress(BlockingIOError, BrokenPipeError, ConnectionResetError):
            for packet in packets_of(number, Kind.QUESTION, body):
                deaf.send(packet)
        assert await ask(way, b"meanwhile") == b"meanwhile"
        if closed.poll(0):
            break
    else:
        pytest.fail("the line to a process that reads nothing stands")
    deaf.close()


@pytest.mark.parametrize(
    "packet",
    [b"x", bytes(9), bytes(8) + b"\x7f", bytes(8) + b"\1" + b"answer", bytes(8) + b"\0" + b"\xff\xffinbox"],
    ids=["short", "empty question", "no kind", "answer to nobody", "no inbox"],
)
async def test_nonsense_ends_its_line_alone_or_nothing(packet: bytes, server: HostLines, asker: HostLines) -> None:
    server.serve(SERVER, INBOX, echo)
    way = way_from(asker)
    stranger = local_sockets.connect(server.name)
    stranger.send(packet)
    for _ in range(10):
        assert await ask(way, b"still there") == b"still there"
    stranger.close()


async def test_another_user_is_not_let_in_and_not_asked(
    server: HostLines, asker: HostLines, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names can be read in ``/proc/net/unix``; whoever connects is asked for its user."""
    server.serve(SERVER, INBOX, echo)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stranger:
        monkeypatch.setattr(os, "geteuid", lambda: 4_000_000_000)
        stranger.connect(f"\0scout-backbone/{server.name}")
        stranger.setblocking(False)
        assert await asyncio.wait_for(asyncio.get_running_loop().sock_recv(stranger, 1), DEADLINE_S) == b""
        assert asker.way(SERVER, lambda _way: None) is None


async def test_without_descriptors_a_process_waits_and_does_not_spin(
    server: HostLines, asker: HostLines, monkeypatch: pytest.MonkeyPatch
) -> None:
    accept, refusals = local_sockets.accept, list[int]()

    def refuse(_listening: socket.socket) -> socket.socket:
        refusals.append(1)
        raise OSError(errno.EMFILE, "no descriptors")

    monkeypatch.setattr(host_lines, "ACCEPT_AGAIN_S", 0.2)
    monkeypatch.setattr(local_sockets, "accept", refuse)
    server.serve(SERVER, INBOX, echo)
    asked = asyncio.create_task(ask(way_from(asker), b"?"))
    await asyncio.sleep(0.05)
    assert len(refusals) == 1
    monkeypatch.setattr(local_sockets, "accept", accept)
    assert await asked == b"?"


PROGRAM = """
import asyncio, sys
from pathlib import Path
from backbone.bus.host_lines import HostLines
async def main():
    lines = HostLines(Path(sys.argv[1]))
    def answer(question):
        if question.payload != b"slow":
            question.answer(b"here")
    lines.serve({server!r}, {inbox!r}, answer)
    print("ready", flush=True)
    await asyncio.Event().wait()
asyncio.run(main())
"""


@pytest.mark.processes
async def test_a_stopped_process_keeps_questions_waiting_and_a_killed_one_ends_them(
    asker: HostLines, tmp_path: Path
) -> None:
    words = [sys.executable, "-c", PROGRAM.format(server=SERVER, inbox=INBOX), str(tmp_path)]
    program = await asyncio.create_subprocess_exec(*words, stdout=asyncio.subprocess.PIPE)
    assert program.stdout is not None
    try:
        assert await asyncio.wait_for(program.stdout.readline(), DEADLINE_S) == b"ready\n"
        way = way_from(asker)
        assert await ask(way, b"?") == b"here"
        program.send_signal(signal.SIGSTOP)
        waiting = asyncio.create_task(ask(way, b"?"))
        await asyncio.sleep(0.1)
        assert not waiting.done()
        program.send_signal(signal.SIGCONT)
        assert await waiting == b"here"
        slow = asyncio.create_task(ask(way, b"slow"))
        assert await ask(way, b"?") == b"here"
        program.kill()
        assert await slow is None
        assert not way.is_open
    finally:
        with suppress(ProcessLookupError):
            program.kill()
        await program.wait()
