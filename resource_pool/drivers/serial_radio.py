"""Driver of a command radio on a serial port: it sends each packet as a frame, see ``serial_frames``.

``transmit`` returns when the bytes of the frame have left. A call that is cancelled takes back what has not left, so
the radio gets a frame without an end, which it drops. What is in the adapter already leaves before the call ends.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Annotated, Literal

import msgspec

from resource_pool.drivers.interface import DriverSite, HardwareFault
from resource_pool.drivers.reply_turns import ReplyTurns
from resource_pool.drivers.serial_frames import FrameReader, SerialFrame, SerialKind, line_bytes
from resource_pool.drivers.serial_port import SerialPort

BITS_PER_BYTE = 10  # 8 data bits, with a start and a stop bit
ADAPTER_S = 0.001  # chosen: an adapter gets its bytes with the next frame of USB, each millisecond
STEP_S = 0.001  # chosen: as often as USB passes bytes; machine seconds
STUCK_S = 0.5  # chosen: half of the time that an RC gives one packet; machine seconds
REPLY_EVERY_S = 0.5  # chosen: a person reads a gauge no faster; mission seconds, machine seconds if the clock is faster
FIRST_REPLY = bytes(4)  # chosen: a Scout's; later the last reply's length is known


class SerialRadioOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a radio on a serial port.

    Attributes:
        port: Path of the port on the host of the radio, as in ``/dev/ttyUSB0``.
        baud: Bits a second on the line.
        extra_s: Time of each packet on the air beyond its time on the line, seconds; for example, its preamble.
    """

    port: Annotated[str, msgspec.Meta(min_length=1)]
    baud: Literal[9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000, 921600, 1000000] = 115200
    extra_s: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.0


class SerialRadio:
    """A transmitter on a serial port, over which robots may reply."""

    options_type = SerialRadioOptions

    def __init__(self, site: DriverSite) -> None:
        self._site = site
        self._options = site.options(SerialRadioOptions)
        self._port: SerialPort | None = None
        self._frames = FrameReader()
        self._turns = ReplyTurns(REPLY_EVERY_S * max(1.0, site.clock.rate))
        self._hearing: dict[int, Callable[[bytes], None]] = {}
        self._replies: dict[int, bytes] = {}

    async def open(self) -> None:
        """Open the port."""
        self._port = SerialPort(self._options.port, self._options.baud)
        self._frames = FrameReader()
        asyncio.get_running_loop().add_reader(self._port.number, self._bytes_came)

    async def transmit(self, network_id: int, payload: bytes, **_for_audits: object) -> float | None:
        """Send the packet; return when its bytes have left. See ``RadioDriver.transmit``."""
        asks = network_id in self._hearing and self._ask(network_id)
        kind = SerialKind.ASKING if asks else SerialKind.COMMAND
        line = line_bytes(SerialFrame(kind, network_id, payload))
        await self._send(line)
        air_s = self._line_s(line) + self._options.extra_s
        if asks:
            reply = SerialFrame(SerialKind.REPLY, network_id, self._replies.get(network_id, FIRST_REPLY))
            air_s += self._line_s(line_bytes(reply)) + self._options.extra_s
        return air_s * self._site.clock.rate

    def hear(self, network_id: int, heard: Callable[[bytes], None]) -> None:
        """Ask this robot for a reply every ``REPLY_EVERY_S``; a reply that has not come by then is lost."""
        self._hearing[network_id] = heard

    async def close(self) -> None:
        """Close the port."""
        port, self._port = self._port, None
        if port is not None:
            asyncio.get_running_loop().remove_reader(port.number)
            port.close()

    def _line_s(self, line: bytes) -> float:
        return len(line) * BITS_PER_BYTE / self._options.baud

    async def _send(self, line: bytes) -> None:
        """Return when the bytes have left."""
        port, clock = self._port, self._site.clock
        if port is None:
            raise HardwareFault(f"serial port {self._options.port} is not open")
        left_s = clock.now_s() + (self._line_s(line) + ADAPTER_S) * clock.rate
        rest = memoryview(line)
        try:
            while True:
                rest = rest[port.write(rest) :]
                now_s = clock.now_s()
                if not rest and now_s >= left_s and not port.waiting():
                    return
                if now_s >= left_s + STUCK_S * clock.rate:
                    raise HardwareFault(f"serial port {self._options.port} took no more bytes for {STUCK_S:g} s")
                await clock.sleep_until_s(max(left_s, now_s + STEP_S * clock.rate))
        except BaseException:
            port.discard()
            await clock.sleep_until_s(left_s)  # the rest is in the adapter
            raise

    def _ask(self, network_id: int) -> bool:
        turn = self._turns.take(network_id, self._site.clock.now_s())
        if turn.is_lost:
            self._hearing[network_id](b"")
        return turn.asks

    def _bytes_came(self) -> None:
        assert self._port is not None  # noqa: S101  else it is not called
        try:
            frames = [*self._frames.feed(self._port.read())]
        except HardwareFault as fault:
            asyncio.get_running_loop().remove_reader(self._port.number)
            self._site.fail(fault)
            return
        for frame in frames:
            heard = self._hearing.get(frame.network_id)
            if frame.kind is SerialKind.REPLY and frame.payload and heard is not None:
                self._turns.heard(frame.network_id)
                self._replies[frame.network_id] = frame.payload
                heard(frame.payload)
