"""Patrol: drive through way points, round after round.

A Scout does not know its position. A localizer must track it: a camera above the room, as in laboratories, the
simulated world, or dead reckoning. With dead reckoning the rounds drift until the robot sees a landmark.

In mission.xml: an ARC of kind ``drive`` (or more), and the localizer's name; a simulated world is its own localizer.
"""

from __future__ import annotations

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.ranges import Duration
from mission_control.behavior import BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.driver import DECIDE_EVERY_S, Driver
from mission_control.behaviors.motion import DrivingSpeed, NamedLocalizer, Reach, Times, read_places
from mission_control.behaviors.patrol_route import PatrolRoute, Visit
from mission_control.messages import BehaviorStatus, WaypointReached


class PatrolParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Patrol``.

    Attributes:
        waypoints: Way points in order: ``x,y`` in meters, separated by blanks, as in ``1,1 3.5,1 3.5,4``.
        localizer: Component that tracks robots: its name if it is in the resource pool, else its address.
        rounds: Number of rounds until success; 0: endless.
        speed_m_s: Speed on straight ways.
        reached_within_m: Distance from a way point that counts as reached.
        rest_s: Time at each way point; only time of grants counts.
    """

    waypoints: str
    localizer: NamedLocalizer
    rounds: Times = 0
    speed_m_s: DrivingSpeed = 0.2
    reached_within_m: Reach = 0.08
    rest_s: Duration = 0.0

    def __post_init__(self) -> None:
        read_places(self.waypoints)


class PatrolMemory(msgspec.Struct, frozen=True):
    """Progress of a patrol."""

    reached: int


class Patrol(Driver[PatrolParameters]):
    """Publishes ``WaypointReached`` once for each way point, in order, despite any number of suspensions."""

    parameters_type = PatrolParameters
    hands_over = frozenset({"route", "_published"})
    memory_type = PatrolMemory

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.route = self._plan()
        """The state of the route."""
        self._published = 0

    async def drive_on(self, robot: str) -> None:
        """Decide ten times a second from the robot's position; see ``Driver.drive_on``."""
        self._say(robot)
        while not (self.route.is_over and await self.halted(self.parameters)):
            position = await self.locate(self.parameters.localizer, robot)
            motion = self.route.decide(position, self.clock.now_s())
            self._publish(robot)
            await self.move(motion)
            await self.clock.sleep_s(DECIDE_EVERY_S)
        self.finish(BehaviorStatus.SUCCESS, self._found())

    def interrupted(self) -> None:
        """Continue from the robot's present position; see ``Driver.interrupted``."""
        self.route.interrupt()

    async def suspended(self, reason: str, by: str) -> None:
        """Keep the state; after the suspension continue from the robot's position at that time."""
        self.report(f"suspended: {suspended_because(reason, by)}; {self._seen()}")

    def memory(self) -> PatrolMemory:
        """Return the number of published way points; see ``BehaviorHooks.memory``."""
        return PatrolMemory(self._published)

    def recall(self, memory: PatrolMemory) -> None:
        """Continue to the way point after these."""
        self.route.reached = self._published = memory.reached

    def parameters_changed(self) -> None:
        """Begin a new patrol with the new parameters; arrivals of the old one stay published."""
        self.route, self._published = self._plan(), 0

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, and the numbers of reached way points and of maneuvers that freed the robot."""
        return {**super().statistics(), "waypoints_reached": self.route.reached, "shaken_free": self.route.freed}

    def _plan(self) -> PatrolRoute:
        given = self.parameters
        return PatrolRoute(
            read_places(given.waypoints),
            rounds=given.rounds,
            speed_m_s=given.speed_m_s,
            reached_within_m=given.reached_within_m,
            rest_s=given.rest_s,
        )

    def _publish(self, robot: str) -> None:
        """Publish each way point that was reached since the last call."""
        if self.route.reached == self._published:
            return
        for visit in self.route.visits_since(self._published):
            event = WaypointReached(visit.at_s, robot, visit.number, visit.waypoint)
            self.bus.publish(self.address, Conversation.EVENTS, event)
            self.story.note(robot, f"is at way point {visit.waypoint}")
            self._published = visit.number
            self.tell_parent(self._found(visit))
            self._say(robot)

    def _found(self, last: Visit | None = None) -> dict[str, float]:
        since = {} if last is None else {"last_waypoint": last.waypoint, "last_at_s": last.at_s}
        return {"waypoints_reached": self.route.reached, **since}

    def _seen(self) -> str:
        return f"{self.route.reached} way points reached, next is {self.route.next_waypoint}"

    def _say(self, robot: str) -> None:
        self.report(f"patrols with {robot}: {self._seen()}")
