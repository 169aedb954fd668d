"""Order book: decides the actions when an order is given, proceeds or ends, or the operator touches the stick. Pure.

Laws:

* A robot has at most one unfinished order. A newer order, a touch of the stick and the release of the robot end it.
* A behavior is removed only when the stick has the robot, when the behavior of a newer order has it or waits for it
next, or when the operator releases it. So a robot is never free between stick and order.
* Every started behavior is removed exactly once.
* Each order has at most one final state.

A finished behavior stays until the stick has its robot, because it holds the robot meanwhile.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ui_console.model.orders import GivenOrder, Order, OrderState

BY_STICK = "by the stick"
BY_NEWER = "for another order"


@dataclass(frozen=True, slots=True)
class Begin:
    """Start the behavior of this order."""

    number: int


@dataclass(frozen=True, slots=True)
class Yield:
    """Hand the robot of this order from the stick over to the waiting behavior."""

    number: int
    order: Order


@dataclass(frozen=True, slots=True)
class Rest:
    """Tell the behavior of this order to bring its robot to rest, and to keep it."""

    number: int


@dataclass(frozen=True, slots=True)
class EndBehavior:
    """End the behavior of this order."""

    number: int


@dataclass(frozen=True, slots=True)
class Take:
    """Claim this robot for the stick, which has a higher priority than the order."""

    robot: str


@dataclass(frozen=True, slots=True)
class ShowOrder:
    """Show the present state of the order."""

    given: GivenOrder


Instruction = Begin | Yield | Rest | EndBehavior | Take | ShowOrder


class OrderBook:
    """The orders of one console; each method handles an event and returns the actions, in order."""

    def __init__(self) -> None:
        self._given: dict[int, GivenOrder] = {}  # orders whose behavior runs or is being started
        self._removing: set[int] = set()
        self._is_away = False
        self.last = 0
        """Number of the newest order; 0: none was given."""

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its newest order whose behavior still has it; a finished one keeps it for the operator."""
        return {
            given.order.robot: given for number, given in sorted(self._given.items()) if number not in self._removing
        }

    @property
    def numbers(self) -> frozenset[int]:
        """The orders whose behavior runs, is being started or is being removed."""
        return frozenset(self._given)

    def get(self, number: int) -> GivenOrder | None:
        """Return the order with this number; None: its behavior is gone, or there was no such order."""
        return self._given.get(number)

    def goes_on(self, robot: str) -> bool:
        """Return whether this robot has an unfinished order."""
        given = self.orders.get(robot)
        return given is not None and not given.state.is_final

    def give(self, order: Order) -> list[Instruction]:
        """Handle a new order: the robot's present order ends, but keeps the robot until the new one has it."""
        self.last += 1
        before = self._finish_all(order.robot, BY_NEWER)
        self._given[self.last] = GivenOrder(order, self.last)
        return [*before, ShowOrder(self._given[self.last]), Begin(self.last)]

    def touched(self, robot: str) -> list[Instruction]:
        """Handle the operator's wish to have this robot at the stick."""
        if robot not in self.orders:
            return []
        return [*self._finish_all(robot, BY_STICK), Take(robot)]

    def taken(self, robot: str) -> list[Instruction]:
        """Handle the grant to the stick: ended orders release the robot."""
        return [self._remove(given.number) for given in self._of(robot) if given.state.is_final]

    def given_back(self, robot: str, why: str) -> list[Instruction]:
        """Handle the release of the robot by the operator."""
        return [*self._finish_all(robot, why, rests=False), *(self._remove(given.number) for given in self._of(robot))]

    def away(self, why: str) -> list[Instruction]:
        """Handle the absence of the operator: until ``back``, a robot returns to the mission when its order is over."""
        self._is_away = True
        over = [robot for robot, given in self.orders.items() if given.state.is_final]
        return [step for robot in over for step in self.given_back(robot, why)]

    def back(self) -> None:
        """Handle the return of the operator."""
        self._is_away = False

    def based_on(self, number: int, by: str) -> list[Instruction]:
        """Record the source of the positions for this order."""
        given = self._given.get(number)
        return [] if given is None or given.state.is_final else self._become(replace(given, by=by))

    def queued(self, number: int) -> list[Instruction]:
        """Handle that the behavior of this order is next in line for its robot: stick and earlier orders yield."""
        given = self._given.get(number)
        if given is None or given.state is not OrderState.STARTING:
            return []
        return [
            *self._become(replace(given, state=OrderState.WAITING)),
            Yield(number, given.order),
            *self._older(given),
        ]

    def runs(self, number: int) -> list[Instruction]:
        """Handle that the behavior has the robot: earlier orders release it."""
        given = self._given.get(number)
        if given is None or number in self._removing:
            return []
        older = self._older(given)
        is_new = not given.state.is_final and given.state is not OrderState.RUNNING
        return [*older, *(self._become(replace(given, state=OrderState.RUNNING, why="")) if is_new else [])]

    def waits(self, number: int, why: str) -> list[Instruction]:
        """Handle that the behavior has no robot, or may not move it; a start that waits for the stick continues."""
        given = self._given.get(number)
        if given is None or given.state.is_final or given.state is OrderState.STARTING:
            return []
        now = replace(given, state=OrderState.WAITING, why=why)
        return self._become(now) if now != given else []

    def finished(self, number: int, *, is_done: bool, why: str, in_front: bool) -> list[Instruction]:
        """Handle that the behavior has finished; it keeps the robot until it is removed.

        Args:
            is_done: False: it failed.
            why: Its report, for people.
            in_front: True: the stick is at this robot, and takes it again unless the order forbids that.
        """
        given = self._given.get(number)
        if given is None or given.state.is_final:
            return []
        final = self._become(replace(given, state=OrderState.DONE if is_done else OrderState.FAILED, why=why))
        return [*final, *self._after(given, in_front=in_front)]

    def lost(self, number: int, why: str, *, in_front: bool) -> list[Instruction]:
        """Handle that the behavior could not be started, or is gone."""
        given = self._given.get(number)
        if given is None:
            return []
        was_final = given.state.is_final or number in self._removing
        final = [] if was_final else self._become(replace(given, state=OrderState.FAILED, why=why))
        goes = [] if number in self._removing else [self._remove(number)]  # the behavior may only be unreachable
        takes = in_front and not was_final and not self._then_releases(given)
        return [*final, *([Take(given.order.robot)] if takes else []), *goes]

    def removed(self, number: int) -> None:
        """Handle that the behavior is gone for good."""
        self._removing.discard(number)
        self._given.pop(number, None)

    def _of(self, robot: str) -> list[GivenOrder]:
        return [one for number, one in self._given.items() if one.order.robot == robot and number not in self._removing]

    def _older(self, given: GivenOrder) -> list[EndBehavior]:
        return [self._remove(one.number) for one in self._of(given.order.robot) if one.number < given.number]

    def _after(self, given: GivenOrder, *, in_front: bool) -> list[Instruction]:
        if self._then_releases(given):
            return [self._remove(given.number)]
        return [Take(given.order.robot)] if in_front else []

    def _then_releases(self, given: GivenOrder) -> bool:
        return self._is_away or given.order.then_release

    def _finish_all(self, robot: str, why: str, *, rests: bool = True) -> list[Instruction]:
        told: list[Instruction] = []
        for given in self._of(robot):
            if not given.state.is_final:
                told += [
                    *([Rest(given.number)] if rests else []),
                    *self._become(replace(given, state=OrderState.ENDED, why=why)),
                ]
        return told

    def _remove(self, number: int) -> EndBehavior:
        self._removing.add(number)
        return EndBehavior(number)

    def _become(self, given: GivenOrder) -> list[Instruction]:
        self._given[given.number] = given
        return [ShowOrder(given)]
