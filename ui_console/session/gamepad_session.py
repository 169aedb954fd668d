"""A console without a screen: a gamepad drives one robot, and changes are printed as lines of text.

For an operator who wears the console (000, Fig. 3), or for a small machine beside a video monitor.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import assert_never

from backbone.bus.interface import Clock
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode
from backbone.waiting import first_to_end
from ui_console.model.console import ConsoleModel
from ui_console.model.events import ConsoleEvent
from ui_console.model.orders import Order, OrderKind
from ui_console.model.state_lines import news, state_lines
from ui_console.model.team import TeamModel
from ui_console.session.gamepad import (
    FoundGamepad,
    PadWish,
    Stick,
    buttons_help,
    find_gamepad,
    play_gamepad,
    wait_gamepad,
)
from ui_console.session.joining import end_on_signals, join, line_writer
from ui_console.session.teleoperation import Teleoperation
from ui_console.session.verbs import Session

LIFT_REMEDY = "When the robot may move, lift the stop at a console with a screen."
SPEED = 1.0  # chosen: a share of the robot's largest speed; the stick gives a share of that
LOOK_EVERY_S = 0.25  # chosen: a change is printed soon


class GamepadSession(Session):
    """Passes a component's events to the model, and the gamepad's buttons to the component.

    Args:
        write: Called with each line for the operator.
        find: Finds the gamepad again after it disappeared.
    """

    def __init__(
        self,
        model: ConsoleModel,
        write: Callable[[str], None],
        find: Callable[[], FoundGamepad] = find_gamepad,
    ) -> None:
        super().__init__(model)
        self._write, self._find = write, find

    def show(self, event: ConsoleEvent) -> None:
        """Apply an event to the model; its lines are printed at the next update."""
        self.model.apply(event)

    async def run(self, console: Teleoperation, gamepad: FoundGamepad) -> None:
        """Drive until the component ends.

        Raises:
            BaseException: The bug or refusal that ended the component.
        """
        self._console = console
        for line in buttons_help():
            self._write(line)
        both = first_to_end(self._play(gamepad, console.clock), self._print(console.clock))
        beside = asyncio.create_task(both, name="gamepad and lines")
        beside.add_done_callback(lambda _beside: console.end("the gamepad cannot be read"))
        try:
            await console.run()
        finally:
            beside.cancel()
            await asyncio.wait({beside})
            if not beside.cancelled():
                beside.result()

    async def _print(self, clock: Clock) -> None:
        """Print changes."""
        printed: list[str] = []
        while True:
            lines = list(state_lines(self.model.view(clock.now_s())))
            for line in news(printed, lines):
                self._write(line)
            printed = lines
            await clock.sleep_s(LOOK_EVERY_S)

    async def _play(self, gamepad: FoundGamepad, clock: Clock) -> None:
        """Drive by the gamepad; if it disappears, release the robot."""
        while True:
            device, ranges = gamepad
            await play_gamepad(
                device,
                Stick(ranges),
                hold=lambda forward, right, lasts_s: self.steer(forward, right, SPEED, lasts_s),
                stop=self.stop,
                wish=self._begin_wish,
            )
            self.release()
            self._write("the gamepad is gone: you give the robot back")
            gamepad = await wait_gamepad(clock, self._find)
            self._write("the gamepad is there again: start takes the robot")

    def _begin_wish(self, wish: PadWish) -> None:
        self.touch()
        match wish:
            case PadWish.JUMP:
                self.jump()
            case PadWish.TAKE:
                self.take()
            case PadWish.RELEASE:
                self.release()
            case PadWish.STOP_ROBOT | PadWish.STOP_ALL:
                self._begin_stop(is_for_all=wish is PadWish.STOP_ALL)
            case PadWish.NEXT_ROBOT:
                self.begin_next_robot()
            case PadWish.WATCH:
                self.order(Order(OrderKind.WATCH, ""))
            case PadWish.RETURN:
                self.order(Order(OrderKind.RETURN, ""))
            case _:
                assert_never(wish)

    def _begin_stop(self, *, is_for_all: bool) -> None:
        console, robot = self._console, self.model.robot
        if not isinstance(console, Teleoperation) or not console.is_ready:
            self._write("this console is not connected: no robot was told to stop")
        elif is_for_all:
            self.stop()
            console.start_task(self._stop_all(), "stop")
        elif robot:
            self.stop()
            console.start_task(self._stop_robot(robot), "stop")
        else:
            self._write("which robot? take one first, or stop all")

    async def _stop_robot(self, robot: str) -> None:
        if not await self.stop_robot(robot):
            self._write(f"NOT SURE that {robot} stopped")

    async def _stop_all(self) -> None:
        if unsure := await self.stop_all():
            self._write(f"NOT SURE that {', '.join(unsure)} stopped")


async def drive_by_gamepad(where: Where, wished: dict[str, object], user: str) -> int:
    """Drive a robot by the gamepad of this machine; return the command's exit code.

    Args:
        wished: Parameters of ``Teleoperation``.
        user: The driver, for the record.

    Raises:
        NoGamepad: There is no gamepad.
        Refusal: The claim was refused, and no other claim followed.
    """
    gamepad = find_gamepad()
    joining = await join(where, wished)
    launch = joining.launch
    model = ConsoleModel(launch.name, user, TeamModel(launch.mission, LIFT_REMEDY), sees=False)
    async with line_writer() as write:
        session = GamepadSession(model, lambda line: write(line.encode()))
        console = Teleoperation(
            launch, await joining.open_bus(), joining.clock, show=session.show, keeps_arc=True, user=user
        )
        interrupted = end_on_signals(console)
        await session.run(console, gamepad)
    if console.refusal is not None and console.given_back is None:
        raise console.refusal
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE
