"""Order keeper: carries out the order book's decisions, with behaviors that the placer starts and ends.

A behavior reports to its console several times a second, and ends by itself if the console does not answer. So no order
outlives its console. If the behavior of an order is gone, the console does not start it again.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from typing import assert_never

from backbone.addresses import COMPONENT_DATABASE, DEPENDENCY_DATABASE, NAMESERVER, PLACER, RC_MANAGER
from backbone.component.peer_monitor import PeerMonitor
from backbone.component_database.messages import ListTypes, Types
from backbone.dependency_database.messages import AskResources, Resources
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.mission.behavior_reports import BehaviorStatus, BreakOff, BrokenOff, ChildReport, ReportNoted
from backbone.mission_log.operators import OperatorAction
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import CreatorSilent, Ended, Start, Started, StopComponent
from backbone.placer.wishes import START_WITHIN_S
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule
from backbone.waiting import end_tasks
from ui_console.model.events import OrderChanged
from ui_console.model.order_book import Begin, EndBehavior, Instruction, OrderBook, Rest, ShowOrder, Take, Yield
from ui_console.model.order_facts import NEEDS_PLACES, behavior_of, kind_for, localizer_of, start_of
from ui_console.model.orders import GivenOrder, Order, OrderState
from ui_console.session.claim import ANY_ROBOT, TeleoperationParameters
from ui_console.session.observer import Observer

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: behaviors answer in milliseconds
END_WITHIN_S = 30.0  # chosen: as for ARCs, because a host may be busy
AGAIN_AFTER_S = 0.2  # chosen: a restarted placer is back after one or two of these intervals; machine seconds
DRAIN_WITHIN_S = 1.0  # chosen: behaviors that still run then end by themselves as soon as the console is gone


class UnknownOrder(Refusal):
    """This console gave no such order, or ended it."""

    code = "order.unknown"
    remedy = "Nothing to do: a behavior whose console does not know it ends by itself."


class OrderKeeper:
    """The orders of one console.

    Args:
        robot: Returns the robot at the stick; empty: none.
        hand_over: Hands this robot from the stick over to its waiting order; does nothing if the stick has not claimed
            it.
        take: Claims this robot for the stick.
    """

    def __init__(
        self,
        console: Observer[TeleoperationParameters],
        robot: Callable[[], str],
        hand_over: Callable[[str, str], Awaitable[None]],
        take: Callable[[str], None],
    ) -> None:
        self._console, self._robot, self._hand_over, self._take = console, robot, hand_over, take
        self._book = OrderBook()
        self._given_s: dict[str, float] = {}
        self._carrying: dict[int, asyncio.Task[None]] = {}
        self._removals: dict[int, asyncio.Task[None]] = {}
        self._changed = asyncio.Event()

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its order; a finished order still keeps the robot for the operator."""
        return self._book.orders

    def goes_on(self, robot: str) -> bool:
        """Return whether this robot has an unfinished order."""
        return self._book.goes_on(robot)

    def given_s(self, robot: str) -> float:
        """Return the time of this robot's newest order."""
        return self._given_s[robot]

    def give(self, orders: Sequence[Order]) -> list[int]:
        """Give these orders at the same time, and show the outcome of each; return their numbers."""
        return [self._give(order if order.robot else replace(order, robot=self._robot())) for order in orders]

    def _give(self, order: Order) -> int:
        self._console.acted(OperatorAction.ORDER, order.robot or ANY_ROBOT, order.sentence)
        self._given_s[order.robot] = self._console.clock.now_s()
        self._carry_out(self._book.give(order))
        return self._book.last

    def touched(self, robot: str) -> bool:
        """End the order of this robot, because its operator wants it at the stick; return whether it had an order."""
        todo = self._book.touched(robot)
        self._carry_out(todo)
        return bool(todo)

    def taken(self, robot: str) -> None:
        """Record that the stick has the robot."""
        self._carry_out(self._book.taken(robot))

    async def wait_begun(self, robot: str) -> None:
        """Wait until no order of this robot is starting: its behavior waits for the robot, or the order has failed."""
        while (given := self._book.orders.get(robot)) is not None and given.state is OrderState.STARTING:
            await self._changed.wait()

    async def give_back(self, robot: str, why: str) -> bool:
        """End the order of this robot; return, once its behavior has let the robot go, whether it had one."""
        todo = self._book.given_back(robot, why)
        self._carry_out(todo)
        ends = [self._removals[step.number] for step in todo if isinstance(step, EndBehavior)]
        await asyncio.gather(*ends, return_exceptions=True)
        return bool(todo)

    def away(self, why: str) -> None:
        """Record that the operator is away; see ``OrderBook.away``."""
        self._carry_out(self._book.away(why))

    def back(self) -> None:
        """Record that the operator is there."""
        self._book.back()

    def reported(self, source: str, report: ChildReport) -> ReportNoted:
        """Note the report of a behavior.

        Raises:
            UnknownOrder: The behavior carries out no order of this console; it then ends.
        """
        number = self._number_of(report.child)
        if number is None or component_of(source) != report.child:
            raise UnknownOrder(f"{source} carries out no order of {self._console.name}", child=report.child)
        if report.status.is_final:
            is_done, said = report.status is BehaviorStatus.SUCCESS, _outcome(report.payload)
            front = self._is_in_front(number)
            self._carry_out(self._book.finished(number, is_done=is_done, why=said, in_front=front))
        elif report.suspended_because:
            self._carry_out(self._book.waits(number, report.suspended_because))
        else:
            self._carry_out(self._book.runs(number))
        return ReportNoted()

    async def drain(self) -> None:
        """End all orders, because the console ends; behaviors that do not end in time end by themselves."""
        for robot in list(self._book.orders):
            for step in self._book.given_back(robot, "the console ends"):
                if isinstance(step, ShowOrder):
                    self._show(step.given)
        ends = [self._end(number) for number in self._book.numbers]
        try:
            async with asyncio.timeout(DRAIN_WITHIN_S):
                await asyncio.gather(*ends)
        except TimeoutError:
            log.warning("%s leaves before its orders have ended", self._console.name)

    def _carry_out(self, steps: Sequence[Instruction]) -> None:
        start_task = self._console.start_task
        for step in steps:
            match step:
                case ShowOrder(given):
                    self._show(given)
                case Begin(number):
                    self._carrying[number] = start_task(self._carry(number), f"order {number}")
                case Yield(number, order):
                    start_task(self._pass_on(order), f"robot for order {number}")
                case Rest(number):
                    start_task(self._rest(number), f"rest of order {number}")
                case EndBehavior(number):
                    self._removals[number] = start_task(self._remove(number), f"end of order {number}")
                case Take(robot):
                    self._take(robot)
                case _:
                    assert_never(step)

    def _show(self, given: GivenOrder) -> None:
        self._changed.set()
        self._changed = asyncio.Event()
        self._console.show(OrderChanged(self._console.clock.now_s(), given))
        if given.state.is_final:
            why = f"{given.state}: {given.why}" if given.why else str(given.state)
            self._console.acted(OperatorAction.ORDER_END, given.order.robot, f"{given.order.sentence}, {why}")

    def _is_in_front(self, number: int) -> bool:
        given = self._book.get(number)
        return given is not None and given.order.robot == self._robot()

    def _number_of(self, behavior: str) -> int | None:
        return next(
            (number for number in self._book.numbers if behavior_of(self._console.name, number) == behavior), None
        )

    def _address(self, number: int) -> str:
        return address(Subsystem.MISSION_CONTROL, behavior_of(self._console.name, number))

    async def _pass_on(self, order: Order) -> None:
        await self._hand_over(order.robot, order.sentence)

    async def _carry(self, number: int) -> None:
        """Start the behavior of an order, and wait until it is gone; it reports meanwhile."""
        console = self._console
        try:
            start = await self._start_of(number)
            await console.bus.ask(PLACER, start, Started, within_s=START_WITHIN_S)
        except Refusal as refusal:
            self._lost(number, f"{refusal.detail} {refusal.remedy}")
            return
        except LinkError as error:
            self._lost(number, f"it is not known whether it began: {error}")
            return
        behavior = PeerMonitor(console.bus, self._address(number))
        queueing = console.start_task(self._wait_queued(number), f"queue of order {number}")
        try:
            await behavior.wait_gone()
        finally:
            behavior.close()
            queueing.cancel()
        self._lost(number, "its behavior is gone")

    def _lost(self, number: int, why: str) -> None:
        self._carry_out(self._book.lost(number, why, in_front=self._is_in_front(number)))

    async def _start_of(self, number: int) -> Start:
        """Return the launch of the behavior; show the source of its positions."""
        given = self._book.get(number)
        assert given is not None  # noqa: S101  the order is removed only after its task was cancelled
        console, order = self._console, given.order
        types, hardware, there = await asyncio.gather(
            console.ask_core(COMPONENT_DATABASE, ListTypes(), Types),
            console.ask_core(DEPENDENCY_DATABASE, AskResources(), Resources),
            console.ask_core(NAMESERVER, ListComponents(), Components),
        )
        kind = kind_for(order, [one.component_type for one in types.types], hardware.resources)
        localizer = localizer_of(there.components) if order.kind in NEEDS_PLACES else None
        if localizer is not None:
            self._carry_out(self._book.based_on(number, localizer.words))
        wished = console.parameters
        return start_of(
            order,
            number,
            kind,
            localizer,
            console=console.address,
            priority=wished.priority,
            runtime_s=wished.minimum_runtime_s,
        )

    async def _wait_queued(self, number: int) -> None:
        """Wait until the behavior's request for its robot is at the RC manager, or granted."""
        behavior, is_queued = self._address(number), asyncio.Event()

        def look(schedule: Schedule) -> None:
            if any(one.owner == behavior and one.state is not RequestState.IDLE for one in schedule.requests):
                is_queued.set()

        bus = self._console.bus
        hearing = bus.subscribe(
            RC_MANAGER, Conversation.SCHEDULE, Schedule, lambda envelope: look(envelope.body), latest=True
        )
        try:
            look(await self._console.ask_core(RC_MANAGER, AskSchedule(), Schedule))
            await is_queued.wait()
        except (LinkError, Refusal) as error:
            log.info("the schedule is not known: %s", error)
            await is_queued.wait()
        finally:
            hearing.close()
        self._carry_out(self._book.queued(number))

    async def _rest(self, number: int) -> None:
        """Ask the behavior to bring its robot to rest, until it answers or is gone."""
        console = self._console
        while self._book.get(number) is not None:
            try:
                await console.bus.ask(self._address(number), BreakOff(), BrokenOff, within_s=REPLY_TIME_S)
            except (LinkError, Refusal) as error:
                log.info("order %d is not at rest: %s", number, error)
            else:
                return
            await console.clock.sleep_s(AGAIN_AFTER_S * console.clock.rate)

    async def _remove(self, number: int) -> None:
        await end_tasks(*(task for task in [self._carrying.pop(number, None)] if task is not None))
        await self._end(number)
        self._book.removed(number)
        self._removals.pop(number, None)

    async def _end(self, number: int) -> None:
        """Return when the placer has ended the behavior, or does not know it."""
        console, name = self._console, behavior_of(self._console.name, number)
        while True:
            try:
                stop = StopComponent(name, f"{console.user} ends the order")
                await console.bus.ask(PLACER, stop, Ended, within_s=END_WITHIN_S)
            except (LinkError, CreatorSilent) as error:
                log.info("order %d is not ended yet: %s", number, error)
            except Refusal as refusal:
                log.info("order %d: %s", number, refusal)
                return
            else:
                return
            await console.clock.sleep_s(AGAIN_AFTER_S * console.clock.rate)


def _outcome(payload: Mapping[str, object]) -> str:
    """Return the reason of failure or the place of arrival from a behavior's payload, for people; empty: not stated."""
    match payload:
        case {"detail": str(detail)}:
            return detail
        case {"x_m": float(x_m), "y_m": float(y_m)}:
            return f"at {x_m:.2f}, {y_m:.2f}"
        case _:
            return ""
