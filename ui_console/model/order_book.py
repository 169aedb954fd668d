"""Order book: what follows when an order is given, goes on, ends, or its operator touches the stick. Pure.

Laws:

* A robot has at most one order that goes on; a newer one, a touch of the stick and the return of the robot end it.
* A behavior is removed only when the stick has the robot, when the behavior of a newer order has it or waits for it
  next, or when nobody wants it any more; so a robot is never free between stick and order.
* Every behavior that was begun is removed, and removed once.
* Each order has at most one final state.

Why a behavior that has finished stays until the stick has its robot: it holds the robot meanwhile.
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
    """Give the robot of this order from the stick to its behavior, which waits for it."""

    number: int
    order: Order


@dataclass(frozen=True, slots=True)
class Rest:
    """Let the behavior of this order bring its robot to rest, and keep it."""

    number: int


@dataclass(frozen=True, slots=True)
class Remove:
    """End the behavior of this order."""

    number: int


@dataclass(frozen=True, slots=True)
class Take:
    """Ask for this robot by the stick, which is higher than its order."""

    robot: str


@dataclass(frozen=True, slots=True)
class Changed:
    """Show the order as it is now."""

    given: GivenOrder


Instruction = Begin | Yield | Rest | Remove | Take | Changed


class OrderBook:
    """The orders of one console; each method takes an event in and returns what to do now, in this order."""

    def __init__(self) -> None:
        self._given: dict[int, GivenOrder] = {}  # those whose behavior is there, or is being started
        self._removing: set[int] = set()
        self.last = 0
        """Number of the newest order; 0: none was given."""

    # ------------------------------------------------------------------ what is
    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its newest order whose behavior still has it; a final one keeps it for the operator."""
        return {
            given.order.robot: given for number, given in sorted(self._given.items()) if number not in self._removing
        }

    @property
    def numbers(self) -> frozenset[int]:
        """The orders whose behavior is there, or is being started, also those being removed."""
        return frozenset(self._given)

    def get(self, number: int) -> GivenOrder | None:
        """Return the order of this number; None: its behavior is gone, or it never was given."""
        return self._given.get(number)

    def goes_on(self, robot: str) -> bool:
        """Return whether an order of this robot goes on."""
        given = self.orders.get(robot)
        return given is not None and not given.state.is_final

    # ------------------------------------------------------------------ events of the operator
    def give(self, order: Order) -> list[Instruction]:
        """Take in a new order: the present one of its robot ends, and keeps the robot until the new one has it."""
        self.last += 1
        before = self._finish_all(order.robot, BY_NEWER)
        self._given[self.last] = GivenOrder(order, self.last)
        return [*before, Changed(self._given[self.last]), Begin(self.last)]

    def touched(self, robot: str) -> list[Instruction]:
        """Take in that the operator wants this robot by the stick."""
        if robot not in self.orders:
            return []
        return [*self._finish_all(robot, BY_STICK), Take(robot)]

    def taken(self, robot: str) -> list[Instruction]:
        """Take in that the stick has the robot: what has ended lets it go."""
        return [self._remove(given.number) for given in self._of(robot) if given.state.is_final]

    def given_back(self, robot: str, why: str) -> list[Instruction]:
        """Take in that the operator gives the robot back."""
        return [*self._finish_all(robot, why, rests=False), *(self._remove(given.number) for given in self._of(robot))]

    def away(self, why: str) -> list[Instruction]:
        """Take in that the operator is away: a robot goes back to the mission as soon as its order is over."""
        for number, given in self._given.items():
            self._given[number] = replace(given, order=replace(given.order, then_release=True))
        over = [robot for robot, given in self.orders.items() if given.state.is_final]
        return [step for robot in over for step in self.given_back(robot, why)]

    # ------------------------------------------------------------------ events of the behaviors
    def based_on(self, number: int, by: str) -> list[Instruction]:
        """Take in what the positions for this order come from."""
        given = self._given.get(number)
        return [] if given is None or given.state.is_final else self._become(replace(given, by=by))

    def queued(self, number: int) -> list[Instruction]:
        """Take in that the behavior of this order waits for its robot next: stick and earlier orders yield."""
        given = self._given.get(number)
        if given is None or given.state is not OrderState.STARTING:
            return []
        return [
            *self._become(replace(given, state=OrderState.WAITING)),
            Yield(number, given.order),
            *self._older(given),
        ]

    def runs(self, number: int) -> list[Instruction]:
        """Take in that the behavior has the robot: earlier ones let it go."""
        given = self._given.get(number)
        if given is None or number in self._removing:
            return []
        older = self._older(given)
        is_new = not given.state.is_final and given.state is not OrderState.RUNNING
        return [*older, *(self._become(replace(given, state=OrderState.RUNNING, why="")) if is_new else [])]

    def waits(self, number: int, why: str) -> list[Instruction]:
        """Take in that the behavior has no robot, or may not move it; a start that waits for the stick goes on."""
        given = self._given.get(number)
        if given is None or given.state.is_final or given.state is OrderState.STARTING:
            return []
        now = replace(given, state=OrderState.WAITING, why=why)
        return self._become(now) if now != given else []

    def finished(self, number: int, *, is_done: bool, why: str, in_front: bool) -> list[Instruction]:
        """Take in that the behavior has finished; it keeps the robot until it is removed.

        Args:
            is_done: False: it failed.
            why: What it told.
            in_front: The operator's stick is at this robot: it takes the robot again, unless the order says otherwise.
        """
        given = self._given.get(number)
        if given is None or given.state.is_final:
            return []
        final = self._become(replace(given, state=OrderState.DONE if is_done else OrderState.FAILED, why=why))
        return [*final, *self._after(given, in_front=in_front)]

    def lost(self, number: int, why: str, *, in_front: bool) -> list[Instruction]:
        """Take in that the behavior could not be started, or is gone."""
        given = self._given.get(number)
        if given is None:
            return []
        was_final = given.state.is_final or number in self._removing
        final = [] if was_final else self._become(replace(given, state=OrderState.FAILED, why=why))
        goes = [] if number in self._removing else [self._remove(number)]  # it may be gone only from sight
        takes = in_front and not was_final and not given.order.then_release
        return [*final, *([Take(given.order.robot)] if takes else []), *goes]

    def removed(self, number: int) -> None:
        """Take in that the behavior is gone for good."""
        self._removing.discard(number)
        self._given.pop(number, None)

    # ------------------------------------------------------------------ within
    def _of(self, robot: str) -> list[GivenOrder]:
        return [one for number, one in self._given.items() if one.order.robot == robot and number not in self._removing]

    def _older(self, given: GivenOrder) -> list[Remove]:
        return [self._remove(one.number) for one in self._of(given.order.robot) if one.number < given.number]

    def _after(self, given: GivenOrder, *, in_front: bool) -> list[Instruction]:
        if given.order.then_release:
            return [self._remove(given.number)]
        return [Take(given.order.robot)] if in_front else []

    def _finish_all(self, robot: str, why: str, *, rests: bool = True) -> list[Instruction]:
        told: list[Instruction] = []
        for given in self._of(robot):
            if not given.state.is_final:
                told += [
                    *([Rest(given.number)] if rests else []),
                    *self._become(replace(given, state=OrderState.ENDED, why=why)),
                ]
        return told

    def _remove(self, number: int) -> Remove:
        self._removing.add(number)
        return Remove(number)

    def _become(self, given: GivenOrder) -> list[Instruction]:
        self._given[given.number] = given
        return [Changed(given)]
