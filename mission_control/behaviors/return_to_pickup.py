"""Return to pickup: bring a robot back to the marked place at which a person picks it up.

The robot first drives, tracked by a localizer, to a place from which the mark is in sight; then it servoes to the mark.
It also returns after a person has left it at the other end of the room.

In mission.xml: an ARC of kind ``capture`` at the camera's full rate, with a period as short as a picture's; the
localizer's name; a place before the mark as ``near``.

Source: IROS 2001, "Visual Servoing": Scouts find their way back to where they can be picked up.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from mission_control.behaviors.driver import DECIDE_EVERY_S
from mission_control.behaviors.motion import Attempts, DrivingSpeed, NamedLocalizer, read_places
from mission_control.behaviors.pickup_route import PickupRoute, PickupStage
from mission_control.behaviors.servo_to_target import MOST_TURNS, Servo, ServoParameters, TargetNotFound
from mission_control.vision.servo_law import Stage as Approach
from mission_control.vision.skeleton_tracking import TrackingPhase
from resource_pool.arc_client import Frame


class PickupParameters(ServoParameters, frozen=True, kw_only=True):
    """Parameters of ``ReturnToPickup``, besides those of ``ServoToTarget``.

    Attributes:
        near: The first goal, ``x,y`` in meters: best 1 to 2 m straight before the mark.
        localizer: Component that tracks robots: its name if it is in the resource pool, else its address.
        speed_m_s: Speed on the way to it.
        search_turns: Number of turns of one search for the mark.
        attempts: Number of unsuccessful searches after which the behavior fails.
    """

    near: str
    localizer: NamedLocalizer
    speed_m_s: DrivingSpeed = 0.2
    search_turns: Annotated[float, Meta(gt=0, le=MOST_TURNS)] = 1.25
    attempts: Attempts = 3

    def __post_init__(self) -> None:
        if len(read_places(self.near)) != 1:
            raise ValueError(f"near is {self.near!r}: write one place, x,y in meters")


class PickupMemory(Struct, frozen=True):
    """Progress of a return: the number of unsuccessful searches."""

    in_vain: int


class ReturnToPickup(Servo[PickupParameters]):
    """Succeeds at its place before the mark, from any start; fails if it does not find the mark."""

    parameters_type = PickupParameters
    hands_over = Servo.hands_over | {"route"}
    memory_type = PickupMemory

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.route = self._way()
        """The state of the route."""

    def see(self, frame: Frame) -> None:
        """Search and track the mark, while the robot navigates by sight, or looks whether it still can."""
        if self.route.stage in (PickupStage.BY_SIGHT, PickupStage.LOOK):
            super().see(frame)

    async def drive_on(self, robot: str) -> None:
        """Drive to the place ``near``, then by sight; see ``Driver.drive_on``."""
        while not (self.route.stage is PickupStage.FAILED and await self.halted(self.parameters)):
            if self.route.stage is PickupStage.BY_SIGHT:
                if await self._go_by_sight(robot):
                    return
            elif self.route.stage is PickupStage.LOOK:
                await self._look(robot)
            else:
                await self._travel(robot)
        self.give_up(TargetNotFound(f"{robot} looked for the mark {self.route.in_vain} times"))

    def interrupted(self) -> None:
        """Keep the state of the search; see ``Driver.interrupted``."""
        self.route.interrupt()
        super().interrupted()

    def memory(self) -> PickupMemory:
        """Return the unsuccessful searches; see ``BehaviorHooks.memory``."""
        return PickupMemory(self.route.in_vain)

    def recall(self, memory: PickupMemory) -> None:
        """Count on."""
        self.route.in_vain = memory.in_vain

    def parameters_changed(self) -> None:
        """Begin again with the new parameters; by sight if the mark is in sight."""
        before, self.route = self.route, self._way()
        if before.stage in (PickupStage.BY_SIGHT, PickupStage.LOOK):
            self.route.stage = PickupStage.LOOK  # ``drive_on`` may be waiting for a picture
        super().parameters_changed()

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, and the unsuccessful searches."""
        return {**super().statistics(), "searched_in_vain": self.route.in_vain}

    def _way(self) -> PickupRoute:
        given = self.parameters
        [near] = read_places(given.near)
        return PickupRoute(near, speed_m_s=given.speed_m_s, attempts=given.attempts)

    async def _travel(self, robot: str) -> None:
        position = await self.locate(self.parameters.localizer, robot)
        await self.move(self.route.decide(position, self.clock.now_s()))
        self.report(f"{robot} {self.route.stage}")
        if self.route.stage is PickupStage.BY_SIGHT:
            self.look_anew()
        else:
            await self.clock.sleep_s(DECIDE_EVERY_S)

    async def _look(self, robot: str) -> None:
        """Continue by sight if a picture shows the mark before the search would turn the robot; it stands meanwhile."""
        self.report(f"{robot} {self.route.stage}")
        step = await self.next_step()
        if step.track.phase is TrackingPhase.TRACKING:
            self.route.looked(is_seen=True)
        elif step.command.turn_rad_s:
            self.route.looked(is_seen=False)

    async def _go_by_sight(self, robot: str) -> bool:
        """Carry out the decision of the next picture; return True at the mark."""
        step = await self.next_step()
        if self.has_searched(self.parameters.search_turns):
            self.route.not_found()
            self.keep_memory()
            self.search_anew()
            return False
        given = self.parameters
        await self.follow(robot, step)
        if step.stage is not Approach.ARRIVED or not await self.halted(given):
            return False
        self.arrived()
        return True
