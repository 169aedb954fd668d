"""DriverSlot: holds an RC's driver, so that the driver can be replaced between two calls; the RC calls its proxy.

Rules of this file:

* At any instant exactly one driver works: all calls go to this driver, and only its callbacks arrive.
* A new driver takes over while no call is in progress. While no device is open, asynchronous calls wait, and what
  synchronous calls raise is dropped, because the RC repeats its settings afterwards.
* A call that hangs in the old driver can be given up: it is cancelled, and the next working driver does it from the
  start.
* While a driver is on trial, its bugs and hardware faults, and calls that hang, reach the RC only if the old driver
  cannot do the same call. A value that the RC cannot use, returned or delivered, is a hardware fault too.
"""

from __future__ import annotations

import asyncio
import functools
import inspect
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from backbone.errors import Refusal
from backbone.exchange_course import UNPROVED
from backbone.waiting import only_bugs
from resource_pool.drivers.interface import HardwareFault

HANGS_S = 0.2  # chosen: the old driver still has as long until the RC itself gives a call up; machine seconds
Judge = Callable[[str, object], object]
"""Name of a method, and what it returned → what the RC uses; raises ``HardwareFault`` if the RC cannot use it."""

Again = Callable[[str], None]
"""Name of a method whose failed call is to be repeated; raises a ``Refusal`` if the call has become pointless."""

SLOTS_KEPT = 64  # chosen: more than the kinds of drivers in one process


def as_returned(_method: str, returned: object) -> object:
    """Use what a driver returns as it is."""
    return returned


def always(_method: str) -> None:
    """Repeat every failed call."""


class DriverSlot:
    """The place of an RC's driver.

    Attributes:
        proxy: An object with the driver's methods, and with no other public name, because a driver may use any name.
        on_trial: Called with the exception when the working driver fails. Returns None if that driver is not on trial;
            otherwise an event that is set when the old driver works again.
        calls: Calls that were answered.
        is_tried: True: the driver that works is on trial.
        has_device: False: no device is open, until the gate is opened.
    """

    def __init__(self, driver: object, judge: Judge, again: Again, fail: Callable[[BaseException], None]) -> None:
        """Pass calls to this driver.

        Args:
            judge: Reads what its methods return.
            again: Called before the old driver repeats an asynchronous call, because time has passed since.
            fail: Called with the hardware fault if a driver that is not on trial delivers a value of no use.
        """
        self._judge, self._again, self._fail = judge, again, fail
        self.proxy: Any = _proxy_class(type(driver))(self)  # type: ignore[arg-type]  # mypy: classes have no hash
        self.works = driver
        self.on_trial: Callable[[BaseException], asyncio.Event | None] = lambda _error: None
        self.calls, self.is_tried, self.has_device = 0, False, True
        self._opened, self._quiet = asyncio.Event(), asyncio.Event()
        self._opened.set()
        self._quiet.set()
        self._under_way = 0
        self._limits: set[asyncio.Timeout] = set()
        self._given_up: set[asyncio.Timeout] = set()

    def shut(self, *, has_device: bool = True) -> None:
        """Make asynchronous calls wait from now on.

        Args:
            has_device: False: no device stays open.
        """
        self.has_device = self.has_device and has_device
        self._opened.clear()

    def open_gate(self) -> None:
        """Pass calls to the working driver from now on."""
        self.has_device = True
        self._opened.set()

    def give_up_calls(self) -> None:
        """Cancel the calls in progress; whichever driver works when the gate opens does them from the start."""
        self._given_up |= self._limits
        for limit in self._limits:
            limit.reschedule(asyncio.get_running_loop().time())

    async def wait_open(self) -> None:
        """Wait until calls are passed to a driver."""
        await self._opened.wait()

    async def wait_quiet(self) -> None:
        """Wait until no call is in progress."""
        await self._quiet.wait()

    def call(self, name: str, arguments: tuple[object, ...], named: Mapping[str, object]) -> object:
        """Call a synchronous method."""
        driver = self.works
        try:
            done = getattr(driver, name)(*(self._while_works(driver, one) for one in arguments), **named)
            done = self._judge(name, done)
        except UNPROVED as error:
            if not self.has_device and not _is_no_fault(error):
                return None
            back = None if _is_no_fault(error) else self.on_trial(error)
            if back is None:
                raise
            if not back.is_set():  # the device must be opened first, and a synchronous caller cannot wait
                raise HardwareFault(f"{name}: {error}") from error
            return self.call(name, arguments, named)
        self.calls += 1
        return done

    async def call_later(self, name: str, arguments: tuple[object, ...], named: Mapping[str, object]) -> object:
        """Call an asynchronous method."""
        await self._opened.wait()
        driver, back, limit = self.works, None, asyncio.timeout(HANGS_S if self.is_tried else None)
        self._under_way += 1
        self._quiet.clear()
        try:
            given = [self._while_works(driver, one) for one in arguments]
            call: Awaitable[object] = getattr(driver, name)(*given, **named)
            self._limits.add(limit)
            done = await only_bugs(_within(limit, call), f"{name} of a driver")
            done = self._judge(name, done)
            self.calls += 1
            return done
        except UNPROVED as error:
            fault = HardwareFault(f"{name} took longer than {HANGS_S} s") if isinstance(error, TimeoutError) else error
            if not _is_no_fault(error) and self.works is driver:
                back = self.on_trial(fault)
            if back is None and self.works is driver and limit not in self._given_up:
                raise
        finally:
            self._limits.discard(limit)
            self._given_up.discard(limit)
            self._under_way -= 1
            if not self._under_way:
                self._quiet.set()
        if back is not None:
            await back.wait()
        self._again(name)
        return await self.call_later(name, arguments, named)

    def _while_works(self, driver: object, given: object) -> object:
        """Wrap a callback so that it is called only while this driver works; return any other argument unchanged.

        A driver may call from where an exception is lost, so it gets none.
        """
        if not callable(given):
            return given

        def heard(*what: object) -> object:
            if self.works is not driver:
                return None
            try:
                return given(*what)
            except HardwareFault as fault:
                if self.on_trial(fault) is None:
                    self._fail(fault)
                return None

        return heard


async def _within(limit: asyncio.Timeout, call: Awaitable[object]) -> object:
    async with limit:
        return await call


class _Proxy:
    """Base class of all proxies; values of the driver are read and set at the driver that works."""

    _slot: DriverSlot

    def __init__(self, slot: DriverSlot) -> None:
        self.__dict__["_slot"] = slot

    def __getattr__(self, name: str) -> object:
        found: object = getattr(self.__dict__["_slot"].works, name)
        return found

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._slot.works, name, value)


@functools.lru_cache(maxsize=SLOTS_KEPT)
def _proxy_class(driver: type[Any]) -> type[_Proxy]:
    methods = {
        name: _waiting(name) if inspect.iscoroutinefunction(method) else _at_once(name)
        for name, method in inspect.getmembers(driver, callable)
        if not name.startswith("_") and not isinstance(method, type)
    }
    return type("DriverProxy", (_Proxy,), methods)


def _waiting(name: str) -> Callable[..., object]:
    async def method(self: _Proxy, *arguments: object, **named: object) -> object:
        return await self._slot.call_later(name, arguments, named)

    return method


def _at_once(name: str) -> Callable[..., object]:
    def method(self: _Proxy, *arguments: object, **named: object) -> object:
        return self._slot.call(name, arguments, named)

    return method


def _is_no_fault(error: BaseException) -> bool:
    """Return whether a healthy driver may raise this exception, because it refuses its arguments."""
    return isinstance(error, Refusal) and not isinstance(error, HardwareFault)
