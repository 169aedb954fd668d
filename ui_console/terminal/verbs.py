"""What the keys of a console do: they change its model, and call the verbs of its component."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from backbone.component.messages import LifeState
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from backbone.moments import Now
from resource_pool.arc_client import Frame
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import Drive
from ui_console.session.observer import Observer
from ui_console.session.teleoperation import Teleoperation


class Session:
    """The one thing that a screen knows of the rest; before its component is ready, keys do nothing.

    Args:
        model: What the screen shows.
    """

    def __init__(self, model: ConsoleModel) -> None:
        self.model = model
        self._console: Observer[Any] | None = None
        self._frame: Frame | None = None
        self._picture: NDArray[np.uint8] | None = None

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, grey levels, shape (height, width), or None."""
        frame, self._frame = self._frame, None
        if frame is not None:
            self._picture = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        return self._picture

    def now_s(self) -> float:
        """Return the mission time."""
        return self._console.clock.now_s() if self._console is not None else 0.0

    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down."""
        self._with_robot(lambda console: console.hold(drive, lasts_s))

    def stop(self) -> None:
        """Stop the wheels now."""
        self._with_robot(Teleoperation.stop)

    def jump(self) -> None:
        """Jump once."""
        self._with_robot(Teleoperation.jump)

    def take(self) -> None:
        """Ask for the robot."""
        self._with_robot(Teleoperation.take)

    def release(self) -> None:
        """Give the robot back."""
        self._with_robot(Teleoperation.begin_release)

    def ask_consent(self, why: str = "") -> None:
        """Ask the operator who holds the robot for it."""
        self._with_robot(lambda console: console.begin_ask_consent(why))

    def decide(self, is_given: bool) -> None:
        """Answer the operator who asks for the robot, or to lift a stop."""
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.decide(is_given)

    def require_let_go(self) -> None:
        """What is held moves nothing until it was let go and pressed anew."""
        self._with_robot(Teleoperation.require_let_go)

    def dismiss_lost(self) -> None:
        """The operator knows that a robot was lost."""
        self.model.dismiss_lost()

    async def switch(self, robot: str) -> None:
        """Give the robot back and ask for this one."""
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            await self._console.switch(robot)

    def touch(self) -> None:
        """Somebody is there."""
        self._with_robot(Teleoperation.touch)

    def leave(self) -> None:
        """Nobody is."""
        self._with_robot(Teleoperation.leave)

    def closed(self) -> None:
        """The screen has gone; the component gives the robot back, and ends."""
        if self._console is not None:
            self._console.end("the screen was closed")

    def acknowledge(self, key: str) -> None:
        """One alarm was seen, or all."""
        seen = self.model.acknowledge(key)
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.acknowledged(seen, key)

    async def stop_robot(self, robot: str) -> bool:
        """Emergency stop; return whether it is certain."""
        return await self._ready_console().stop_robot(robot)

    async def stop_all(self) -> list[str]:
        """Emergency stop of all; return the robots of which it is not certain."""
        return await self._ready_console().stop_all()

    async def lift_stop(self, robot: str, number: int) -> bool:
        """Let the robot move again if those who stopped it let it; the number is that of the stop that was seen."""
        return await self._ready_console().lift_stop(robot, number)

    async def why(self, name: str) -> list[str]:
        """Return why it is as it is."""
        return await self._ready_console().why(name)

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        """Return what the mission's log has of this, and what was asked for that.

        Raises:
            Refusal: The question has no answer, or the launcher gives none.
        """
        console = self._ready_console()
        asked = question.asked(Now(self.now_s(), datetime.now(), console.clock.rate))
        return asked, await console.feed.search_log(asked)

    async def ask_parameters(self, name: str) -> bool:
        """Have its parameters told."""
        return await self._ready_console().feed.ask_parameters(name)

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        """Change one."""
        return await self._ready_console().set_parameter(name, parameter, value)

    def _with_robot(self, act: Callable[[Teleoperation], None]) -> None:
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            act(self._console)

    def _ready_console(self) -> Observer[Any]:
        if self._console is None:
            raise RuntimeError("the session does not run")
        return self._console
