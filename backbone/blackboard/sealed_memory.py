"""The blackboard's interface to the operating system: sealed memory files, and sockets that carry their descriptors.

A *sealed memory file* is a file without a name that exists in memory only. Its content is written before it is sealed,
and it is sealed before it is sent, so a reader never sees a part of a value, and no lock is needed. The file ends with
its last descriptor and mapping, however its processes end.

The rest of the project does not call these functions of the system. If ``IS_POSSIBLE`` is False (a system other than
Linux), there is no blackboard, and the bus sends everything by zenoh.
"""

from __future__ import annotations

import array
import contextlib
import errno
import os
import socket
import stat
import weakref
from collections.abc import Iterator, Sequence
from pathlib import Path

from backbone.errors import Refusal
from backbone.operating_system import local_sockets

try:
    import fcntl
    import mmap
    import select
except ImportError:  # another system
    fcntl = mmap = select = None  # type: ignore[assignment]

IS_POSSIBLE = hasattr(os, "memfd_create") and hasattr(fcntl, "F_ADD_SEALS") and Path("/proc/self/fd").is_dir()
_FIXED = (fcntl.F_SEAL_SEAL | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW) if IS_POSSIBLE else 0
_NO_WRITE = fcntl.F_SEAL_WRITE if IS_POSSIBLE else 0
_NO_MORE_WRITE = 0x10  # F_SEAL_FUTURE_WRITE of linux/fcntl.h, since Linux 5.1; Python 3.11 does not name it
MOST_MAPPED = 256  # chosen: Python keeps a descriptor for each mapping, and a process may have 1024 by default
MOST_DESCRIPTORS = 2  # of one packet
_CUT = int(socket.MSG_TRUNC | socket.MSG_CTRUNC)  # a number, because joining two flags takes 3 µs (measured)
_mapped: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


class NotSealed(Refusal):
    """A descriptor is no sealed memory file of the stated length."""

    code = "blackboard.not_sealed"
    remedy = "Write with BlackboardWriter of the same release."


class ForeignFolder(Refusal):
    """Other users can enter the folder of a blackboard."""

    code = "blackboard.folder"
    remedy = "Name a folder of your own with mode 0700."


def sealed(value: bytes | memoryview) -> int:
    """Return the descriptor of a new sealed memory file with this content."""
    descriptor = os.memfd_create("scout-value", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        whole = memoryview(value)
        rest = (whole if whole.c_contiguous else memoryview(whole.tobytes())).cast("B")
        at = 0
        while at < len(rest):
            at += os.pwrite(descriptor, rest[at:], at)
        _seal(descriptor)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _seal(descriptor: int) -> None:
    """Seal a file that no process can write any more when its descriptor is closed here: none has mapped it.

    ``F_SEAL_WRITE`` would wait for pages that the system itself uses for a moment, 8 ms in one of a hundred pictures on
    a busy machine (measured), and fail with EBUSY if they stay in use for some 0.1 s.
    """
    try:
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, _FIXED | _NO_MORE_WRITE)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, _FIXED | _NO_WRITE)  # Linux before 5.1


def _is_sealed(descriptor: int) -> bool:
    try:
        seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
    except OSError:  # no memory file
        return False
    return seals & _FIXED == _FIXED and bool(seals & (_NO_WRITE | _NO_MORE_WRITE))


def mapped(descriptor: int, length: int) -> memoryview:
    """Return the content of a sealed memory file, read-only and without a copy; the descriptor is closed.

    The memory stays until the last view of it is gone. A process that keeps ``MOST_MAPPED`` of them gets copies.

    Raises:
        NotSealed: The file is not sealed, so it might change or shrink while it is read, or it has another length.
    """
    try:
        if not _is_sealed(descriptor) or os.fstat(descriptor).st_size != length or not length:
            raise NotSealed(f"descriptor of no sealed memory file of {length} bytes")
        if len(_mapped) >= MOST_MAPPED:
            return memoryview(_read(descriptor, length))
        content = mmap.mmap(descriptor, length, access=mmap.ACCESS_READ)
        _mapped.add(content)
        return memoryview(content)
    finally:
        os.close(descriptor)


def _read(descriptor: int, length: int) -> bytes:
    with os.fdopen(os.dup(descriptor), "rb") as file:
        file.seek(0)
        return file.read(length)


def packet_pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected sockets whose packets arrive whole or not at all; neither ever blocks."""
    pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for one in pair:
        one.setblocking(False)
    return pair


def send(to: socket.socket, parts: Sequence[bytes | memoryview], descriptors: Sequence[int] = ()) -> None:
    """Send one packet; the descriptors stay open here.

    Raises:
        OSError: The packet is not sent; ``BlockingIOError``: the socket is full.
    """
    rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))] if descriptors else []
    to.sendmsg(parts, rights, socket.MSG_NOSIGNAL)


def receive(source: socket.socket, most_bytes: int) -> tuple[bytes, list[int]]:
    """Return one packet and its descriptors, which no other program inherits; b"": the sender is gone.

    Raises:
        OSError: There is no packet now (``BlockingIOError``), or the socket is broken.
    """
    space = socket.CMSG_SPACE(MOST_DESCRIPTORS * array.array("i").itemsize)
    raw, ancillary, flags, _ = source.recvmsg(most_bytes, space, socket.MSG_CMSG_CLOEXEC)
    descriptors = array.array("i")
    for level, kind, content in ancillary:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            descriptors.frombytes(content[: len(content) - len(content) % descriptors.itemsize])
    if flags & _CUT:
        close_all(descriptors)
        raise ConnectionError("a packet that is too long")
    return raw, list(descriptors)


def peek(undelivered_at: socket.socket, length: int) -> bytes:
    """Return the first bytes of the oldest packet that waits in a socket, and leave it there; b"": none waits."""
    with contextlib.suppress(OSError):
        return undelivered_at.recv(length, socket.MSG_PEEK)
    return b""


def take_back(undelivered_at: socket.socket, length: int) -> bytes:
    """Drop the oldest packet that waits in a socket, and return its first bytes; the system closes its descriptors."""
    with contextlib.suppress(OSError):
        return undelivered_at.recv(length)
    return b""


def close_all(descriptors: Sequence[int]) -> None:
    """Close descriptors that came with a packet."""
    for descriptor in descriptors:
        os.close(descriptor)


class Waits:
    """A set of sockets that a process waits for together, until one of them is readable."""

    def __init__(self) -> None:
        self._events = select.epoll()

    def fileno(self) -> int:
        """Return a descriptor that is readable while one of the sockets is."""
        return self._events.fileno()

    def add(self, one: socket.socket) -> None:
        """Add a socket."""
        self._events.register(one, select.EPOLLIN)

    def remove(self, descriptor: int) -> None:
        """Remove a socket, unless it is closed already."""
        with contextlib.suppress(OSError):
            self._events.unregister(descriptor)

    def readable(self) -> list[int]:
        """Return the descriptors of the readable sockets. Never waits."""
        return [descriptor for descriptor, _event in self._events.poll(0)]

    def close(self) -> None:
        """Close the set, not its sockets. Idempotent."""
        self._events.close()


def wait_readable(one: socket.socket | Waits, within_s: float) -> bool:
    """Wait, in a thread, until a socket is readable; return whether one is."""
    waiting = select.poll()
    waiting.register(one, select.POLLIN)
    return bool(waiting.poll(within_s * 1000))


@contextlib.contextmanager
def _place(directory: Path, name: str) -> Iterator[str]:
    """Yield a path of this name that fits a socket, however long the folder's own path is.

    Raises:
        ForeignFolder: Another user could enter the folder.
        OSError: There is no folder.
    """
    folder = os.open(directory, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        status = os.fstat(folder)
        if status.st_uid != os.geteuid() or stat.S_IMODE(status.st_mode) & 0o077:
            raise ForeignFolder(f"{directory} belongs to user {status.st_uid}, mode {status.st_mode & 0o777:o}")
        yield f"/proc/self/fd/{folder}/{name}"
    finally:
        os.close(folder)


def lock(directory: Path, name: str) -> int | None:
    """Return a descriptor that holds the lock of this name while it is open; None: another process holds it.

    If a process has ended, for any reason, its lock is free. The folder is made if there is none.

    Raises:
        ForeignFolder: Another user could enter the folder.
        OSError: The system refuses the file.
    """
    directory.mkdir(mode=0o700, exist_ok=True)
    with _place(directory, name) as path:
        while True:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.path.exists(path) and os.path.samestat(os.fstat(descriptor), os.stat(path)):
                    return descriptor
            except BlockingIOError:
                os.close(descriptor)
                return None
            except OSError:
                os.close(descriptor)
                raise
            os.close(descriptor)  # its holder removed it meanwhile


def remove(directory: Path, name: str) -> None:
    """Remove a file of the folder, if it is there."""
    with contextlib.suppress(OSError):
        (directory / name).unlink()


def listen(directory: Path, name: str) -> socket.socket:
    """Return a socket for ``local_sockets.accept`` at a name of the folder; a socket of a dead process is replaced.

    Raises:
        ForeignFolder: Another user could enter the folder.
        OSError: The system refuses the socket.
    """
    made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        made.setblocking(False)
        remove(directory, name)
        with _place(directory, name) as path:
            made.bind(path)
        made.listen()
    except BaseException:
        made.close()
        raise
    return made


def connect(directory: Path, name: str) -> socket.socket:
    """Return a connection to the process that listens at a name of the folder. Never waits.

    Raises:
        ForeignFolder: Another user could enter the folder, or listens there.
        OSError: No process listens there.
    """
    made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        made.setblocking(False)
        with _place(directory, name) as path:
            made.connect(path)
        if not local_sockets.is_own(made):
            raise ForeignFolder(f"{directory / name} is the socket of another user")
    except BaseException:
        made.close()
        raise
    return made
