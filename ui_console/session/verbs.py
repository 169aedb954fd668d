"""Actions of a console's keys: they change its model, and call methods of its component."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from backbone.command_line.watching import mission_classes
from backbone.component.messages import LifeState
from backbone.debug_views import ViewPicture, Views, ViewValue
from backbone.errors import LinkError, Refusal
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from backbone.moments import Now
from backbone.wire import Message
from resource_pool.arc_client import Frame
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import GiveWish, MoveWish, move_by_stick
from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import installed_views
from ui_console.model.orders import GivenOrder, Order
from ui_console.session.key_looking import keep_hearing, keep_listing
from ui_console.session.looking import all_views, keep_looking
from ui_console.session.observer import AnyObserver
from ui_console.session.teleoperation import Teleoperation

log = logging.getLogger(__name__)


class Session:
    """The only interface between a screen and its console; before the component is ready, keys do nothing.

    Args:
        model: Content of the screen.
    """

    def __init__(self, model: ConsoleModel) -> None:
        self.model = model
        self._console: AnyObserver | None = None
        self._frame: Frame | None = None
        self._picture: NDArray[np.uint8] | None = None
        self._classes: Mapping[str, type[Message]] | None = None

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, grey levels, shape (height, width), or None."""
        frame, self._frame = self._frame, None
        if frame is not None:
            self._picture = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        return self._picture

    def now_s(self) -> float:
        """Return the mission time."""
        return self._console.clock.now_s() if self._console is not None else 0.0

    def steer(self, forward: float, right: float, speed: float, lasts_s: float | None = None) -> None:
        """Record that a stick, pad or drive key is held; do nothing if the ARC has no body that moves."""
        if (reach := self.model.reach) is not None:
            self.hold(move_by_stick(forward, right, speed, reach), lasts_s)

    def hold(self, move: MoveWish, lasts_s: float | None = None) -> None:
        """Record that a drive key is down."""
        self._with_robot(lambda console: console.hold(move, lasts_s))

    def stop(self) -> None:
        """Stop the wheels now."""
        self._with_robot(Teleoperation.stop)

    def give(self, wish: GiveWish) -> None:
        """Send one command."""
        self._with_robot(lambda console: console.give(wish))

    def jump(self) -> None:
        """Jump once, if the ARC has such a command."""
        self.give(GiveWish("jump"))

    def take(self) -> None:
        """Ask for the robot."""
        self._with_robot(Teleoperation.take)

    def release(self) -> None:
        """Give the robot back."""
        self._with_robot(Teleoperation.begin_release)

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its order; see ``Teleoperation.orders``."""
        return self._console.orders if isinstance(self._console, Teleoperation) else {}

    def robots_held(self) -> list[str]:
        """Return the robots that the operator has by stick or order, sorted."""
        return sorted({*self.orders, *([self.model.mine] if self.model.mine else [])})

    def order(self, order: Order) -> None:
        """Give a robot an order."""
        self._with_robot(lambda console: console.order(order))

    def order_group(self, orders: Sequence[Order]) -> None:
        """Give robots orders at the same time."""
        self._with_robot(lambda console: console.order_group(orders))

    def halt(self) -> None:
        """Stop the wheels now; an order of the robot at the stick ends."""
        self.stop()
        self._with_robot(Teleoperation.interrupt)

    def ask_consent(self, why: str = "") -> None:
        """Ask the operator who holds the robot for it."""
        self._with_robot(lambda console: console.begin_ask_consent(why))

    def decide(self, is_given: bool, number: int) -> None:
        """Answer the operator who asks for the robot, or to lift a stop: the question of this number, and no other."""
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.decide(is_given, number=number)

    def require_let_go(self) -> None:
        """Ignore held controls until they were released and pressed again."""
        self._with_robot(Teleoperation.require_let_go)

    def dismiss_lost(self) -> None:
        """Record that the operator knows of a lost robot."""
        self.model.dismiss_lost()

    async def switch(self, robot: str) -> None:
        """Give the robot back and ask for this one."""
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            await self._console.switch(robot)

    async def next_robot(self) -> None:
        """Turn to the next robot in the list, from the last one to the first; the present robot's order continues."""
        robots, here = self.model.team.robots.names(), self.model.robot
        if robots:
            await self.switch(robots[(robots.index(here) + 1) % len(robots)] if here in robots else robots[0])

    def begin_next_robot(self) -> None:
        """Turn to the next robot, without waiting for it."""
        self._with_robot(lambda console: console.start_task(self.next_robot(), "next robot"))

    def touch(self) -> None:
        """Record that the operator is there."""
        self._with_robot(Teleoperation.touch)

    def leave(self) -> None:
        """Record that the operator turned away."""
        self._with_robot(Teleoperation.leave)

    def closed(self) -> None:
        """End the component, which releases the robot, because the screen has ended."""
        if self._console is not None:
            self._console.end("the screen was closed")

    def acknowledge(self, key: str) -> None:
        """Acknowledge one alarm, or all."""
        seen = self.model.acknowledge(key)
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.acknowledged(seen, key)

    async def stop_robot(self, robot: str) -> bool:
        """Stop a robot; return whether the stop is confirmed."""
        return await self._ready_console().stop_robot(robot)

    async def stop_all(self) -> list[str]:
        """Stop all robots; return the robots whose stop is not confirmed."""
        return await self._ready_console().stop_all()

    async def lift_stop(self, robot: str, number: int) -> bool:
        """Lift the stop of this number, as shown on the screen, if its authors agree."""
        return await self._ready_console().lift_stop(robot, number)

    async def why(self, name: str) -> list[str]:
        """Return the reasons for its state."""
        return await self._ready_console().why(name)

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        """Return the question as sent, and the matching events of the mission's log.

        Raises:
            Refusal: The question is not valid, or the launcher did not answer.
        """
        console = self._ready_console()
        asked = question.asked(Now(self.now_s(), datetime.now(), console.clock.rate))
        return asked, await console.feed.search_log(asked)

    async def ask_parameters(self, name: str) -> bool:
        """Ask a component for its parameters; return whether it answered."""
        return await self._ready_console().feed.ask_parameters(name)

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        """Set a parameter; return whether the component applied it."""
        return await self._ready_console().set_parameter(name, parameter, value)

    async def debug_views(self) -> dict[str, Views]:
        """Return address and debug views of each behavior that has shown some.

        Raises:
            LinkError: The nameserver did not answer.
        """
        return await all_views(self._ready_console().bus)

    async def keep_looking(
        self,
        behavior: str,
        view: str,
        show: Callable[[ViewPicture | ViewValue], None],
        trouble: Callable[[Refusal | LinkError], None],
    ) -> None:
        """Watch a debug view until cancelled; see ``looking.keep_looking``."""
        console = self._ready_console()
        await keep_looking(console.bus, console.clock, behavior, view, show, trouble=trouble)

    async def keep_listing(self, show: Callable[[list[KeyRow]], None]) -> None:
        """Call ``show`` each second with the keys that have messages, until cancelled."""
        console = self._ready_console()
        await keep_listing(console.bus, console.clock, show)

    async def keep_hearing(self, row: KeyRow, begin: Callable[[KeyView], None]) -> None:
        """Call ``begin`` with a view of a key, then show the key's messages in it, until cancelled."""
        console = self._ready_console()
        classes = await self._known_classes()
        view = KeyView(row.schema, await asyncio.to_thread(installed_views))
        begin(view)
        await keep_hearing(console.bus, console.clock, classes, row, view)

    async def _known_classes(self) -> Mapping[str, type[Message]]:
        if self._classes is None:
            self._classes = await mission_classes(self._ready_console().bus, log.info)
        return self._classes

    def _with_robot(self, act: Callable[[Teleoperation], object]) -> None:
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            act(self._console)

    def _ready_console(self) -> AnyObserver:
        if self._console is None:
            raise RuntimeError("the session does not run")
        return self._console
