"""Questions between two processes of one host over a socket between them: no other process and no thread is woken.

Each process listens at a socket. An entry in the host's folder names the socket for each address that the process
serves, see ``host_entries``. A process that asks such an address connects to the socket, and keeps this *line* for all
its questions to the other process; the answers come back on the line. The hub has no part in this. If a process ends,
its peers first read the answers that it had sent, and then the end of the line. Processes of other users are rejected.
"""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import struct
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from backbone.bus.answers import AnsweredByMessage, Came, NoInbox
from backbone.bus.declared import Withdrawal
from backbone.bus.host_entries import Entry, HostEntries
from backbone.bus.inbox import Whole
from backbone.operating_system import local_sockets
from backbone.waiting import settle
from backbone.wire import MAX_MESSAGE_BYTES

# chosen: three of them fit the default buffer of a socket (net.core.wmem_default); a smaller one gets shorter packets
MOST_PACKET_BYTES = 65_536
MOST_WAITING_BYTES = 2 * MAX_MESSAGE_BYTES  # chosen: a stopped peer costs at most this memory
MOST_AT_ONCE = 32  # chosen: packets of one line before the rest of the event loop has its turn
ACCEPT_AGAIN_S = 1.0  # chosen: as long as asyncio's own servers wait (asyncio.constants.ACCEPT_RETRY_DELAY)
_PACKET = struct.Struct("<QB")
_INBOX = struct.Struct("<H")
_MORE = 0x80  # the message continues in the next packet with its number

log = logging.getLogger(__name__)


class Kind(IntEnum):
    """Kind of a message on a line."""

    QUESTION = 0
    ANSWER = 1
    NO_ANSWER = 2  # a bug ended the answer
    NO_INBOX = 3  # no component got the question


def packets_of(number: int, kind: Kind, body: bytes, most_bytes: int = MOST_PACKET_BYTES) -> Iterator[bytes]:
    """Yield the packets of a message, none of them longer than ``most_bytes``."""
    most = most_bytes - _PACKET.size
    for at in range(0, max(1, len(body)), most):
        part = body[at : at + most]
        yield _PACKET.pack(number, kind | (_MORE if at + most < len(body) else 0)) + part


def question_of(inbox: str, payload: bytes) -> bytes:
    """Return the body of a question."""
    name = inbox.encode()
    return _INBOX.pack(len(name)) + name + payload


class Gathering:
    """Joins the packets from one side of a line into messages. Pure."""

    def __init__(self) -> None:
        self._parts: dict[int, list[bytes]] = {}
        self._bytes = 0

    def take(self, packet: bytes) -> tuple[int, Kind, bytes] | None:
        """Return number, kind and body of the message that this packet completes; None: it completes none.

        Raises:
            ValueError: It is no packet, or the incomplete messages have more than ``MOST_WAITING_BYTES``.
        """
        if len(packet) < _PACKET.size:
            raise ValueError(f"a packet of {len(packet)} bytes")
        number, kind = _PACKET.unpack_from(packet)
        part = packet[_PACKET.size :]
        if not kind & _MORE and number not in self._parts:
            return number, Kind(kind), part
        parts = self._parts.setdefault(number, [])
        parts.append(part)
        self._bytes += len(packet)  # with its head: parts may be empty, and are kept all the same
        if self._bytes > MOST_WAITING_BYTES:
            raise ValueError(f"{self._bytes} bytes of messages that are not whole")
        if kind & _MORE:
            return None
        body = b"".join(self._parts.pop(number))
        self._bytes -= len(body) + len(parts) * _PACKET.size
        return number, Kind(kind), body


class HostLine:
    """A connection to another process of this host.

    Args:
        took: Called with each message from the peer: line, number, kind, body.
        ended: Called once, when no further message can come.
    """

    def __init__(
        self,
        connected: socket.socket,
        took: Callable[[HostLine, int, Kind, bytes], None],
        ended: Callable[[HostLine], None],
    ) -> None:
        self._socket, self._took, self._ended = connected, took, ended
        self._loop = asyncio.get_running_loop()
        self._most_packet_bytes = min(MOST_PACKET_BYTES, local_sockets.most_packet_bytes(connected))
        self._came = Gathering()
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._is_full = False
        self._most_at_once: float = MOST_AT_ONCE  # without limit once the peer has ended: uvloop reports an error once
        self.is_open = True
        self._loop.add_reader(connected, self._read)

    def send(self, number: int, kind: Kind, body: bytes) -> None:
        """Send a message, as soon as the socket has room. If more than ``MOST_WAITING_BYTES`` wait, the line ends."""
        if not self.is_open:
            return
        for packet in packets_of(number, kind, body, self._most_packet_bytes):
            self._waiting.append(packet)
            self._waiting_bytes += len(packet)
        if not self._is_full:
            self._send_waiting()
        if self._waiting_bytes > MOST_WAITING_BYTES:
            log.warning("a process of this host reads no messages: %d bytes wait", self._waiting_bytes)
            self.close()

    def close(self) -> None:
        """End the line. Idempotent."""
        if self.is_open:
            self.is_open = False
            self._loop.remove_reader(self._socket)
            self._loop.remove_writer(self._socket)
            self._socket.close()
            self._waiting.clear()
            self._waiting_bytes = 0
            self._ended(self)

    def _read(self) -> None:
        count = 0
        while count < self._most_at_once:
            count += 1
            try:
                packet = self._socket.recv(MOST_PACKET_BYTES)
                message = self._came.take(packet) if packet else None
            except BlockingIOError:
                return
            except ConnectionResetError:  # the peer ended and left a message unread: what it had sent comes now
                self._most_at_once = math.inf
                continue
            except (OSError, ValueError) as error:
                log.info("a line to a process of this host ends: %s", error)
                packet, message = b"", None
            if not packet:
                self.close()
                return
            if message is not None:
                self._took(self, *message)
            if not self.is_open:
                return

    def _send_waiting(self) -> None:
        try:
            while self._waiting:
                self._socket.send(self._waiting[0])
                self._waiting_bytes -= len(self._waiting.popleft())
        except BlockingIOError:
            if not self._is_full:
                self._is_full = True
                self._loop.add_writer(self._socket, self._send_waiting)
        except (BrokenPipeError, ConnectionResetError):  # the peer has ended: ``_read`` closes after its last answers
            self._most_at_once = math.inf
            self._waiting.clear()
            self._waiting_bytes = 0
            self._loop.remove_writer(self._socket)
        except OSError as error:
            log.info("a line to a process of this host ends: %s", error)
            self.close()
        else:
            if self._is_full:
                self._is_full = False
                self._loop.remove_writer(self._socket)


class HostQuestion(AnsweredByMessage):
    """A question that came on a line, with what its answer needs."""

    def __init__(self, line: HostLine, number: int, payload: bytes) -> None:
        self._line, self._number, self.payload = line, number, Whole(payload)

    def send(self, payload: bytes, *, is_answer: bool) -> None:
        """Send a message on the line."""
        self._line.send(self._number, Kind.ANSWER if is_answer else Kind.NO_ANSWER, payload)


@dataclass(slots=True)
class _Asked:
    """Open questions on one line.

    Attributes:
        waiting: Number → open question.
        left: Functions to call when the line has ended.
    """

    waiting: dict[int, asyncio.Future[Came]] = field(default_factory=dict)
    left: list[Callable[[], None]] = field(default_factory=list)


class HostLines:
    """The lines of one process. Make it inside a running event loop, and use it there.

    Args:
        directory: Folder of the mission's files on this host.

    Raises:
        OSError: The system refuses the socket.
    """

    def __init__(self, directory: Path) -> None:
        self._loop, self._entries = asyncio.get_running_loop(), HostEntries(directory)
        self._listening, self.name = local_sockets.listen()
        """Name of the socket at which this process listens, for the entries in the host's folder."""
        self._inboxes: dict[str, Callable[[HostQuestion], None]] = {}
        self._answering: set[HostLine] = set()
        self._asking: dict[str, HostLine] = {}
        self._asked: dict[HostLine, _Asked] = {}
        self._number = 0
        self._loop.add_reader(self._listening, self._accept)

    def serve(self, address: str, inbox: str, asked: Callable[[HostQuestion], None]) -> Withdrawal:
        """Call a function with each question to this inbox of the address until withdrawn."""
        self._inboxes[inbox], entry = asked, Entry(self.name, inbox)
        self._entries.write(address, entry)

        def withdraw() -> None:
            self._entries.remove(address, entry)
            self._inboxes.pop(inbox, None)

        return Withdrawal(withdraw)

    def way(self, address: str, lost: Callable[[LineWay], None]) -> LineWay | None:
        """Return the way to the component of this host that serves the address; None: there is none."""
        entry = self._entries.read(address)
        if entry is None:
            return None
        line = self._asking.get(entry.socket)
        if line is None:
            try:
                line = HostLine(local_sockets.connect(entry.socket), self._answered, self._ended)
            except (OSError, ValueError) as error:
                log.debug("no line to %s: %s", address, error)
                return None
            self._asking[entry.socket], self._asked[line] = line, _Asked()
        way = LineWay(self, line, entry.inbox, lost)
        self._asked[line].left.append(way.leave)
        return way

    async def ask(self, line: HostLine, inbox: str, payload: bytes, answered: asyncio.Future[Came]) -> Came:
        """Return the outcome of a question."""
        self._number += 1
        number, waiting = self._number, self._asked[line].waiting
        waiting[number] = answered
        try:
            line.send(number, Kind.QUESTION, question_of(inbox, payload))
            return await answered
        finally:
            waiting.pop(number, None)

    def forget(self, line: HostLine, left: Callable[[], None]) -> None:
        """Remove a function from those that are called when the line has ended."""
        if (asked := self._asked.get(line)) is not None and left in asked.left:
            asked.left.remove(left)

    def close(self) -> None:
        """End all lines. Idempotent."""
        if self._listening.fileno() >= 0:
            self._loop.remove_reader(self._listening)
            self._listening.close()
        for line in (*self._answering, *self._asking.values()):
            line.close()

    def _accept(self) -> None:
        try:
            self._answering.add(HostLine(local_sockets.accept(self._listening), self._came, self._answering.discard))
        except BlockingIOError:
            return
        except PermissionError as error:
            log.warning("a process of this host was rejected: %s", error)
        except OSError as error:  # no descriptors are left: processes that connect wait, or ask through the hub
            log.warning("no further line on this host for now: %s", error)
            self._loop.remove_reader(self._listening)
            self._loop.call_later(ACCEPT_AGAIN_S, self._accept_again)

    def _accept_again(self) -> None:
        if self._listening.fileno() >= 0:
            self._loop.add_reader(self._listening, self._accept)

    def _came(self, line: HostLine, number: int, kind: Kind, body: bytes) -> None:
        if kind is not Kind.QUESTION or len(body) < _INBOX.size:
            line.close()
            return
        end = _INBOX.size + _INBOX.unpack_from(body)[0]
        asked = self._inboxes.get(body[_INBOX.size : end].decode(errors="replace"))
        if asked is None:
            line.send(number, Kind.NO_INBOX, b"")
        else:
            asked(HostQuestion(line, number, body[end:]))

    def _answered(self, line: HostLine, number: int, kind: Kind, body: bytes) -> None:
        if (answered := self._asked[line].waiting.get(number)) is not None:
            settle(answered, {Kind.ANSWER: body, Kind.NO_INBOX: NoInbox}.get(kind))

    def _ended(self, line: HostLine) -> None:
        for name in [name for name, one in self._asking.items() if one is line]:
            del self._asking[name]
        asked = self._asked.pop(line)
        for left in asked.left:
            left()
        for answered in asked.waiting.values():
            settle(answered, None)


class LineWay:
    """The way to the inbox of one life of a component on this host.

    Args:
        lost: Called when the line has ended, or the component has left the inbox.
    """

    def __init__(self, lines: HostLines, line: HostLine, inbox: str, lost: Callable[[LineWay], None]) -> None:
        self._lines, self._line, self.inbox, self._lost = lines, line, inbox, lost
        self.is_open = True

    async def ask(self, payload: bytes, answered: asyncio.Future[Came]) -> Came:
        """Return the outcome of a question."""
        came = await self._lines.ask(self._line, self.inbox, payload, answered)
        if came is NoInbox:
            self.leave()
        return came

    def leave(self) -> None:
        """Close the way and report its loss. Idempotent."""
        if self.is_open:
            self.close()
            self._lost(self)

    def close(self) -> None:
        """Accept no further question; open questions still wait for their answers."""
        self.is_open = False
        self._lines.forget(self._line, self.leave)


def lines_for(directory: str) -> HostLines | None:
    """Return the lines of this process; None if its launch names no folder, or the system has no such sockets."""
    if not (directory and local_sockets.IS_POSSIBLE):
        return None
    try:
        return HostLines(Path(directory))
    except OSError as error:
        log.warning("no lines on this host: %s", error)
        return None
