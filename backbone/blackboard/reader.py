"""A reader of a board: it receives the newest whole value without a copy.

It keeps only the memory of values to which it still refers.
"""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

from backbone.blackboard import sealed_memory
from backbone.blackboard.values import (
    HEADER,
    MOST_PACKET_BYTES,
    MOST_VALUE_BYTES,
    NoBlackboard,
    NoWriter,
    Value,
    files_of,
    read_header,
)
from backbone.waiting import settle


class BlackboardReader:
    """One reader of a named board, in a task or in a thread.

    Args:
        directory: Folder of the boards.
        most_bytes: Longest value.

    Raises:
        NoWriter: No writer of this name lives on this host.
        NoBlackboard: The system has no sealed memory files.
        ForeignFolder: Other users can enter the folder.
        OSError: The system has no more descriptors.
    """

    def __init__(self, directory: Path, name: str, *, most_bytes: int = MOST_VALUE_BYTES) -> None:
        if not sealed_memory.IS_POSSIBLE:
            raise NoBlackboard("sealed memory files need Linux")
        self._name, self._most = name, most_bytes
        try:
            self._connection = sealed_memory.connect(directory, files_of(name)[0])
        except OSError as error:
            raise NoWriter(f"no writer of {name} lives on this host: {error.strerror}", name=name) from error
        try:
            self._own, way = sealed_memory.packet_pair()
        except OSError:
            self._connection.close()
            raise
        try:
            sealed_memory.send(self._connection, [b"\0"], [way.fileno(), self._own.fileno()])
        except OSError as error:
            self.close()
            raise NoWriter(f"the writer of {name} has gone: {error.strerror}", name=name) from error
        finally:
            way.close()

    def fileno(self) -> int:
        """Return a descriptor that is readable when ``newest`` returns a value or raises an error."""
        return self._own.fileno()

    def newest(self) -> Value | None:
        """Return the newest value; None: there is no new one since the last call. Never waits.

        Raises:
            NoWriter: The writer has ended, and its last value was returned.
            NotAValue: The packet is not from a writer.
            NotSealed: The value could change under its reader.
            ValueTooLong: The value is longer than ``most_bytes``.
        """
        try:
            packet, descriptors = sealed_memory.receive(self._own, MOST_PACKET_BYTES)
        except BlockingIOError:
            return None
        except OSError:
            packet, descriptors = b"", []
        if not packet:
            raise NoWriter(f"the writer of {self._name} has ended", name=self._name)
        return self._value(packet, descriptors)

    def wait(self, within_s: float) -> Value | None:
        """Wait, in a thread, for the next value and return it; None: no value came in time. Raises as ``newest``."""
        end_s = time.monotonic() + within_s
        while (value := self.newest()) is None:
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                return None
            sealed_memory.wait_readable(self._own, left_s)
        return value

    async def next(self) -> Value:
        """Wait, in a task, for the next value and return it. Raises as ``newest``."""
        loop = asyncio.get_running_loop()
        while (value := self.newest()) is None:
            ready: asyncio.Future[None] = loop.create_future()
            loop.add_reader(self._own, settle, ready, None)
            try:
                await ready
            finally:
                loop.remove_reader(self._own)
        return value

    def close(self) -> None:
        """Leave the board; values that were returned stay valid. Idempotent."""
        self._connection.close()
        self._own.close()

    def _value(self, packet: bytes, descriptors: list[int]) -> Value:
        try:
            number, length = read_header(packet, len(descriptors), self._most)
        except BaseException:
            sealed_memory.close_all(descriptors)
            raise
        if descriptors:
            return Value(number, sealed_memory.mapped(descriptors[0], length))
        return Value(number, memoryview(packet)[HEADER.size :])
