"""Actions of a console for orders, in addition to those for its stick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from backbone.mission_log.operators import OperatorAction
from ui_console.model.orders import GivenOrder, Order
from ui_console.session.claim import TeleoperationParameters
from ui_console.session.observer import Observer
from ui_console.session.order_keeper import OrderKeeper


class OrderVerbs(Observer[TeleoperationParameters]):
    """A console that gives orders; the derived class has the stick, and creates ``_orders``."""

    _orders: OrderKeeper

    @property
    def _robot(self) -> str:
        """The robot at the stick; empty: any, or none."""
        raise NotImplementedError

    def touch(self) -> None:
        """Record that the operator is there."""
        raise NotImplementedError

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its order; a final order keeps its robot for the operator until the operator takes it."""
        return self._orders.orders

    def order(self, order: Order) -> int:
        """Give a robot an order; return the order's number; see ``order_group``."""
        return self.order_group([order])[0]

    def order_group(self, orders: Sequence[Order]) -> list[int]:
        """Give robots orders at the same time; ``OrderChanged`` events show the state of each.

        An order claims its robot with this console's priority, whether the stick holds the robot or not. A held robot
        stays with the stick until the order's behavior can take it. An earlier order of the robot ends. A held control
        moves nothing before it is released. A new press, ``take`` and ``interrupt`` end the order of the robot at the
        stick.

        Args:
            orders: One order for each robot; an order without a robot is for the robot at the stick.

        Returns:
            The number of each order, from 1, unique at this console.
        """
        self.touch()
        self.require_let_go()
        return self._orders.give(orders)

    def interrupt(self) -> None:
        """End the unfinished order of the robot at the stick, if any; the robot comes to rest."""
        if self._orders.goes_on(self._robot):
            self._orders.touched(self._robot)

    async def end_order(self, robot: str) -> None:
        """Return this robot to the mission, if it has an order; wait until its behavior has released it."""
        if await self._orders.give_back(robot, f"{self.user} gave it back"):
            self.acted(OperatorAction.RELEASE, robot, "its order was ended")
