"""A whole mission in one process, with an operator who orders."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import msgspec

from backbone.bus.clock import run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType
from backbone.keys import Conversation
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from backbone.mission_log.operators import OperatorActed
from backbone.naming import Subsystem
from backbone.placer.messages import Start
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process
from ui_console.model.driving import MoveWish
from ui_console.model.events import ConsoleEvent, OrderChanged
from ui_console.model.orders import Order, OrderKind, OrderState
from ui_console.session.teleoperation import Teleoperation

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
CONSOLE, BEN = "console-7", "console-8"
FORWARD = MoveWish(0.1, 0.0)
STARTING, RUNNING, WAITING = OrderState.STARTING, OrderState.RUNNING, OrderState.WAITING
DONE, FAILED, ENDED = OrderState.DONE, OrderState.FAILED, OrderState.ENDED


def patrols(*, is_real: bool = False) -> MissionDescription:
    """Return a mission with a patrol of scout1; unless it is real, another behavior is go_to, and none is follow."""
    mission = read_mission(EXAMPLES / "behaviors.xml")
    if is_real:
        behaviors = tuple(one for one in mission.behaviors if one.name == "patrol-scout1")
        return msgspec.structs.replace(mission, behaviors=behaviors)
    ahead = ComponentType("go_to", "ordered_behaviors:Ahead", Subsystem.MISSION_CONTROL)
    types = (*(one for one in mission.types if one.name not in ("go_to", "follow")), ahead)
    behaviors = tuple(one for one in mission.behaviors if one.name == "patrol-scout1")
    return msgspec.structs.replace(mission, behaviors=behaviors, types=types)


class Operator:
    """A person at a console that keeps its ARC, and what the screens show."""

    def __init__(self, running: RunningMission, made: list[Teleoperation], shown: list[ConsoleEvent]) -> None:
        self.running, self._made, self.shown = running, made, shown
        self.others: list[ConsoleEvent] = []
        """What the screens of Ben show."""
        self.acts: list[OperatorActed] = []
        running.bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda heard: self.acts.append(heard.body))

    @property
    def console(self) -> Teleoperation:
        return self._made[0]

    @property
    def now_s(self) -> float:
        return self.running.clock.now_s()

    @property
    def ben(self) -> Teleoperation:
        return self._made[1]

    async def until(self, condition: Callable[[], Any], within_s: float = 20.0) -> None:
        until_s = self.now_s + within_s
        while not condition():
            assert self.now_s < until_s, (f"not within {within_s} s", self.told())
            await self.running.clock.sleep_s(0.02)

    async def holds(self, robot: str = "scout1") -> None:
        await self.until(lambda: self.console.is_held and self.grantee(robot).startswith(CONSOLE))
        await self.running.clock.sleep_s(1.0)

    async def ordered(self, x_s: float = 0.0, robot: str = "scout1", y_m: float = 0.0, **options: Any) -> None:
        """Order to drive ahead for so long, and return when the robot does."""
        self.console.order(Order(OrderKind.GO_TO, robot, x_s, y_m, **options))
        await self.until(lambda: self.state(robot) is RUNNING)

    async def state_becomes(self, state: OrderState, robot: str = "scout1") -> None:
        await self.until(lambda: self.states(robot)[-1] is state)

    async def ben_waits(self, priority: int = 50) -> None:
        """Let Ben ask for scout1 at another console, by default of lower priority."""
        given = {"robot": "scout1", "kind": "drive", "priority": priority, "minimum_runtime_s": 1.0}
        await self.running.start(Start("console", BEN, given))
        await self.until(lambda: any(line["ev"] == "request" and BEN in str(line) for line in self.running.trace))

    def state(self, robot: str = "scout1") -> OrderState | None:
        given = self.console.orders.get(robot)
        return given.state if given is not None else None

    def states(self, robot: str = "scout1") -> list[OrderState]:
        """The states shown, without repetitions."""
        found = [
            event.given.state
            for event in self.shown
            if isinstance(event, OrderChanged) and event.given.order.robot == robot
        ]
        return [state for at, state in enumerate(found) if at == 0 or found[at - 1] is not state]

    def told(self) -> list[str]:
        """What happened, for the message of a failure."""
        orders = [f"{event.at_s:.2f} {event.given.line}" for event in self.shown if isinstance(event, OrderChanged)]
        return [*orders, *(str(line) for line in self.running.trace if line["ev"] in ("request", "grant", "release"))]

    def grants(self, robot: str = "scout1", since_s: float = 0.0) -> list[str]:
        """The ARCs to which the robot was granted, in order."""
        rows = [line for line in self.running.trace if line["ev"] == "grant" and line["t"] >= since_s]
        return [str(line["arc"]) for line in rows if robot in str(line)]

    def grantee(self, robot: str = "scout1") -> str:
        return (self.grants(robot) or [""])[-1]

    def behaviors(self) -> list[str]:
        return [one for one in (f"{CONSOLE}-order-{number}" for number in range(1, 9)) if self.running.hosts.knows(one)]


async def until_over(running: RunningMission, name: str) -> None:
    while running.hosts.knows(name):
        await running.clock.sleep_s(0.05)


Scene = Callable[[Operator], Awaitable[None]]


def play(scene: Scene, *, is_real: bool = False, other: str = "ben", **parameters: Any) -> None:
    async def main() -> None:
        made: list[Teleoperation] = []
        shown: list[ConsoleEvent] = []

        def console(launch: Launch, bus: Bus, clock: Clock) -> Teleoperation:
            is_anna = launch.name == CONSOLE
            show, user = (shown.append, "anna") if is_anna else (operator.others.append, other)
            made.append(Teleoperation(launch, bus, clock, show=show, keeps_arc=True, user=user))
            return made[-1]

        async with mission_in_one_process(patrols(is_real=is_real), consoles={"console": console}) as running:
            operator = Operator(running, made, shown)
            given = {"robot": "scout1", "priority": 100, "minimum_runtime_s": 1.0, **parameters}
            await running.start(Start("console", CONSOLE, given))
            await scene(operator)

    run_virtual(main())
