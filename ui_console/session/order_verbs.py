"""What an operator does with orders: the verbs of a console beside those of its stick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from backbone.mission_log.operators import OperatorAction
from ui_console.model.orders import GivenOrder, Order
from ui_console.session.claim import TeleoperationParameters
from ui_console.session.observer import Observer
from ui_console.session.order_keeper import OrderKeeper


class OrderVerbs(Observer[TeleoperationParameters]):
    """A console that gives orders; the derived class has the stick, and makes ``_orders``."""

    _orders: OrderKeeper

    @property
    def _robot(self) -> str:
        """The robot that the stick is at; empty: any, or none."""
        raise NotImplementedError

    def touch(self) -> None:
        """Note that the operator is there."""
        raise NotImplementedError

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its order; one that is done, failed or ended keeps its robot for the operator until it is taken."""
        return self._orders.orders

    def order(self, order: Order) -> int:
        """Tell a robot to do something by itself; return the order's number; see ``order_group``."""
        return self.order_group([order])[0]

    def order_group(self, orders: Sequence[Order]) -> list[int]:
        """Tell robots to do something by themselves, all at once; ``OrderChanged`` shows what becomes of each.

        An order claims its robot with this console's priority, whether the stick holds it or not; a robot in hand stays
        with the stick until the order's behavior can have it. An earlier order of the robot ends. A held control moves
        nothing before it was let go; a new press, ``take`` and ``interrupt`` end the order of the robot at the stick.

        Args:
            orders: One for each robot; without a robot it is for the one at the stick.

        Returns:
            The number of each order, from 1, unique at this console.
        """
        self.touch()
        self.require_let_go()
        return self._orders.give(orders)

    def interrupt(self) -> None:
        """Take the robot at the stick from its order, if one goes on; it comes to rest."""
        if self._orders.goes_on(self._robot):
            self._orders.touched(self._robot)

    async def end_order(self, robot: str) -> None:
        """Give this robot back to the mission, if it has an order; return when its behavior has let it go."""
        if await self._orders.give_back(robot, f"{self.user} gave it back"):
            self.acted(OperatorAction.RELEASE, robot, "its order was ended")
