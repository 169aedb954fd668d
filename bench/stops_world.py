"""The mission of the table of stops: its robots' poses, the operators who drive them meanwhile and lift their stops."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from typing import Any

import msgspec
from stops_places import OTHERS, ROBOT

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.command_line.where import Where
from backbone.errors import LinkError
from backbone.keys import Conversation
from backbone.launcher.mission_connection import connected
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope
from resource_pool.arc_client import OtherStop, StopState, ask_stop, lift_stop, stop_robot, watch_stops
from resource_pool.localization import AskPose, Pose
from ui_console.model.driving import KEYS_LET_GO_S, STICK_LASTS_S, DriveWish
from ui_console.session.joining import Joining, join
from ui_console.session.teleoperation import Teleoperation

ROBOTS = (*OTHERS, ROBOT)
TURN = DriveWish(3.0, -3.0)  # on the spot, so that no wall is in the way
LOOK_EVERY_S = 0.015  # chosen: twice in each frame of the world
KEPT_S = 8.0  # chosen: longer than a cell is watched
STILL_RAD, STILL_M = 0.004, 0.001  # chosen: a thirtieth of a robot's turn or drive in a tenth of a second
TURNING_WITHIN_S = 0.25  # chosen: at this speed a robot turns fifteen times ``STILL_RAD`` meanwhile
SAY_EVERY_S = 0.08  # chosen: three times within ``STICK_LASTS_S``
LATE_S = 0.3  # chosen: an order that waited on a link arrives long before
WITHIN_S = 15.0
HIGH, LOW = 200, 50  # priorities of operators who take the robot, and of those who only ask for it; consoles have 100


class NotSeen(Exception):
    """A state that a cell needs did not come in time."""


async def until(holds: Callable[[], bool | Awaitable[bool]], what: str, within_s: float = WITHIN_S) -> None:
    """Return when the condition holds.

    Raises:
        NotSeen: It did not hold in time.
    """
    try:
        async with asyncio.timeout(within_s):
            while True:
                answer = holds()
                if answer is True or (not isinstance(answer, bool) and await answer):
                    return
                await asyncio.sleep(LOOK_EVERY_S)
    except TimeoutError:
        raise NotSeen(f"not within {within_s:g} s: {what}") from None


class Poses:
    """The robots' poses in the last seconds, asked of the world."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._seen: dict[str, deque[Pose]] = {name: deque(maxlen=int(KEPT_S / LOOK_EVERY_S)) for name in ROBOTS}

    async def watch(self) -> None:
        """Ask repeatedly until cancelled."""
        while True:
            with suppress(LinkError):
                await asyncio.gather(*map(self._look, ROBOTS))
            await asyncio.sleep(LOOK_EVERY_S)

    def turns(self, robot: str) -> bool:
        """Return whether the robot turned or moved in the last moment."""
        seen = self._seen[robot]
        return bool(seen) and self.moved_last_s(robot, seen[-1].at_s - TURNING_WITHIN_S) is not None

    def moved_last_s(self, robot: str, since_s: float) -> float | None:
        """Return the last time since then at which it was not yet at its present pose; None: it stood."""
        seen = self._seen[robot]
        return max((pose.at_s for pose in seen if pose.at_s >= since_s and _differs(pose, seen[-1])), default=None)

    def moved_by(self, robot: str, last_s: float) -> tuple[float, float]:
        """Return its turn and its way in the last moment: radians and meters."""
        now = self._seen[robot][-1]
        then = next(pose for pose in self._seen[robot] if pose.at_s >= now.at_s - last_s)
        turned_rad = math.remainder(now.heading_rad - then.heading_rad, math.tau)
        return round(turned_rad, 4), round(math.hypot(now.x_m - then.x_m, now.y_m - then.y_m), 4)

    async def _look(self, robot: str) -> None:
        self._seen[robot].append(await self._bus.ask("resource_pool/world", AskPose(robot), Pose, within_s=1.0))


def _differs(one: Pose, other: Pose) -> bool:
    turned_rad = abs(math.remainder(one.heading_rad - other.heading_rad, math.tau))
    return turned_rad > STILL_RAD or math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) > STILL_M


class Operator:
    """Another operator, in this process, on a bus of their own; keeps the ARC, so that taking is quick."""

    def __init__(self, name: str, robot: str, priority: int, joining: Joining) -> None:
        parameters = {"robot": robot, "kind": "drive", "priority": priority, "minimum_runtime_s": 0.1}
        self.robot, self._joining = robot, joining
        self.launch = msgspec.structs.replace(joining.launch, name=name, parameters=parameters)
        self.console: Teleoperation
        self._turning: asyncio.Task[None] | None = None

    @asynccontextmanager
    async def present(self) -> AsyncIterator[Operator]:
        """Be present until the block ends."""
        bus, clock = await self._joining.open_bus(self.launch), self._joining.clock
        self.console = Teleoperation(
            self.launch, bus, clock, show=lambda _event: None, takes=False, watches=False, keeps_arc=True
        )
        living = asyncio.create_task(self.console.run(), name=self.launch.name)
        try:
            await until(lambda: self.console.is_ready, f"{self.launch.name} is ready")
            yield self
        finally:
            await self.rest()
            self.console.end("the table is full")
            await living

    async def turn(self) -> None:
        """Take the robot and turn it until ``rest``; an earlier hold is released first."""
        await self.rest()
        self.console.take()
        await until(lambda: self.console.is_held, f"{self.launch.name} holds {self.robot}")
        self._turning = asyncio.create_task(self._turn(), name=f"{self.launch.name} turns")

    async def rest(self) -> None:
        """Release the stick."""
        if self._turning is not None:
            self._turning.cancel()
            await asyncio.wait({self._turning})
            self._turning = None
            self.console.stop()

    async def leave(self) -> None:
        """Release the robot."""
        await self.rest()
        await self.console.give_back()

    async def ask_for_it(self) -> None:
        """Ask the operator who holds the robot for it."""
        self.console.take()
        await asyncio.sleep(KEYS_LET_GO_S)
        self.console.begin_ask_consent("the table of stops")

    async def _turn(self) -> None:
        while True:
            self.console.hold(TURN, STICK_LASTS_S)
            await asyncio.sleep(SAY_EVERY_S)


class World:
    """The mission's state and operators, for the cells."""

    def __init__(self, bus: Bus, clock: MissionClock, operators: list[Operator]) -> None:
        self.bus, self.clock, self.poses = bus, clock, Poses(bus)
        self._drivers, self.holder, self.asker = operators[: len(OTHERS)], *operators[len(OTHERS) :]
        self._own = {operator.launch.address for operator in operators}
        self._stops: dict[str, StopState] = {}
        self._acted_s = 0.0
        watch_stops(bus, self._heard)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard_act)

    def _heard_act(self, envelope: Envelope[Any]) -> None:
        if envelope.body.action in (OperatorAction.STOP_ROBOT, OperatorAction.STOP_ALL):
            self._acted_s = envelope.body.at_s

    def acted_s(self, since_s: float) -> float | None:
        """Return when a console began to carry out a stop given since then; None: no console reported one."""
        return self._acted_s if self._acted_s >= since_s else None

    def _heard(self, state: StopState) -> None:
        self._stops[state.rc] = state

    def stopped_s(self, robot: str, since_s: float) -> float | None:
        """Return when an order to stop given since then reached the robot's RC; None: no order did.

        An order to a robot that is stopped already is not a new stop, but counts in ``orders``.
        """
        state = self._stops.get(robot)
        return state.at_s if state is not None and state.is_stopped and state.at_s >= since_s else None

    def orders(self, robot: str) -> int:
        """Return the number of orders to stop that the robot got."""
        state = self._stops.get(robot)
        return 0 if state is None else state.number

    async def stop(self, robot: str, by: str = "olga") -> None:
        """Stop the robot as an operator does who is at no console."""
        await stop_robot(self.bus, robot, "a person stands there", by)

    async def all_may_move(self) -> None:
        """Lift every stop, also one that was given while a link was cut and arrives only now."""
        while any([await self._lift(robot) for robot in ROBOTS]):  # noqa: ASYNC110  a late order gives no event
            await asyncio.sleep(LATE_S)

    async def _lift(self, robot: str) -> bool:
        """Lift the stop of a robot; return whether it may have been given without a link."""
        state = await ask_stop(self.bus, robot)
        was_stopped = state.is_stopped
        while state.is_stopped:
            with suppress(OtherStop):  # a late order came in between
                state = await lift_stop(self.bus, state, "olga")
                continue
            state = await ask_stop(self.bus, robot)
        return was_stopped

    async def console_asks(self) -> bool:
        """Return whether the tried console is present and requests a robot."""
        schedule = await self._schedule()
        return any(self._is_tried(request.owner) for request in schedule.requests)

    async def console_holds(self) -> bool:
        """Return whether the tried console holds the robot."""
        schedule = await self._schedule()
        owners = {request.arc: request.owner for request in schedule.requests}
        holders = [owners.get(one.arc, "") for rc in schedule.rcs if rc.rc == ROBOT for one in rc.holders]
        return any(map(self._is_tried, holders))

    def _is_tried(self, owner: str) -> bool:
        return owner.startswith("ui_console/") and owner not in self._own

    async def _schedule(self) -> Schedule:
        return await self.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=2.0)

    async def others_turn(self, robots: Iterable[str]) -> None:
        """Make these other robots turn."""
        await asyncio.gather(*(self._turn(driver) for driver in self._drivers if driver.robot in robots))

    async def _turn(self, driver: Operator) -> None:
        if not self.poses.turns(driver.robot):
            await driver.turn()
            await until(lambda: self.poses.turns(driver.robot), f"{driver.robot} turns")


@asynccontextmanager
async def world_of(mission: str) -> AsyncIterator[World]:
    """Watch the mission's robots, and run other operators, until the block ends."""
    joining = await join(Where(mission, None, None))
    wishes = [*((f"driver-{robot}", robot, HIGH) for robot in OTHERS), ("holder", ROBOT, HIGH), ("asker", ROBOT, LOW)]
    async with connected(mission, None, address(Subsystem.UI_CONSOLE, "table")) as (bus, clock):
        operators = [Operator(*wish, joining) for wish in wishes]
        world = World(bus, clock, operators)
        watching = asyncio.create_task(world.poses.watch(), name="poses")
        try:
            async with operators[0].present(), operators[1].present(), operators[2].present(), operators[3].present():
                yield world
        finally:
            watching.cancel()
            await asyncio.wait({watching})
