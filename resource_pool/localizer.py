"""Localizer: estimates robots' poses by dead reckoning and landmarks, without ceiling camera and without simulator.

It begins with the start places in the mission file, and adds the motions that RCs publish and the odometry of the
robots. If a behavior sees a landmark, the localizer corrects the robot's pose. The rules are in ``dead_reckoning``;
this file has the loop. The localizer saves its beliefs in a file. A restarted localizer continues from the file; for
each robot it raises the uncertainty by the motions that the missed commands may have caused. Without the file, the pose
of every robot that was commanded before is unknown.

In mission.xml: a resource of type ``localizer``, named by behaviors as ``localizer``. No ARC needs it.
"""

from __future__ import annotations

import asyncio
import base64
import logging
import math
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec

from backbone.atomic_file import replace_file
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRc, Connect, Disconnect, RcState
from backbone.wire import Accepts, Envelope, Message
from resource_pool.begin_places import read_begins
from resource_pool.commands import Halt, Jump
from resource_pool.dead_reckoning import Belief, DeadReckoning, FloorPose
from resource_pool.floor_plans import board, plan_of, sighted_from
from resource_pool.localization import AskFloorPlan, AskHome, AskPose, FloorPlan, LandmarkSighting, Pose, UnknownPlace
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied, Readings
from resource_pool.rc_readings import watch_readings
from resource_pool.resource_controller import RcParameters, ResourceController
from scout_model.description import WorldDescription

log = logging.getLogger(__name__)

EVERY_S = 0.2  # chosen: five poses a second are a smooth track on a map
PLACED_M = 0.02  # chosen: a person puts a robot on its mark by hand
PLACED_RAD = math.radians(2.0)  # chosen: same
SIGHTED_RAD = math.radians(3.0)  # chosen: twice what servoing at 1 m was measured to err
UNSEEN_M_S = 0.2  # chosen: standard deviation of a speed of up to 0.35 m/s forward or backward
UNSEEN_RAD_S = 0.9  # chosen: same, of up to 1.5 rad/s
LOST_M = 100.0  # chosen: larger than a room: the place is unknown
LATE_S = 0.5  # chosen: an older message says nothing about the present
FIRST_REPLY_S = 0.5  # chosen: a running RC answers in milliseconds
WAY, TURNED = "way_m", "turned_rad"
"""Fields of a robot's reports with its odometry: way and turn since power-on."""

Size = Annotated[float, msgspec.Meta(ge=0, le=1000)]


class LocalizerParameters(RcParameters, frozen=True, kw_only=True):
    """Parameters of a localizer.

    Attributes:
        starts: Start places of robots, ``name:x,y,heading`` in meters and degrees, separated by blanks; robots left out
            begin at their place in the simulated world.
        landmarks: Landmark boards in addition to those of the world, in the same form; each faces along its heading.
        width_m: Extent of the room along x, meters; 0: that of the world.
        depth_m: Extent of the room along y, meters; 0: that of the world.
        floor_plan: PNG or JPEG picture of the whole floor, for maps. The mission file names a file, relative to itself;
            the localizer gets the file's content in base64.
        room: The world of the mission file.
    """

    starts: str = ""
    landmarks: str = ""
    width_m: Size = 0.0
    depth_m: Size = 0.0
    floor_plan: str = ""
    room: WorldDescription | None = None

    def __post_init__(self) -> None:
        for places in (self.starts, self.landmarks):
            read_begins(places)

    def begins(self) -> dict[str, FloorPose]:
        """Return robot → its start place."""
        robots = [] if self.room is None else self.room.robots
        return {one.name: FloorPose(one.x_m, one.y_m, one.heading_rad) for one in robots} | read_begins(self.starts)

    def plan(self) -> FloorPlan:
        """Return the plan of the floor.

        Raises:
            ValueError: ``floor_plan`` is not valid base64.
        """
        of_world = FloorPlan(0.0, 0.0) if self.room is None else plan_of(self.room)
        own = [board(name, at) for name, at in read_begins(self.landmarks).items()]
        return msgspec.structs.replace(
            of_world,
            width_m=self.width_m or of_world.width_m,
            depth_m=self.depth_m or of_world.depth_m,
            shapes=[*of_world.shapes, *own],
            image=base64.b64decode(self.floor_plan, validate=True),
        )


class Known(msgspec.Struct, frozen=True):
    """Saved knowledge about a robot.

    Attributes:
        number: Number of commands that its RC had applied.
        is_moving: True if the robot was moving.
    """

    belief: Belief
    number: int
    is_moving: bool


class Memory(msgspec.Struct, frozen=True):
    """The state that a localizer saves for its next process.

    Attributes:
        at_s: Mission time.
        robots: Robot → what is known of it.
    """

    at_s: float
    robots: dict[str, Known]


class Localizer(ResourceController[LocalizerParameters]):
    """Answers ``AskPose``, ``AskHome`` and ``AskFloorPlan``, and publishes each pose that changes."""

    parameters_type = LocalizerParameters
    given_elsewhere = ResourceController.given_elsewhere | {"room", "world"}
    accepts: ClassVar[Accepts | None] = Connect | Disconnect | AskRc | AskPose | AskHome | AskFloorPlan

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._plan = self.parameters.plan()
        self._homes = self.parameters.begins()
        self._file = Path(launch.run_directory) / "localizers" / self.name if launch.run_directory else None
        self._before = _read(self._file)
        self._robots: dict[str, DeadReckoning] = {}
        self._numbers = dict.fromkeys(self._homes, 0)
        self._published: dict[str, Pose] = {}
        self._stir = asyncio.Event()
        self._heard = self._sightings = self._poses = 0

    async def connect(self) -> None:
        """Subscribe to robots' RCs and to behaviors that see landmarks."""
        await super().connect()
        for name in self._homes:
            self.bus.subscribe(address(Subsystem.RESOURCE_POOL, name), Conversation.MOTIONS, Applied, self._applied)
        watch_readings(self.bus, self._counted)
        sights = f"{Subsystem.MISSION_CONTROL}/*"
        self.bus.subscribe(sights, Conversation.SIGHTINGS, LandmarkSighting, self._sighted)
        await asyncio.gather(*map(self._begin, self._homes))

    async def serve(self) -> None:
        """Publish each pose that changes, and save the beliefs."""
        self.start_task(self._publish_when_changed(), "poses")
        self._stir.set()
        await super().serve()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Also answer ``AskPose``, ``AskHome`` and ``AskFloorPlan``."""
        match asked.body:
            case AskPose(body=body):
                return self._pose(body)
            case AskHome(body=body):
                return self._home(body)
            case AskFloorPlan():
                return self._plan
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Also count messages received and poses published."""
        own = {"motions_heard": self._heard, "sightings_taken": self._sightings, "poses_published": self._poses}
        return {**super().statistics(), **own, "robots_known": len(self._robots)}

    def _applied(self, envelope: Envelope[Applied]) -> None:
        told, robot = envelope.body, self._robots.get(envelope.body.rc)
        if robot is None or envelope.source != address(Subsystem.RESOURCE_POOL, told.rc):
            return
        self._heard, self._numbers[told.rc] = self._heard + 1, told.number
        at_s = self._plausible_s(told.at_s)
        if told.command == Halt.word():
            robot.moves(0.0, 0.0, at_s)
        elif told.command == Jump.word():
            robot.jumps(at_s)
        elif "forward_m_s" in told.values and "turn_rad_s" in told.values:
            robot.moves(told.values["forward_m_s"], told.values["turn_rad_s"], at_s)
        self._stir.set()

    def _counted(self, told: Readings) -> None:
        robot = self._robots.get(told.rc)
        if robot is not None and WAY in told.values and TURNED in told.values:
            robot.counts(told.values[WAY], told.values[TURNED], self._plausible_s(told.at_s))
            self._stir.set()

    def _sighted(self, envelope: Envelope[LandmarkSighting]) -> None:
        sighting, robot = envelope.body, self._robots.get(envelope.body.robot)
        if robot is None:
            return
        pose = sighted_from(self._plan, sighting, robot.believe(self.clock.now_s()))
        if pose is not None:
            robot.sighted(pose, sighting.spread_m, SIGHTED_RAD, min(sighting.at_s, self.clock.now_s()))
            self._sightings += 1
            self._stir.set()

    def _plausible_s(self, at_s: float) -> float:
        """Return the time in a message, or the present time if the message cannot have been sent at that time."""
        now_s = self.clock.now_s()
        return at_s if now_s - LATE_S * max(1.0, self.clock.rate) <= at_s <= now_s else now_s

    def _pose(self, body: str) -> Pose:
        robot = self._robots.get(body)
        if robot is not None:
            return _pose_of(body, robot.believe(self.clock.now_s()))
        for shape in self._plan.shapes:
            if shape.name == body:
                at = FloorPose(shape.x_m, shape.y_m, shape.heading_rad)
                return _pose_of(body, Belief(at, self.clock.now_s(), 0.0, 0.0))
        raise self._unknown(body)

    def _home(self, robot: str) -> Pose:
        if robot not in self._homes:
            raise self._unknown(robot)
        return _pose_of(robot, Belief(self._homes[robot], self.clock.now_s(), PLACED_M, PLACED_RAD))

    def _unknown(self, body: str) -> UnknownPlace:
        known = ", ".join(sorted(self._homes)) or "none"
        return UnknownPlace(f"{self.name} knows no place of {body!r}; the robots that it knows: {known}")

    async def _publish_when_changed(self) -> None:
        while True:
            await self._stir.wait()
            self._stir.clear()
            self._publish()
            await self.clock.sleep_s(EVERY_S * max(1.0, self.clock.rate))
            if any(robot.is_moving for robot in self._robots.values()):
                self._stir.set()

    def _publish(self) -> None:
        now_s = self.clock.now_s()
        for name, robot in self._robots.items():
            pose, before = _pose_of(name, robot.believe(now_s)), self._published.get(name)
            if before is None or msgspec.structs.replace(before, at_s=pose.at_s) != pose:
                self._published[name] = pose
                self.bus.publish(self.address, Conversation.POSES, pose)
                self._poses += 1
        self._keep(now_s)

    async def _begin(self, name: str) -> None:
        """Begin with a robot: ask its RC how many commands it applied before this process of the localizer began."""
        try:
            rc = address(Subsystem.RESOURCE_POOL, name)
            applied: int | None = (await self.bus.ask(rc, AskRc(), RcState, within_s=FIRST_REPLY_S)).applied
        except (LinkError, Refusal):  # the RC does not run: at the begin of a mission it has applied no command
            applied = None
        first = self._first(name, applied)
        self._robots[name], self._numbers[name] = DeadReckoning(first), applied or 0
        if first.spread_m >= LOST_M:
            self.publish_event(name, f"is at a place that {self.name} does not know", LogLevel.WARNING)

    def _first(self, name: str, applied: int | None) -> Belief:
        """Return the first belief: the start place, or the saved belief with more uncertainty for missed commands.

        Args:
            applied: Number of commands that its RC has applied; None: the RC does not run.
        """
        now_s, before = self.clock.now_s(), self._before
        if before is None and not applied:
            return Belief(self._homes[name], now_s, PLACED_M, PLACED_RAD)
        if before is None or name not in before.robots:
            return Belief(self._homes[name], now_s, LOST_M, math.pi)
        was, missed_s = before.robots[name], max(0.0, now_s - before.at_s)
        if applied is not None and applied >= was.number:
            missed_s = min(missed_s, (applied - was.number + was.is_moving) * COMMAND_TIMEOUT_S)
        spread_m, spread_rad = was.belief.spread_m, was.belief.spread_rad
        return Belief(
            was.belief.pose,
            now_s,
            min(LOST_M, spread_m + UNSEEN_M_S * missed_s),
            min(math.pi, spread_rad + UNSEEN_RAD_S * missed_s),
        )

    def _keep(self, now_s: float) -> None:
        if self._file is None:
            return
        robots = {
            name: Known(robot.believe(now_s), self._numbers[name], robot.is_moving)
            for name, robot in self._robots.items()
        }
        try:
            self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            replace_file(self._file, msgspec.msgpack.encode(Memory(now_s, robots)), is_lasting=False)
        except OSError as error:
            log.warning("%s: the beliefs are not kept: %s", self._file, error)


def _pose_of(body: str, belief: Belief) -> Pose:
    at = belief.pose
    return Pose(body, belief.at_s, at.x_m, at.y_m, at.heading_rad, belief.source, belief.spread_m, belief.spread_rad)


def _read(file: Path | None) -> Memory | None:
    """Return the state saved by an earlier process of this localizer."""
    if file is None or not file.exists():
        return None
    try:
        return msgspec.msgpack.decode(file.read_bytes(), type=Memory)
    except (OSError, msgspec.DecodeError) as error:
        log.error("%s: %s", file, error)
        return Memory(0.0, {})  # an earlier process existed, so all places are unknown
