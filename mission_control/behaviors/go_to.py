"""Go to: drive a robot straight to a place, guided by a localizer.

The robot does not avoid obstacles; choose places that it can reach straight. Any kind of moving robot is possible. The
accuracy depends on the localizer; the report of success contains the spread.

In mission.xml: an ARC of kind ``drive`` (or more), and the localizer's name.
"""

from __future__ import annotations

from typing import TypeVar

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.errors import Refusal
from backbone.ranges import Duration
from mission_control.behavior import BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.driver import DECIDE_EVERY_S, Driver, Lost
from mission_control.behaviors.motion import AlongDepth, AlongWidth, DrivingSpeed, FloorPoint, NamedLocalizer, Reach
from mission_control.behaviors.way import Way
from mission_control.messages import BehaviorStatus


class NotThere(Refusal):
    """The robot does not get to its place."""

    code = "go_to.not_there"
    remedy = "See that the straight way is free, give it more time, or go there in several legs."


class OutsideRoom(Refusal):
    """The place is outside the room."""

    code = "go_to.outside"
    remedy = "Choose a place inside the room."


class WayParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of behaviors that go to a place.

    Attributes:
        localizer: Component that tracks robots: its name if it is in the resource pool, else its address.
        speed_m_s: Speed on the straight way.
        reached_within_m: Distance from the place that counts as reached.
        within_s: Time after which the behavior fails; only time of grants counts; 0: never.
    """

    localizer: NamedLocalizer
    speed_m_s: DrivingSpeed = 0.2
    reached_within_m: Reach = 0.08
    within_s: Duration = 0.0


class GoToParameters(WayParameters, frozen=True, kw_only=True):
    """Parameters of ``GoTo``.

    Attributes:
        x_m: The place, along the room's width.
        y_m: The place, along the room's depth.
    """

    x_m: AlongWidth
    y_m: AlongDepth


W = TypeVar("W", bound=WayParameters)


class Goer(Driver[W]):
    """Base class of behaviors that go to a place: derive and override ``place``."""

    hands_over = frozenset({"way"})
    never = Driver.never | {Lost.code, OutsideRoom.code}

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.way: Way | None = None
        """The state of the way; None until the place is known."""

    async def place(self, robot: str) -> FloorPoint:
        """Return the goal. When: at the first grant, and after a change of parameters; raises as ``locate``."""
        raise NotImplementedError

    async def drive_on(self, robot: str) -> None:
        """Decide ten times a second from the robot's position; see ``Driver.drive_on``."""
        while True:
            way = self.way or await self._set_out(robot)
            position = await self.locate(self.parameters.localizer, robot)
            motion = way.decide(position, self.clock.now_s())
            if way.is_over:
                await self.held.halt()
            if way is not self.way:  # the parameters changed meanwhile
                continue
            if way.is_over:
                break
            self.report(f"{robot} goes to {_spoken(way.place)}")
            await self.move(motion)
            await self.clock.sleep_s(DECIDE_EVERY_S)
        if way.failure:
            self.give_up(NotThere(f"{robot} is not at {_spoken(way.place)}: {way.failure}"))
        else:
            at = {"x_m": position.x_m, "y_m": position.y_m, "spread_m": self.spread_m}
            self.finish(BehaviorStatus.SUCCESS, at)

    def interrupted(self) -> None:
        """Continue from the robot's present position; see ``Driver.interrupted``."""
        if self.way is not None:
            self.way.interrupt()

    async def suspended(self, reason: str, by: str) -> None:
        """Keep the place; after the suspension continue from the robot's position at that time."""
        if self.way is not None:
            self.report(f"suspended on the way to {_spoken(self.way.place)}: {suspended_because(reason, by)}")

    def parameters_changed(self) -> None:
        """Begin a new way with the new parameters."""
        self.way = None

    async def _set_out(self, robot: str) -> Way:
        given, place = self.parameters, await self.place(robot)
        while given is not self.parameters:  # they changed meanwhile
            given, place = self.parameters, await self.place(robot)
        self.way = Way(
            place,
            speed_m_s=given.speed_m_s,
            reached_within_m=given.reached_within_m,
            within_s=given.within_s,
        )
        return self.way


class GoTo(Goer[GoToParameters]):
    """Succeeds at its place, from any start; fails if the robot gets no nearer, or is too slow."""

    parameters_type = GoToParameters

    async def place(self, robot: str) -> FloorPoint:  # noqa: ARG002  the same for all robots
        """Return the place of the parameters; see ``Goer``.

        Raises:
            OutsideRoom: The localizer has a plan of the floor, and the place is outside of it.
        """
        place = FloorPoint(self.parameters.x_m, self.parameters.y_m)
        room = await self.room(self.parameters.localizer)
        if room is not None and room.width_m > 0 and room.depth_m > 0:
            is_inside = 0 <= place.x_m <= room.width_m and 0 <= place.y_m <= room.depth_m
            if not is_inside:
                detail = f"{_spoken(place)} is outside the room of {room.width_m:g} by {room.depth_m:g} m"
                raise OutsideRoom(detail)
        return place


def _spoken(place: FloorPoint) -> str:
    return f"({place.x_m:.2f}, {place.y_m:.2f}) m"
