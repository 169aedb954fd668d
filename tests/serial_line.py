"""A serial line made for a test: a pair of terminals of the system in place of port, cable and radio."""

from __future__ import annotations

import contextlib
import os
import select
from collections.abc import Iterator

from resource_pool.drivers.serial_frames import FrameReader, SerialFrame

ARRIVES_WITHIN_S = 0.05  # the system passes bytes from one end to the other in a task of its own


class SerialLine:
    """The far end of a line.

    Attributes:
        port: Path of the near end.
        heard: Frames that have arrived.
        bytes_heard: All bytes that have arrived.
    """

    def __init__(self) -> None:
        self._far, self._near = os.openpty()
        os.set_blocking(self._far, False)
        self.port = os.ttyname(self._near)
        self.heard: list[SerialFrame] = []
        self.bytes_heard = bytearray()
        self._frames, self._is_open = FrameReader(), True

    def listen(self) -> list[SerialFrame]:
        """Return the frames that have arrived so far."""
        while select.select([self._far], [], [], ARRIVES_WITHIN_S)[0]:
            try:
                come = os.read(self._far, 65536)
            except OSError:  # the near end is closed
                break
            self.bytes_heard += come
            self.heard += self._frames.feed(come)
        return self.heard

    def payloads(self) -> list[bytes]:
        return [frame.payload for frame in self.listen()]

    def say(self, line: bytes) -> None:
        os.write(self._far, line)

    def unplug(self) -> None:
        """Close both ends that are ours."""
        if self._is_open:
            self._is_open = False
            os.close(self._far)
            os.close(self._near)


@contextlib.contextmanager
def serial_line() -> Iterator[SerialLine]:
    """Have a line, to the end of the block."""
    line = SerialLine()
    try:
        yield line
    finally:
        line.unplug()
