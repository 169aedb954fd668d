"""A poor link between a machine of the test's network and its switch: it loses, delays, limits and stalls frames.

``PoorDirection`` decides what happens to each frame; run as a program in a namespace of its own, this file carries
frames between two interfaces. Each line on its standard input is a ``Weather`` as JSON.
"""

from __future__ import annotations

import array
import contextlib
import fcntl
import json
import random
import select
import socket
import struct
import sys
import time
from collections import deque
from dataclasses import dataclass, field

ALL_FRAMES, IGNORE_OUTGOING, LONGEST_FRAME = 3, 23, 65536  # linux/if_ether.h, linux/if_packet.h
SIOCETHTOOL = 0x8946  # linux/sockios.h
OFFLOADS = {"checksum": 0x17, "tcp segmentation": 0x1F, "segmentation": 0x24}  # linux/ethtool.h, ETHTOOL_S…
INNER, OUTER = "inner", "outer"


@dataclass(frozen=True)
class Weather:
    """What a poor link does to the frames of each direction.

    Attributes:
        loss: Share of the frames that are lost, 0 to 1.
        delay_s: Time that each frame takes.
        rate_bit_s: Bits that pass in a second; 0: as many as there are.
        queue_s: A frame that would wait longer than this for its bits to pass is lost.
        stall_each_s: The link stands still once in this time; 0: never.
        stall_s: So long it stands still, and then delivers what waited.
    """

    loss: float = 0.0
    delay_s: float = 0.0
    rate_bit_s: float = 0.0
    queue_s: float = 0.5
    stall_each_s: float = 0.0
    stall_s: float = 0.0


@dataclass
class PoorDirection:
    """The frames that cross a link in one direction, in their order."""

    lots: random.Random
    weather: Weather = field(default_factory=Weather)
    lost: int = 0
    _waiting: deque[tuple[float, bytes]] = field(default_factory=deque)
    _free_s: float = 0.0

    def send(self, frame: bytes, now_s: float) -> None:
        """Put a frame on the link; it may be lost."""
        weather = self.weather
        begins_s = max(now_s, self._free_s) if weather.rate_bit_s else now_s
        if self.lots.random() < weather.loss or begins_s - now_s > weather.queue_s:
            self.lost += 1
            return
        self._free_s = begins_s + (8 * len(frame) / weather.rate_bit_s if weather.rate_bit_s else 0.0)
        due_s = max(self._free_s + weather.delay_s, self._waiting[-1][0] if self._waiting else 0.0)
        self._waiting.append((due_s, frame))

    def arrived(self, now_s: float) -> list[bytes]:
        """Return the frames that have reached the other end; none during a stall."""
        weather = self.weather
        if weather.stall_each_s and now_s % weather.stall_each_s < weather.stall_s:
            return []
        frames = []
        while self._waiting and self._waiting[0][0] <= now_s:
            frames.append(self._waiting.popleft()[1])
        return frames

    @property
    def is_empty(self) -> bool:
        """Whether no frame is on its way."""
        return not self._waiting

    def wait_s(self, now_s: float) -> float:
        """Return the longest time after which ``arrived`` is to be called again."""
        return min(max(self._waiting[0][0] - now_s, 0.001), 0.02) if self._waiting else 0.5


def without_offloads(interface: str) -> None:
    """Let an interface send whole frames with a checksum each, as on a cable."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for command in OFFLOADS.values():
            value = array.array("B", struct.pack("II", command, 0))
            request = struct.pack("16sP", interface.encode(), value.buffer_info()[0])
            fcntl.ioctl(any_socket, SIOCETHTOOL, request)


def _end_of(interface: str) -> socket.socket:
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ALL_FRAMES))
    end.setsockopt(263, IGNORE_OUTGOING, 1)  # SOL_PACKET: what this program sends is no frame for it
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * 1024 * 1024)
    end.bind((interface, 0))
    end.setblocking(False)
    return end


def _take_frames(end: socket.socket, onto: PoorDirection) -> None:
    with contextlib.suppress(OSError):  # nothing more, or the cable is out
        while True:
            onto.send(end.recv(LONGEST_FRAME), time.monotonic())


def _deliver(direction: PoorDirection, end: socket.socket) -> None:
    for frame in direction.arrived(time.monotonic()):
        with contextlib.suppress(OSError):  # the cable is out: the frame is lost
            end.send(frame)


def carry(seed: int) -> None:
    """Carry frames until standard input ends."""
    ends = {INNER: _end_of(INNER), OUTER: _end_of(OUTER)}
    lots = random.Random(seed)
    ways = {INNER: PoorDirection(lots), OUTER: PoorDirection(lots)}
    across = {INNER: ends[OUTER], OUTER: ends[INNER]}
    print("ready", flush=True)
    while True:
        wait_s = min(way.wait_s(time.monotonic()) for way in ways.values())
        readable, _, _ = select.select([sys.stdin, *ends.values()], [], [], wait_s)
        if sys.stdin in readable:
            if not (line := sys.stdin.readline()):
                return
            weather = Weather(**json.loads(line))
            for way in ways.values():
                way.weather = weather
        for name, way in ways.items():
            _take_frames(ends[name], way)
            _deliver(way, across[name])


if __name__ == "__main__":
    for each in sys.argv[2:]:
        without_offloads(each)
    carry(int(sys.argv[1]))
