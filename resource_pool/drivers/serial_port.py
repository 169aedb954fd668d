"""A serial port that never blocks its caller, through the system's terminal interface (POSIX termios)."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import struct
import termios
import tty

from resource_pool.drivers.interface import HardwareFault

READ_BYTES = 4096
INT = struct.Struct("i")
UNPLUGGED = "Plug it in again, and see that the device has power."
SPEED_IN, SPEED_OUT, CONTROL = 4, 5, 2  # places in the list of termios.tcgetattr
FAULTS = (OSError, termios.error)


class SerialPort:
    """An open port: 8 data bits, no parity, 1 stop bit, no flow control.

    Args:
        baud: Bits a second, one of the speeds that termios has.

    Raises:
        HardwareFault: The port is missing, in use, or no serial port; of each method but ``close``: it is gone.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._path = path
        try:
            self.number = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            remedy = "Plug it in; 'ls /dev/serial/by-id' lists what is there."
            if error.errno in (errno.EACCES, errno.EPERM):
                remedy = "Add the user to the group of the device: dialout."
            raise HardwareFault(f"serial port {path} cannot be opened: {error.strerror}", remedy=remedy) from error
        try:
            self._prepare(baud)
        except BaseException:
            os.close(self.number)
            raise

    def write(self, line: bytes | memoryview) -> int:
        """Hand the first of these bytes to the system; return how many it took."""
        try:
            return os.write(self.number, line)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise self._gone(error) from error

    def read(self) -> bytes:
        """Return the bytes that have come; none: no byte has come."""
        try:
            come = os.read(self.number, READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._gone(error) from error
        if not come:
            raise self._gone(None)
        return come

    def waiting(self) -> int:
        """Return the number of bytes that the system has not passed to the device yet."""
        try:
            count: int = INT.unpack(fcntl.ioctl(self.number, termios.TIOCOUTQ, bytes(INT.size)))[0]
        except OSError as error:
            raise self._gone(error) from error
        return count

    def discard(self) -> None:
        """Drop all bytes that the system has not passed to the device yet; a port that is gone has none."""
        with contextlib.suppress(*FAULTS):
            termios.tcflush(self.number, termios.TCOFLUSH)

    def close(self) -> None:
        """Close the port at once: a close waits for bytes that are not sent yet, so they are dropped."""
        self.discard()
        os.close(self.number)

    def _prepare(self, baud: int) -> None:
        try:
            fcntl.flock(self.number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            remedy = f"Let one resource alone use it, or end the other program: 'fuser {self._path}' names it."
            raise HardwareFault(f"serial port {self._path} is in use", remedy=remedy) from None
        try:
            tty.setraw(self.number)
            settings = termios.tcgetattr(self.number)
            settings[CONTROL] &= ~(termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
            settings[CONTROL] |= termios.CS8 | termios.CREAD | termios.CLOCAL
            settings[SPEED_IN] = settings[SPEED_OUT] = getattr(termios, f"B{baud}")
            termios.tcsetattr(self.number, termios.TCSANOW, settings)
            termios.tcflush(self.number, termios.TCIOFLUSH)
        except FAULTS as error:
            remedy = "Name a serial port, as in /dev/ttyUSB0 or /dev/ttyACM0."
            raise HardwareFault(f"{self._path} is no serial port: {error.args[-1]}", remedy=remedy) from error

    def _gone(self, error: OSError | None) -> HardwareFault:
        why = f": {error.strerror}" if error is not None else ""
        return HardwareFault(f"serial port {self._path} is gone{why}", remedy=UNPLUGGED)
