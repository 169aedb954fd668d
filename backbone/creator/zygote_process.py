"""The zygote: a process that has imported the modules of components and forks one component per order.

It never opens a bus, because the threads of a bus do not exist in a forked child. It has one thread and no event loop,
because a child inherits their locks and descriptors.

Rules, for any killed process:

* A component dies with its zygote (the kernel's parent-death signal).
* The end of a component is reported after the end of its whole process tree: its process group is killed, and a
  zygote of its own (a creator's) has ended its children before.
* When the zygote's parent has ended, for any reason, the zygote sends SIGTERM, then SIGKILL, to all its components
  and their descendants, removes the mission's folder, and ends.
"""

from __future__ import annotations

import gc
import importlib
import logging
import os
import selectors
import shutil
import signal
import socket
import struct
import sys
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, assert_never

import msgspec

from backbone import unexpected_ends
from backbone.component.launch import Launch
from backbone.component.logs import redirect
from backbone.component.process import EXIT_BUG, run_process
from backbone.component.shared_process import run_shared_process
from backbone.creator import process_table
from backbone.errors import NO_MORE_TASKS
from backbone.operating_system import own_process, processes
from backbone.operating_system.heaps import share_heaps
from backbone.ranges import ExitCode, Pid, Signal, Text
from backbone.run_files import ENDED, FILE_NAME
from backbone.wire import Message

log = logging.getLogger(__name__)

GRACE_S = 0.8  # chosen: two zygotes, one below the other, end everything within 2 s; the guarantee is 3 s
ZYGOTE_GRACE_S = 1.2  # chosen: a zygote below this one needs GRACE_S and a moment to reap
LENGTH = struct.Struct("!I")
_LEFT_TO_THE_PARENT = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""A terminal or service manager sends these signals to the parent too, and the parent's end ends the zygote."""


class Fork(Message, frozen=True):
    """Fork this component. Answered by ``Forked`` or ``ForkFailed``, in the order of the requests."""

    launch: Launch


class Kill(Message, frozen=True):
    """Send the signal to the component's process tree."""

    pid: Pid
    number: Signal


class Forked(Message, frozen=True):
    """The component runs under this pid."""

    pid: Pid


class ForkFailed(Message, frozen=True):
    """The system refused another process."""

    why: Text


class Exited(Message, frozen=True):
    """The component's whole process tree has ended.

    Attributes:
        returncode: Exit code, or the number of the signal that killed it, negative.
    """

    pid: Pid
    returncode: ExitCode


class ZygoteSettings(msgspec.Struct, frozen=True):
    """Settings of a zygote, given at its start.

    Attributes:
        parent: Pid of the process it serves.
        run_directory: Folder that it removes at its end; empty: none.
        preload: Modules imported before the first order.
        import_path: ``sys.path`` of the components.
    """

    parent: int
    run_directory: str = ""
    preload: tuple[str, ...] = ()
    import_path: tuple[str, ...] = ()


Order = Fork | Kill
Answer = Forked | ForkFailed | Exited

_order_decoder = msgspec.msgpack.Decoder(Order)
_encode = msgspec.msgpack.Encoder().encode


def frame(message: Message) -> bytes:
    """Return the encoded message after its length."""
    body = _encode(message)
    return LENGTH.pack(len(body)) + body


def serve(channel: socket.socket, settings: ZygoteSettings) -> NoReturn:
    """Run the zygote of ``settings.parent``, which holds the other end of the channel, then end the process."""
    code = EXIT_BUG
    try:
        _ZygoteProcess(channel, settings).run()
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # no cleanup of objects inherited from the parent


def main() -> NoReturn:
    """Run the zygote in a fresh interpreter: arguments are the channel's descriptor and the settings."""
    share_heaps()
    settings = msgspec.json.decode(sys.argv[2], type=ZygoteSettings)
    serve(socket.socket(fileno=int(sys.argv[1])), settings)


def fresh_interpreter(descriptor: int, settings: ZygoteSettings) -> list[str]:
    """Return the command that runs ``main`` in an interpreter of its own."""
    program = f"from {__name__} import main; main()"
    return [sys.executable, "-P", "-c", program, str(descriptor), msgspec.json.encode(settings).decode()]


@dataclass(frozen=True, slots=True)
class _Sweep:
    """A component that has ended, and whose children may still run.

    Attributes:
        zygotes_until_s: Time until which its zygotes may end by themselves; None: they were killed.
    """

    returncode: int
    zygotes_until_s: float | None


class _ZygoteProcess:
    def __init__(self, channel: socket.socket, settings: ZygoteSettings) -> None:
        self._channel, self._settings, self._own_pid = channel, settings, os.getpid()
        self._received = bytearray()
        self._live: set[int] = set()
        self._sweeps: dict[int, _Sweep] = {}
        self._is_told_to_end = False
        self._signals, self._signals_in = socket.socketpair()
        self._selector = selectors.DefaultSelector()

    def run(self) -> None:
        self._prepare()
        while not self._is_told_to_end:
            ends_s = [sweep.zygotes_until_s for sweep in self._sweeps.values() if sweep.zygotes_until_s is not None]
            until_s = min(ends_s, default=None)
            for key, _ in self._selector.select(None if until_s is None else max(0.0, until_s - time.monotonic())):
                if key.fileobj is self._channel:
                    self._read_orders()
                else:
                    self._signals.recv(1 << 12)
            self._reap()
            self._sweep()
        self._end_all()

    def _prepare(self) -> None:
        if os.getsid(0) != self._own_pid:
            os.setsid()  # Ctrl-C at a terminal is for the launcher, which then ends the zygote
        own_process.adopt_orphans()
        own_process.allow_many_files()
        own_process.set_title(process_table.zygote_title(self._settings.parent))
        self._signals.setblocking(False)
        self._signals_in.setblocking(False)
        signal.set_wakeup_fd(self._signals_in.fileno(), warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, _only_wake)
        for number in _LEFT_TO_THE_PARENT:
            signal.signal(number, signal.SIG_IGN)
        if self._settings.import_path:
            sys.path[:] = self._settings.import_path
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a process that forks must have one thread
        os.environ.setdefault("MUJOCO_GL", "disable")  # the one component that draws loads its OpenGL itself
        for module in self._settings.preload:
            self._preload(module)
        gc.collect()
        gc.freeze()  # the collector would write into pages that the components share
        self._channel.setblocking(False)
        self._selector.register(self._channel, selectors.EVENT_READ)
        self._selector.register(self._signals, selectors.EVENT_READ)

    def _preload(self, module: str) -> None:
        try:
            importlib.import_module(module)
        except Exception as error:  # a component that needs the module reports it
            log.warning("%s is not preloaded: %r", module, error)
        if processes.threads() > 1:
            log.warning("%s starts threads when it is imported, and a process with threads cannot fork", module)
            self._begin_anew_without(module)

    def _begin_anew_without(self, module: str) -> NoReturn:
        """Continue as a fresh interpreter without the module; pending orders stay in the channel."""
        settings = msgspec.structs.replace(
            self._settings,
            preload=tuple(other for other in self._settings.preload if other != module),
            import_path=tuple(sys.path),
        )
        self._channel.set_inheritable(True)
        sys.stdout.flush()
        sys.stderr.flush()
        os.execv(sys.executable, fresh_interpreter(self._channel.fileno(), settings))  # noqa: S606  our own program

    # Orders
    def _read_orders(self) -> None:
        try:
            received = self._channel.recv(1 << 16)
        except BlockingIOError:
            return
        except ConnectionResetError:
            received = b""
        if not received:
            self._is_told_to_end = True
            return
        self._received += received
        while len(self._received) >= LENGTH.size:
            end = LENGTH.size + LENGTH.unpack_from(self._received)[0]
            if len(self._received) < end:
                return
            order = _order_decoder.decode(memoryview(self._received)[LENGTH.size : end].tobytes())
            del self._received[:end]
            self._carry_out(order)

    def _carry_out(self, order: Order) -> None:
        match order:
            case Fork(launch=launch):
                self._tell(self._fork(launch))
            case Kill(pid=pid, number=number):
                if pid in self._live:  # else it was reaped, and another process may have the pid
                    processes.send(process_table.tree(process_table.read_table(), pid), signal.Signals(number))
            case _:
                assert_never(order)

    def _tell(self, answer: Answer) -> None:
        self._channel.setblocking(True)
        try:
            self._channel.sendall(frame(answer))
        except (BrokenPipeError, ConnectionResetError):
            self._is_told_to_end = True
        finally:
            self._channel.setblocking(False)

    def _fork(self, launch: Launch) -> Answer:
        try:
            pid = os.fork()
        except OSError as error:
            return ForkFailed(why_not_forked(error))
        if pid == 0:
            self._become(launch)
        self._live.add(pid)
        return Forked(pid)

    def _become(self, launch: Launch) -> NoReturn:
        code = EXIT_BUG
        try:
            os.setpgid(0, 0)  # the session stays the zygote's; see process_table
            own_process.die_with_parent()
            if os.getppid() != self._own_pid:  # the zygote died before the child was tied to it
                os._exit(EXIT_BUG)
            signal.set_wakeup_fd(-1)
            for number in (signal.SIGCHLD, *_LEFT_TO_THE_PARENT):
                signal.signal(number, signal.SIG_DFL)
            self._selector.close()
            for inherited in (self._channel, self._signals, self._signals_in):
                inherited.close()
            os.environ[process_table.MARK] = str(os.getpid())
            own_process.set_title(launch.name)
            redirect(launch.run_directory, launch.name)
            code = run_shared_process(launch) if launch.is_shared_process else run_process(launch)
        except BaseException:
            traceback.print_exc()
        finally:
            with suppress(OSError):  # a full disk must not keep the process from ending
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)  # an ordinary exit would wait for threads of a bus that was not closed

    # Ends
    def _reap(self) -> bool:
        """Record every child that has ended; return whether children are left."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return False
            if pid == 0:
                return True
            if pid in self._live:
                self._live.remove(pid)
                returncode = os.waitstatus_to_exitcode(status)
                self._sweeps[pid] = _Sweep(returncode, time.monotonic() + ZYGOTE_GRACE_S)

    def _sweep(self) -> None:
        """Kill the children of dead components, and report a component when its process tree has ended.

        Each remaining process is a child of the zygote or becomes one when its parent ends, so each end wakes it.
        """
        if not self._sweeps:
            return
        table, now_s = process_table.read_table(), time.monotonic()
        for pid, sweep in list(self._sweeps.items()):
            left = process_table.remains(table, pid, self._own_pid)
            zygotes = process_table.zygotes_of(table, pid)
            if sweep.zygotes_until_s is not None and now_s >= sweep.zygotes_until_s:
                left |= zygotes
                self._sweeps[pid] = _Sweep(sweep.returncode, None)
            processes.send(left, signal.SIGKILL)
            if not left | zygotes:
                del self._sweeps[pid]
                self._tell(Exited(pid, sweep.returncode))

    def _end_all(self) -> None:
        """End all descendants of this process: SIGTERM, a moment, SIGKILL. Those of other accounts are left."""
        removed = self._hide_run_directory()
        self._selector.unregister(self._channel)  # else the selector reports its end for ever
        now_s = time.monotonic()
        kill_at_s, kill_zygotes_at_s = now_s + GRACE_S, now_s + GRACE_S + ZYGOTE_GRACE_S
        table = process_table.read_table()
        processes.send({one for pid in self._live for one in process_table.tree(table, pid)}, signal.SIGTERM)
        while self._reap():
            now_s = time.monotonic()
            if now_s < kill_at_s:
                wait_s: float | None = kill_at_s - now_s
            else:
                table = process_table.read_table()
                victims = process_table.descendants(table, self._own_pid)
                if now_s >= kill_zygotes_at_s:
                    victims |= {pid for pid, process in table.items() if process.parent == self._own_pid}
                processes.send(victims, signal.SIGKILL)
                wait_s = kill_zygotes_at_s - now_s if now_s < kill_zygotes_at_s else None
                if wait_s is None and not victims:
                    break
            if self._selector.select(wait_s):
                self._signals.recv(1 << 12)
        if removed is not None:
            shutil.rmtree(removed, ignore_errors=True)

    def _hide_run_directory(self) -> Path | None:
        """Rename the folder, so that the mission can come up again while its old processes are being ended."""
        if not self._settings.run_directory:
            return None
        directory = Path(self._settings.run_directory)
        if (directory / FILE_NAME).exists():  # a launcher that ends its mission removes it before
            unexpected_ends.keep(directory, f"its launcher, process {self._settings.parent}, was killed")
        hidden = directory.with_name(f".{directory.name}{ENDED}{self._own_pid}")
        try:
            directory.rename(hidden)
        except FileNotFoundError:
            return None
        return hidden


def why_not_forked(error: OSError) -> str:
    """Return why the system refused a fork.

    Example:
        >>> why_not_forked(BlockingIOError(11, "Resource temporarily unavailable"))
        'Resource temporarily unavailable; no more processes and threads may begin: see ulimit -u and pids.max'
        >>> why_not_forked(OSError(12, "Cannot allocate memory"))
        '[Errno 12] Cannot allocate memory'
    """
    return f"{error.strerror}; {NO_MORE_TASKS}" if isinstance(error, BlockingIOError) else str(error)


def _only_wake(_number: int, _frame: object) -> None:
    """Do nothing: without a handler the wakeup descriptor is not written."""
