"""Zygote handle: a process orders components from its zygote, learns their ends, and sends them signals.

Creators use ``fork_now``, in ``Component.before_bus``. It copies the present process, which must not have opened a bus
yet, in about a millisecond. The launcher uses ``spawn_fresh``, which starts an interpreter. After a zygote was killed,
the next order spawns a fresh one; all components of the killed zygote died with it and are reported as killed.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

import msgspec

from backbone.component.launch import Launch
from backbone.component.logs import log_path, open_log
from backbone.creator import process_table
from backbone.creator.zygote_process import (
    LENGTH,
    ZYGOTE_GRACE_S,
    Answer,
    Exited,
    Fork,
    Forked,
    ForkFailed,
    Kill,
    ZygoteSettings,
    frame,
    fresh_interpreter,
    serve,
)
from backbone.errors import BackboneError
from backbone.operating_system import processes
from backbone.waiting import settle

log = logging.getLogger(__name__)

FORK_TRIES = 2  # chosen: a zygote that is killed while it forks is replaced once; a second kill is no accident
_answer_decoder = msgspec.msgpack.Decoder(Answer)


class NoProcess(BackboneError):
    """The component got no process: the system refused one, or the zygote was killed repeatedly."""


class Forks(Protocol):
    """Interface of a zygote for its keeper; see ``Zygote``."""

    on_exit: Callable[[int, int], None]
    on_lost: Callable[[], None]

    async def fork(self, launch: Launch) -> int:
        """Start the component and return its pid, or raise ``NoProcess``."""

    def kill(self, pid: int, number: signal.Signals) -> None:
        """Send the signal to the component's process tree."""

    def keep_running(self) -> str:
        """Continue the zygote if it was stopped; return the fault, empty: none."""

    def busy_s(self) -> float:
        """Return for how many seconds the zygote has run or waited for a processor since its start."""

    async def close(self) -> None:
        """End the zygote and everything it forked."""


class Zygote:
    """A zygote that serves this process. Use it inside one event loop.

    Attributes:
        on_exit: Called with pid and returncode (a signal's number is negative) when a component's whole process tree
            has ended; never before ``fork`` returned its pid.
        on_lost: Called when the zygote died unexpectedly, before the ends of its components are reported.
    """

    def __init__(self, body: _ZygoteChannel, settings: ZygoteSettings) -> None:
        self.on_exit: Callable[[int, int], None] = lambda _pid, _returncode: None
        self.on_lost: Callable[[], None] = lambda: None
        self._settings = settings
        self._body = body
        self._live: set[int] = set()
        self._is_closing = False
        self._renewing = asyncio.Lock()
        self._reading: asyncio.Task[None] | None = None

    @classmethod
    def fork_now(cls, *, preload: Iterable[str] = ()) -> Zygote:
        """Return a zygote forked from this process.

        Not: after any bus was open in this process, or while other threads run in it.

        Args:
            preload: Modules the zygote imports before the first order.
        """
        settings = ZygoteSettings(os.getpid(), "", tuple(preload))
        ours, its = socket.socketpair()
        pid = os.fork()
        if pid == 0:
            ours.close()
            serve(its, settings)
        its.close()
        return cls(_ZygoteChannel(pid, ours, lambda: os.waitpid(pid, 0)), settings)

    @classmethod
    async def spawn_fresh(cls, *, run_directory: str = "", preload: Iterable[str] = ()) -> Zygote:
        """Return a zygote in an interpreter of its own, which may still be importing.

        Args:
            run_directory: Folder that the zygote removes at its end, also when this process is killed; empty: none.
            preload: Modules the zygote imports before the first order.
        """
        if run_directory:
            log_path(run_directory, "any").parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        settings = ZygoteSettings(os.getpid(), run_directory, tuple(preload), tuple(sys.path))
        return cls(_spawn(settings), settings)

    @property
    def pid(self) -> int:
        """Pid of the zygote."""
        return self._body.pid

    async def fork(self, launch: Launch) -> int:
        """Start the component and return its pid.

        Raises:
            NoProcess: The system refused a process, the launch cannot be sent, or the zygote was killed repeatedly.
        """
        try:
            order = frame(Fork(launch))
        except (UnicodeEncodeError, OverflowError) as error:  # a text that is not UTF-8, a number that is too large
            raise NoProcess(f"the launch of {launch.name} cannot be sent to the zygote: {error}") from error
        for _ in range(FORK_TRIES):
            body = await self._living_body()
            answered: asyncio.Future[int] = asyncio.get_running_loop().create_future()
            body.pending.append(answered)
            body.send(order)
            try:
                return await answered
            except _Lost:
                continue
        raise NoProcess(f"the zygote was killed {FORK_TRIES} times while it forked {launch.name}")

    def kill(self, pid: int, number: signal.Signals) -> None:
        """Send the signal to the component's process tree, unless the component has ended."""
        self._body.send(frame(Kill(pid, number)))

    def keep_running(self) -> str:
        """Continue the zygote if it was stopped; return the fault, empty: none.

        A stopped zygote forks no component and reports no end, but its components continue.
        """
        if not process_table.is_stopped(self._body.pid):
            return ""
        log.warning("zygote %d was stopped and is continued", self._body.pid)
        processes.send([self._body.pid], signal.SIGCONT)
        return "the zygote was stopped"

    def busy_s(self) -> float:
        """Return for how many seconds the zygote has run or waited for a processor since its start."""
        return sum(processes.processor_times_s(self._body.pid) or (0.0, 0.0))

    async def close(self) -> None:
        """End the zygote and all its components; return when they have ended. Idempotent."""
        self._is_closing = True
        async with self._renewing:
            self._body.hang_up()
            if self._reading is not None:
                await self._reading
            await self._body.wait_gone()

    async def _living_body(self) -> _ZygoteChannel:
        async with self._renewing:
            if self._is_closing:
                raise NoProcess("the zygote is being closed")
            if self._reading is not None and self._reading.done():
                await self._reading
                log.warning("a fresh zygote replaces the one that was lost")
                self._body, self._reading = _spawn(_fresh(self._settings)), None
            if self._reading is None:
                self._reading = asyncio.create_task(self._read(self._body), name="zygote answers")
            return self._body

    async def _read(self, body: _ZygoteChannel) -> None:
        """Handle the zygote's messages until it ends."""
        reader = await body.connect()
        while (answer := await _receive(reader)) is not None:
            match answer:
                case Forked(pid=pid):
                    self._live.add(pid)
                    settle(body.pending.popleft(), pid)
                case ForkFailed(why=why):
                    settle(body.pending.popleft(), NoProcess(why))
                case Exited(pid=pid, returncode=returncode):
                    self._live.discard(pid)
                    self._tell_exit(pid, returncode)
        if not self._is_closing:
            log.error("zygote %d is lost", body.pid)
            self.on_lost()
        await self._end_rest()
        await body.wait_gone()
        while body.pending:
            settle(body.pending.popleft(), _Lost())

    async def _end_rest(self) -> None:
        """Kill the remains of a dead zygote and report the ends of its components.

        The components die with their zygote; this method kills their children.
        """
        lost, self._live = sorted(self._live), set()
        processes.send(lost, signal.SIGKILL)
        await processes.wait_gone(lost)
        for pid in lost:
            table = process_table.read_table()
            zygotes = process_table.zygotes_of(table, pid)
            try:
                async with asyncio.timeout(ZYGOTE_GRACE_S):
                    await processes.wait_gone(zygotes)
            except TimeoutError:
                processes.send(zygotes, signal.SIGKILL)
            while left := process_table.remains(process_table.read_table(), pid):
                processes.send(left, signal.SIGKILL)
                await processes.wait_gone(left)
            self._tell_exit(pid, -signal.SIGKILL)

    def _tell_exit(self, pid: int, returncode: int) -> None:
        # Later, because a task that awaits ``fork`` gets the pid only in the next iteration of the loop.
        asyncio.get_running_loop().call_soon(lambda: self.on_exit(pid, returncode))


class _Lost(Exception):
    """The zygote died before it answered."""


class _ZygoteChannel:
    """One zygote process and the channel to it."""

    def __init__(self, pid: int, channel: socket.socket, reap: Callable[[], object]) -> None:
        self.pid, self._reap = pid, reap
        self.pending: deque[asyncio.Future[int]] = deque()
        self._channel = channel
        self._unsent = bytearray()
        self._writer: asyncio.StreamWriter | None = None
        self._is_reaped = False

    async def connect(self) -> asyncio.StreamReader:
        """Send the buffered orders and return the reader of the answers."""
        reader, self._writer = await asyncio.open_unix_connection(sock=self._channel)
        self._writer.write(bytes(self._unsent))
        self._unsent.clear()
        return reader

    def send(self, order: bytes) -> None:
        if self._writer is None:
            self._unsent += order
        elif not self._writer.is_closing():
            self._writer.write(order)

    def hang_up(self) -> None:
        """Order the zygote to end; its last answers can still be read."""
        if self._writer is None:
            self._channel.close()
        elif self._writer.can_write_eof() and not self._writer.is_closing():
            self._writer.write_eof()

    async def wait_gone(self) -> None:
        """Return when the zygote has ended and is reaped."""
        if not self._is_reaped:
            await processes.wait_gone([self.pid])
            self._is_reaped = True
            self._reap()
        if self._writer is not None:
            self._writer.close()


async def _receive(reader: asyncio.StreamReader) -> Answer | None:
    """Return the next answer; None after the last."""
    try:
        length: int = LENGTH.unpack(await reader.readexactly(LENGTH.size))[0]
        answer: Answer = _answer_decoder.decode(await reader.readexactly(length))
    except (asyncio.IncompleteReadError, ConnectionError):
        return None
    return answer


def _spawn(settings: ZygoteSettings) -> _ZygoteChannel:
    ours, its = socket.socketpair()
    with its:
        output = None
        if settings.run_directory:
            output = open_log(settings.run_directory, "zygote")
        process = subprocess.Popen(  # noqa: S603  our own interpreter, our own program
            fresh_interpreter(its.fileno(), settings),
            pass_fds=[its.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env={name: value for name, value in os.environ.items() if name != process_table.MARK},
            start_new_session=True,
        )
        if output is not None:
            os.close(output)
    return _ZygoteChannel(process.pid, ours, process.wait)


def _fresh(settings: ZygoteSettings) -> ZygoteSettings:
    """Return the settings for a fresh interpreter that replaces a zygote of either kind."""
    return msgspec.structs.replace(settings, import_path=tuple(sys.path))
