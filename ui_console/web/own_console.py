"""The console of one person at a browser: created at the first claim or order, kept until the person leaves."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence

from backbone.errors import LinkError, Refusal
from backbone.waiting import first_of
from ui_console.model.driving import HaltWish
from ui_console.model.orders import Order
from ui_console.session.teleoperation import Teleoperation

Opening = Callable[[str, Sequence[Order]], Awaitable[Teleoperation]]
"""Returns a console that claims the robot, or gives the orders, as soon as it runs."""


class OwnConsole:
    """Opens the console, runs it, and passes actions to it while it is ready.

    Args:
        opening: Creates the console.
        failed: Called with the reason why there is no console.
        on_bug: Called with a bug of the console.
    """

    def __init__(
        self,
        opening: Opening,
        failed: Callable[[Refusal | LinkError], None],
        on_bug: Callable[[BaseException], None],
    ) -> None:
        self._opening, self._failed, self._on_bug = opening, failed, on_bug
        self._console: Teleoperation | None = None
        self._life: asyncio.Task[None] | None = None
        self._claiming = asyncio.Lock()

    def act(self, verb: Callable[[Teleoperation], None]) -> None:
        """Call a method of the console, if there is one and it is ready."""
        if (console := self._ready) is not None:
            verb(console)

    async def take(self, robot: str, kind: str) -> None:
        """Claim a robot; it replaces the present one."""
        async with self._claiming:
            if not self._lives:
                await self._open(robot)
            elif (console := self._ready) is not None:
                await console.switch(robot, kind)

    async def order(self, ordered: Callable[[], Sequence[Order]]) -> bool:
        """Give orders; return False if the console is ending.

        Args:
            ordered: Returns the orders when the console is ready for them.
        """
        async with self._claiming:
            orders = ordered()
            if not self._lives:
                await self._open(orders[0].robot if len(orders) == 1 else "", orders)
                return True
            if (console := self._ready) is not None:
                console.order_group(orders)
            return console is not None

    async def end_orders(self, robots: Sequence[str], at_stick: str) -> None:
        """End the orders of these robots; the stick keeps the robot at the stick."""
        if (console := self._ready) is None:
            return
        if at_stick in robots:
            console.interrupt()
        await asyncio.gather(*(console.end_order(robot) for robot in robots if robot != at_stick))

    async def give_back(self, reason: str) -> None:
        """Give the robot back."""
        async with self._claiming:
            if (console := self._ready) is not None:
                await console.give_back(reason)

    async def leave(self, reason: str) -> None:
        """Stop the wheels, give the robot back, and end the console."""
        console, life = self._console, self._life
        if console is not None and life is not None:
            self.act(Teleoperation.stop)
            if console.is_ready and console.is_held:
                await console.do(HaltWish())
            console.end(reason)
            await asyncio.wait({life})

    @property
    def _ready(self) -> Teleoperation | None:
        return self._console if self._console is not None and self._console.is_ready else None

    @property
    def _lives(self) -> bool:
        return self._life is not None and not self._life.done()

    async def _open(self, robot: str, orders: Sequence[Order] = ()) -> None:
        """Open a console; return when it is ready for later actions, or over."""
        try:
            self._console = console = await self._opening(robot, orders)
        except LinkError as error:
            self._failed(error)
            return
        self._life = asyncio.create_task(self._live(console), name=f"life of {console.address}")
        self._life.add_done_callback(self._ended)
        await first_of(asyncio.shield(self._life), console.has_begun.wait())

    async def _live(self, console: Teleoperation) -> None:
        try:
            await console.run()
        except (Refusal, LinkError) as error:
            self._failed(error)

    def _ended(self, life: asyncio.Task[None]) -> None:
        if not life.cancelled() and (bug := life.exception()) is not None:
            self._on_bug(bug)
