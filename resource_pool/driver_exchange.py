"""The exchange of an RC's driver while the RC works.

Rules of this file:

* The RC, its holds and their epochs do not take part: only the driver in its slot changes, between two calls.
* If both drivers set ``opens_beside``, or have nothing to open, the new one is opened beside the old one. Otherwise the
  old one is closed first, and calls wait until a device is open again.
* A call that hangs in the old driver is cancelled, and the new driver does it.
* If the new driver fails during its trial, the old driver comes back and repeats the failed call.
"""

from __future__ import annotations

import asyncio
import dataclasses
import logging
import threading
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import msgspec

from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.log_level import LogLevel
from backbone.component.messages import WrongParameter
from backbone.errors import Refusal, complaint
from backbone.exchange import ExchangeRunning, NotExchanged, SwapClass, Swapped
from backbone.exchange_answers import ExchangeAnswers
from backbone.exchange_course import (
    UNPROVED,
    ExchangeCourse,
    ExchangePhase,
    ExchangeRules,
    class_path_of,
    hand_over,
    remark_on_file,
)
from backbone.placer.messages import ReviseStart
from backbone.placer.revising import revise_start
from backbone.reading_anew import WrongClass, read_anew
from backbone.waiting import as_bug, only_bugs, set_within
from resource_pool.driver_slot import DriverSlot
from resource_pool.drivers.interface import DriverSite, HardwareFault, NoOptions, driver_class, driver_path, methods_of
from resource_pool.orders_in_progress import CUT_WITHIN_S

log = logging.getLogger(__name__)

OPENS_AGAIN_WITHIN_S = 20.0  # chosen: as a component has to become ready; machine seconds
CLOSES_WITHIN_S = 2.0  # chosen: a device that does not close by then hangs; machine seconds
RESTORES_WITHIN_S = 2.0  # chosen: as for a close, from the time on at which only one driver is left; machine seconds


class RcOfDrivers(ComponentOfParts, Protocol):
    """The interface of the RC that a driver exchange needs."""

    driver_kind: ClassVar[str]
    driver_field: ClassVar[str]
    closed_most_s: ClassVar[float]

    @property
    def parameters(self) -> msgspec.Struct:
        """Its parameters; ``options`` are the driver's."""

    def driver_site(self) -> DriverSite:
        """Return the interface for a driver."""

    async def driver_exchanged(self) -> None:
        """Bring the driver to the state of the RC."""

    async def driver_proved(self, since_s: float) -> None:
        """Wait until the driver that took over at this time has done what it is for, or raise ``HardwareFault``."""

    def has_driver(self, parameters: msgspec.Struct) -> None:
        """Apply the parameters with another driver."""


@dataclass(slots=True)
class _DriverExchange:
    asked: SwapClass
    slot: DriverSlot
    old: object
    new: object
    parameters: msgspec.Struct
    course: ExchangeCourse
    is_beside: bool
    is_old_closed: bool = False
    back: asyncio.Event = field(default_factory=asyncio.Event)
    """Set when the old one works again."""


class DriverExchanges:
    """Exchanges the driver of one RC, one exchange at a time."""

    def __init__(self, rc: RcOfDrivers) -> None:
        self._rc = rc
        self._going: _DriverExchange | None = None
        self._is_busy = False
        self._news = asyncio.Event()
        self._answers = ExchangeAnswers()

    def made(self, build: Callable[[DriverSite], object], site: DriverSite) -> object:
        """Return a driver whose spontaneous failures count as failures of this driver."""
        mine: list[object] = []
        loop, own_thread = asyncio.get_running_loop(), threading.get_ident()

        def failed(bug: object) -> None:
            if threading.get_ident() == own_thread:
                self._driver_failed(mine[0] if mine else None, as_bug(bug))
            else:  # events and futures may be set in the loop's thread only
                loop.call_soon_threadsafe(failed, bug)

        driver = build(dataclasses.replace(site, fail=failed))
        mine.append(driver)
        return driver

    def _driver_failed(self, driver: object, bug: BaseException) -> None:
        going = self._going
        if going is not None and driver is going.new and going.course.phase is not ExchangePhase.PROVED:
            going.course.fail(self._rc.clock.now_s(), complaint(bug))
            self._failed(bug)
            return
        if going is not None and driver is going.old and going.course.new_works:
            told = f"the old one failed beside it and is gone: {complaint(bug)}"
            going.course.end(ExchangePhase.PROVED, self._rc.clock.now_s(), told)
            return
        self._rc.fail(bug)

    def _failed(self, error: BaseException) -> asyncio.Event | None:
        """Bring the old driver back if the new one is on trial; return the event that is set when the old one works."""
        going = self._going
        if going is None or going.course.phase is ExchangePhase.PROVED or going.slot.works is not going.new:
            return None
        going.course.fail(self._rc.clock.now_s(), complaint(error))
        if going.is_beside:
            self._put_back(going)
        elif not going.back.is_set():
            going.slot.shut(has_device=False)
        return going.back

    def _put_back(self, going: _DriverExchange) -> None:
        going.slot.works, going.slot.is_tried = going.old, False
        going.slot.open_gate()
        going.back.set()

    async def swap(self, asked: SwapClass, slots: Sequence[DriverSlot]) -> Swapped:
        """Exchange the driver; return when the new one has passed its trial, or the old one is back.

        Raises:
            ExchangeRunning: Another exchange of this driver is still running.
            NotExchanged: The RC does not have exactly one driver.
            UnknownDriver: No driver has this name.
            WrongClass: The class cannot be imported or created, or is not a driver of this kind.
            WrongParameter: The driver refuses its options.
            ValuesChanged: The new file declares classes of values differently.
            UnknownExchange: The request is repeated, and this process did not get it before.
        """
        return await self._answers.answer(asked, lambda: self._swap_one(asked, slots))

    async def _swap_one(self, asked: SwapClass, slots: Sequence[DriverSlot]) -> Swapped:
        if self._is_busy:
            remedy = "Wait until it is over; 'scout-backbone log' shows it."
            raise ExchangeRunning(f"the driver of {self._rc.name} is being exchanged", remedy=remedy)
        if len(slots) != 1:
            count = f"{len(slots)} drivers" if slots else "no driver"
            raise NotExchanged(f"{self._rc.name} has {count}, and not one that could be exchanged")
        self._is_busy = True
        try:
            return await self._swap(asked, slots[0])
        except Refusal as refusal:
            self._tell(f"is not exchanged: {refusal.detail}", LogLevel.WARNING)
            raise
        finally:
            self._is_busy, self._going = False, None

    async def _swap(self, asked: SwapClass, slot: DriverSlot) -> Swapped:
        path = driver_path(self._rc.driver_kind, asked.class_path, self._rc.name)
        anew = await read_anew(path, lambda named: driver_class(named, self._rc.name))
        try:
            going = self._going = self._made(asked, slot, anew.kind)
        except Refusal:
            anew.undo()
            raise
        by = f" for {asked.user}" if asked.user else ""
        self._tell(f"{asked.class_path} warms beside {class_path_of(going.old)}{by}")
        await self._opened(going)
        if not going.course.is_over:
            await self._taken_over(going)
        bringing_up = asyncio.create_task(self._brought_up(going), name=f"{self._rc.name}: bring up the driver")
        try:
            remark = await self._over(going)
        finally:
            await self._within(bringing_up, going)
        if going.course.phase is ExchangePhase.RETURNED:
            anew.undo()
        return going.course.answer(self._now_s(), remark)

    async def _over(self, going: _DriverExchange) -> str:
        """Wait until only one of the two drivers is left; return the result for the operator."""
        while not going.course.is_over:
            self._news.clear()
            await set_within(self._news, max(0.0, going.course.due_s - self._now_s()) / self._rc.clock.rate)
            await self._used(going)
            going.course.let_pass(self._now_s())
        return await (self._proved(going) if going.course.phase is ExchangePhase.PROVED else self._returned(going))

    async def _used(self, going: _DriverExchange) -> None:
        """At the end of its trial, end the exchange if the new driver has not done what it is for."""
        since_s = going.course.switched_s
        if since_s is None or going.course.is_over or self._now_s() < going.course.due_s:
            return
        try:
            await self._rc.driver_proved(since_s)
        except HardwareFault as idle:
            self._failed(idle)

    def _made(self, asked: SwapClass, slot: DriverSlot, kind: Callable[[DriverSite], object]) -> _DriverExchange:
        """Return the exchange with its new driver, which is not open yet."""
        old, rc = slot.works, self._rc
        if missing := methods_of(old) - methods_of(kind):
            raise WrongClass(
                f"{asked.class_path} is no driver for {rc.name}: it lacks {', '.join(sorted(missing))}",
                remedy=f"Give it the methods of {class_path_of(old)}.",
            )
        options_type = getattr(kind, "options_type", NoOptions)
        had: dict[str, object] = getattr(rc.parameters, "options", {})
        try:
            has = {one.encode_name for one in msgspec.structs.fields(options_type)}
            options = {name: value for name, value in had.items() if name in has} | asked.parameters
            changed = {rc.driver_field: asked.class_path, "options": options}
            parameters = msgspec.structs.replace(rc.parameters, **changed)
            site = dataclasses.replace(rc.driver_site(), parameters=parameters)
            site.options(options_type)
            new = self.made(kind, site)
        except WrongParameter as wrong:
            raise WrongParameter(
                f"{asked.class_path} refuses its options: {wrong.detail}", remedy="Give them with --set NAME=VALUE."
            ) from None
        except UNPROVED as error:
            raise WrongClass(f"{asked.class_path} cannot be made: {complaint(error)}") from error
        rules = ExchangeRules(asked.prove_s, asked.ready_within_s)
        course = ExchangeCourse(rules, self._news.set, self._now_s())
        both_open = all(getattr(one, "opens_beside", False) for one in (old, new))
        return _DriverExchange(asked, slot, old, new, parameters, course, both_open or not hasattr(new, "open"))

    async def _opened(self, going: _DriverExchange) -> None:
        """Open the new driver; if the device allows one only, close the old one first."""
        if not hasattr(going.new, "open"):
            return
        if not going.is_beside:
            going.slot.shut(has_device=False)
            if not await self._is_quiet(going):
                return
            going.is_old_closed = True
            await self._close(going.old)
        within_s = going.asked.ready_within_s / self._rc.clock.rate
        if not going.is_beside:
            within_s = min(within_s, self._rc.closed_most_s)
        try:
            async with asyncio.timeout(within_s):
                await _open(going.new)
        except TimeoutError:
            going.course.fail(self._now_s(), f"not open within {within_s:g} s")
        except UNPROVED as error:
            going.course.fail(self._now_s(), complaint(error))

    async def _is_quiet(self, going: _DriverExchange) -> bool:
        """Wait until no call is in progress; give up calls that hang in the old driver, or end the exchange."""
        if await self._is_quiet_within(going.slot, self._rc.closed_most_s):  # other calls wait meanwhile
            return True
        going.slot.give_up_calls()
        if await self._is_quiet_within(going.slot, CUT_WITHIN_S):
            return True
        told = f"a call of {class_path_of(going.old)} hangs, even if it is cancelled"
        remedy = f"a restart helps: 'scout-backbone stop {self._rc.name}', then 'start' with its type"
        going.course.fail(self._now_s(), f"{told}; {remedy}")
        return False

    async def _is_quiet_within(self, slot: DriverSlot, within_s: float) -> bool:
        try:
            async with asyncio.timeout(within_s):
                await slot.wait_quiet()
        except TimeoutError:
            return False
        return True

    async def _taken_over(self, going: _DriverExchange) -> None:
        """Switch to the new driver between two calls."""
        going.slot.shut()
        if not await self._is_quiet(going) or going.course.is_over:  # the new driver failed by itself meanwhile
            return
        now_s = self._now_s()
        going.course.receive(now_s, lambda: hand_over(going.old, going.new))
        if going.course.cause:
            return
        going.slot.works, going.slot.on_trial, going.slot.is_tried = going.new, self._failed, True
        going.slot.calls = 0
        going.course.switch(now_s)
        going.slot.open_gate()
        self._tell(f"{going.asked.class_path} works, and has to prove itself", LogLevel.INFO)

    async def _brought_up(self, going: _DriverExchange) -> None:
        """Let the RC restore the state of a driver that has taken over."""
        if going.course.switched_s is not None:
            await self._restored(going)

    async def _restored(self, going: _DriverExchange) -> None:
        """Let the RC restore the driver's state; a fault during that counts as a fault of the working driver."""
        try:
            await self._rc.driver_exchanged()
        except HardwareFault as fault:
            if going.slot.works is going.old or going.course.phase is ExchangePhase.PROVED:
                self._rc.fail(fault)

    async def _within(self, restoring: Awaitable[None], going: _DriverExchange) -> None:
        """Wait until the state is restored; a driver that hangs ends the RC, whose creator starts it again."""
        try:
            async with asyncio.timeout(RESTORES_WITHIN_S):
                await restoring
        except TimeoutError:
            hung = f"{class_path_of(going.slot.works)} did not restore its state within {RESTORES_WITHIN_S:g} s"
            self._rc.fail(HardwareFault(f"{self._rc.name}: {hung}"))

    async def _returned(self, going: _DriverExchange) -> str:
        if going.is_old_closed:
            await self._close(going.new)
            try:
                await self._open_again(going.old)
            except HardwareFault as fault:
                self._put_back(going)
                self._rc.fail(fault)  # its creator starts it again, and it opens the device
                return ""
        self._put_back(going)
        old, new = class_path_of(going.old), going.asked.class_path
        self._tell(going.course.outcome(old, new), LogLevel.WARNING)
        if going.course.switched_s is not None or going.is_old_closed:
            await self._within(self._restored(going), going)
        if going.is_beside:
            await self._close(going.new)
        return remark_on_file(self._rc.name, old, new)

    async def _open_again(self, old: object) -> None:
        """Open the old driver again.

        Raises:
            HardwareFault: It cannot be opened, or hangs.
        """
        try:
            async with asyncio.timeout(OPENS_AGAIN_WITHIN_S):
                await _open(old)
        except TimeoutError:
            raise HardwareFault(f"{class_path_of(old)} did not open again within {OPENS_AGAIN_WITHIN_S:g} s") from None

    async def _proved(self, going: _DriverExchange) -> str:
        going.slot.is_tried, going.course.rounds = False, going.slot.calls
        self._rc.has_driver(going.parameters)
        if going.is_beside:
            await self._close(going.old)
        self._tell(going.course.outcome(class_path_of(going.old), going.asked.class_path))
        order = ReviseStart(self._rc.name, msgspec.to_builtins(self._rc.parameters))
        idle = "" if going.slot.calls else "nothing was asked of the new driver during its trial"
        return "; ".join(filter(None, (idle, await revise_start(self._rc.bus, self._rc.clock, order))))

    async def _close(self, driver: object) -> None:
        """Close a driver that is no longer in use; if this fails, log it and go on."""
        close = getattr(driver, "close", None)
        if close is None:
            return
        try:
            async with asyncio.timeout(CLOSES_WITHIN_S):
                await only_bugs(close(), f"close of {class_path_of(driver)}")
        except UNPROVED as error:
            log.warning("%s: %s does not close: %s", self._rc.name, class_path_of(driver), complaint(error))

    def _now_s(self) -> float:
        return self._rc.clock.now_s()

    def _tell(self, what: str, level: LogLevel = LogLevel.NOTICE) -> None:
        self._rc.publish_event(self._rc.name, what, level)


async def _open(driver: object) -> None:
    opening: Callable[[], Awaitable[None]] = getattr(driver, "open", _nothing)
    await only_bugs(opening(), f"open of {class_path_of(driver)}")


async def _nothing() -> None:
    pass
