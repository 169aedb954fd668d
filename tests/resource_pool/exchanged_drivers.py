"""Drivers for tests of their exchange."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

import msgspec
from driver_bench import Bench

from resource_pool.drivers.interface import DriverSite, HardwareFault, Picture
from resource_pool.drivers.simulated import SimulatedRadio, SimulatedScoutProtocol


class First:
    """A driver of a device that can be opened once."""

    hands_over = frozenset({"count"})

    def __init__(self, site: DriverSite) -> None:
        self.site, self.count, self.who = site, 0, type(self).__name__

    async def set_brightness(self, share: float) -> None:
        self.count += 1
        if Bench.fault == "stuck":
            await asyncio.Event().wait()
        if Bench.fault == "deaf":
            await deaf()
        await asyncio.sleep(0.01)
        Bench.shone.append((self.who, share))

    async def open(self) -> None:
        await asyncio.sleep(0.1)
        Bench.opened.append(self.who)
        Bench.most_open = max(Bench.most_open, len(Bench.opened))

    async def close(self) -> None:
        if self.who in Bench.opened:
            Bench.opened.remove(self.who)


async def cut() -> None:
    """Await a task that this driver has cancelled, which raises ``CancelledError`` here."""
    reading = asyncio.ensure_future(asyncio.Event().wait())
    reading.cancel()
    await reading


async def deaf() -> None:
    """Wait until the bench ends it, and ignore cancellations."""
    while not Bench.end_deaf.is_set():
        with contextlib.suppress(asyncio.CancelledError):
            await Bench.end_deaf.wait()


class Second(First):
    """Another one, which fails as the test says."""

    async def open(self) -> None:
        match Bench.fault:
            case "open":
                raise HardwareFault("no such device")
            case "open late":
                await asyncio.sleep(60.0)
            case "open wrongly":
                raise ZeroDivisionError
            case "open cut":
                await cut()
        await super().open()

    async def set_brightness(self, share: float) -> None:
        match Bench.fault:
            case "call":
                raise HardwareFault("the lamp is loose")
            case "call wrongly":
                raise ValueError("planted")
            case "call cut":
                await cut()
            case "hang":
                await asyncio.Event().wait()
            case "task":
                self.site.fail(OSError("pulled"))
            case "text":
                self.site.fail("pulled")  # type: ignore[arg-type]
        await super().set_brightness(share)


class CutAtItsEnd(First):
    """Awaits its cancelled task when it is closed."""

    async def close(self) -> None:
        await super().close()
        await cut()


class Sticky(First):
    """Hangs when it is opened again."""

    async def open(self) -> None:
        await super().open()
        self.open = asyncio.Event().wait  # type: ignore[assignment,method-assign]


class FirstBeside(First):
    opens_beside = True


class SecondBeside(Second):
    opens_beside = True


class Mistyped(Second):
    class options_type(msgspec.Struct):  # noqa: N801  its name in a driver
        gamma: flaot = 1.0  # type: ignore[name-defined]  # noqa: F821


class FirstCamera:
    """A camera that can be opened once, and knows nothing while it is closed."""

    def __init__(self, site: DriverSite) -> None:
        self.site, self.who = site, type(self).__name__

    async def open(self) -> None:
        await asyncio.sleep(0.5)
        if Bench.fault == "open" and self.who == "SecondCamera":
            raise HardwareFault("no such device")
        Bench.tuned[self.who] = ""

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        self._set(frequency)
        if Bench.fault != "mute" or self.who == "FirstCamera":
            asyncio.get_running_loop().call_later(0.1, lambda: deliver(self._picture()))

    def _picture(self) -> Picture:
        return Picture(self.site.clock.now_s(), memoryview(bytes(4)), 2, 2)

    def stop(self) -> None:
        self._set("")

    async def close(self) -> None:
        Bench.tuned.pop(self.who, None)

    def _set(self, frequency: str) -> None:
        if self.who not in Bench.tuned:
            raise HardwareFault("the device is not open")
        Bench.tuned[self.who] = frequency


class SecondCamera(FirstCamera):
    """Another one, which fails as the test says."""

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        super().tune(frequency, deliver)
        if Bench.fault == "task":
            self.site.fail(OSError("pulled"))


class NoLamp:
    def __init__(self, site: DriverSite) -> None:
        pass


class LoudProtocol(SimulatedScoutProtocol):
    def drive(self, left_rad_s: float, right_rad_s: float) -> bytes:
        if Bench.fault == "call":
            raise ValueError("too loud")
        return super().drive(left_rad_s, right_rad_s)


class AbsentRadio(SimulatedRadio):
    """A radio on a port that is not there, which can be opened once."""

    opens_beside = False

    async def open(self) -> None:
        raise HardwareFault("no such port")
