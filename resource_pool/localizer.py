"""Localizer: estimates robots' poses by dead reckoning and landmarks, without ceiling camera and without simulator.

It begins with the start places in the mission file, and adds the motions that RCs publish and the odometry of the
robots. If a behavior sees a landmark, the localizer corrects the robot's pose. It saves its beliefs in a file, and a
restarted localizer continues from the file. Motions that it missed, because it did not run or its link was cut, it gets
from the robots' RCs. Without the file, the pose of every robot that was commanded before is unknown. The rules are in
``dead_reckoning`` and ``motion_track``; this file has the loop.

In mission.xml: a resource of type ``localizer``, named by behaviors as ``localizer``. No ARC needs it.
"""

from __future__ import annotations

import asyncio
import base64
import logging
import math
from functools import partial
from typing import Annotated, ClassVar

import msgspec

from backbone.atomic_file import replace_file
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, NoResponder, Refusal
from backbone.kept_file import KeptFile
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRc, Connect, Disconnect
from backbone.wire import Accepts, Envelope, Message
from resource_pool.begin_places import read_begins
from resource_pool.commands import Halt
from resource_pool.dead_reckoning import STILL, Belief, FloorPose
from resource_pool.floor_plans import board, plan_of, sighted_from
from resource_pool.localization import AskFloorPlan, AskHome, AskPose, FloorPlan, LandmarkSighting, Pose, UnknownPlace
from resource_pool.messages import Applied, Readings
from resource_pool.motion_track import Known, MotionTrack
from resource_pool.published_motions import AskMotions, Motions
from resource_pool.rc_readings import watch_readings
from resource_pool.resource_controller import RcParameters, ResourceController
from scout_model.description import WorldDescription

log = logging.getLogger(__name__)

EVERY_S = 0.2  # chosen: five poses a second are a smooth track on a map
PLACED_M = 0.02  # chosen: a person puts a robot on its mark by hand
PLACED_RAD = math.radians(2.0)  # chosen: same
SIGHTED_RAD = math.radians(3.0)  # chosen: twice what servoing at 1 m was measured to err
LOST_M = 100.0  # chosen: larger than a room: the place is unknown
RC_REPLY_S = 0.5  # chosen: a running RC answers in milliseconds
ASKED_MOST = 6  # chosen: an RC that is busy for some seconds is not lost
RECOVERED_MOST = 2  # chosen: a further motion may be lost while the first answer is on its way
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


class Localizer(ResourceController[LocalizerParameters]):
    """Answers ``AskPose``, ``AskHome`` and ``AskFloorPlan``, and publishes each pose that changes."""

    parameters_type = LocalizerParameters
    given_elsewhere = ResourceController.given_elsewhere | {"room", "world"}
    accepts: ClassVar[Accepts | None] = Connect | Disconnect | AskRc | AskPose | AskHome | AskFloorPlan

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._plan = self.parameters.plan()
        self._homes = self.parameters.begins()
        self._file = KeptFile(launch.run_directory, "localizers", self.name)
        self._before = _read(self._file)
        self._robots: dict[str, MotionTrack] = {}
        self._recovering: set[str] = set()
        self._published: dict[str, Pose] = {}
        self._stir = asyncio.Event()
        self._heard = self._recovered = self._sightings = self._poses = 0

    async def connect(self) -> None:
        """Subscribe to robots' RCs and to behaviors that see landmarks."""
        await super().connect()
        await asyncio.gather(*map(self._begin, self._homes))
        for name in self._homes:
            rc = address(Subsystem.RESOURCE_POOL, name)
            self.bus.subscribe(rc, Conversation.MOTIONS, Applied, self._applied)
            self.bus.watch_alive(rc, partial(self._rc_lives, name))
        self.bus.watch_link(self._link_changed)
        watch_readings(self.bus, self._counted)
        sights = f"{Subsystem.MISSION_CONTROL}/*"
        self.bus.subscribe(sights, Conversation.SIGHTINGS, LandmarkSighting, self._sighted)

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
        own = {
            "motions_heard": self._heard,
            "motions_recovered": self._recovered,
            "sightings_taken": self._sightings,
            "poses_published": self._poses,
        }
        return {**super().statistics(), **own, "robots_known": len(self._robots)}

    def _applied(self, envelope: Envelope[Applied]) -> None:
        told, robot = envelope.body, self._robots.get(envelope.body.rc)
        if robot is None or envelope.source != address(Subsystem.RESOURCE_POOL, told.rc):
            return
        self._heard += 1
        robot.moved(self._plausible(told))
        if robot.has_gap:
            self._recover_soon(told.rc)
        self._stir.set()

    def _counted(self, told: Readings) -> None:
        robot = self._robots.get(told.rc)
        if robot is not None and WAY in told.values and TURNED in told.values:
            way_m, turned_rad, at_s = told.values[WAY], told.values[TURNED], min(told.at_s, self.clock.now_s())
            robot.happened(at_s, lambda robot: robot.counts(way_m, turned_rad, at_s))
            self._stir.set()

    def _sighted(self, envelope: Envelope[LandmarkSighting]) -> None:
        sighting, robot = envelope.body, self._robots.get(envelope.body.robot)
        if robot is None:
            return
        pose = sighted_from(self._plan, sighting, robot.believe(self.clock.now_s()))
        if pose is not None:
            at_s = min(sighting.at_s, self.clock.now_s())
            robot.happened(at_s, lambda robot: robot.sighted(pose, sighting.spread_m, SIGHTED_RAD, at_s))
            self._sightings += 1
            self._stir.set()

    def _plausible(self, told: Applied) -> Applied:
        return msgspec.structs.replace(told, at_s=min(told.at_s, self.clock.now_s()))

    def _rc_lives(self, robot: str, _rc: str, is_alive: bool) -> None:
        """Recover what was missed: the RC may have been cut off, or published its first motions before it was known."""
        if is_alive:
            self._recover_soon(robot)
        else:
            self._robots[robot].rc_left(self.clock.now_s())

    def _link_changed(self, _is_up: bool) -> None:
        """At both ends of a cut: tokens fall with the link although their processes live on."""
        for robot in self._robots.values():
            robot.was_deaf()

    def _recover_soon(self, robot: str) -> None:
        if robot not in self._recovering:
            self._recovering.add(robot)
            self.start_task(self._recover(robot), f"recover motions of {robot}")

    async def _recover(self, name: str) -> None:
        robot = self._robots[name]
        for _ in range(RECOVERED_MOST):
            before_s = robot.last_s
            told = await self._ask_motions(name, before_s)
            if told is None:
                break
            robot.recover(told)
            self._recovered += sum(one.at_s > before_s for one in told.motions)
            if not robot.has_gap:
                break
        robot.give_up()
        self._recovering.discard(name)
        self._stir.set()

    async def _ask_motions(self, robot: str, since_s: float) -> Motions | None:
        """Return the RC's motions from this time on; None if it does not run or does not answer."""
        rc = address(Subsystem.RESOURCE_POOL, robot)
        for _ in range(ASKED_MOST):
            try:
                told = await self.bus.ask(rc, AskMotions(since_s), Motions, within_s=RC_REPLY_S)
            except (NoResponder, Refusal):
                return None
            except LinkError:
                continue
            return msgspec.structs.replace(told, motions=list(map(self._plausible, told.motions)))
        return None

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
        self._keep()

    async def _begin(self, name: str) -> None:
        """Continue from the saved knowledge, or begin at the start place of a robot that no command has moved yet."""
        now_s = self.clock.now_s()
        known = None if self._before is None else self._before.get(name)
        told = await self._ask_motions(name, known.last_s if known else 0.0)
        motions = [] if told is None else told.motions
        if known is None:
            is_lost = self._before is not None or any(one.command != Halt.word() for one in motions)
            spreads = (LOST_M, math.pi) if is_lost else (PLACED_M, PLACED_RAD)
            last = (motions[-1].number, motions[-1].at_s) if motions else (0, now_s)
            known = Known(Belief(self._homes[name], now_s, *spreads), STILL, *last)
            if is_lost:
                self.publish_event(name, f"is at a place that {self.name} does not know", LogLevel.WARNING)
        self._robots[name] = MotionTrack(known)
        if told is not None:
            self._robots[name].recover(told)

    def _keep(self) -> None:
        robots = {name: robot.known for name, robot in self._robots.items()}
        try:
            if (target := self._file.target()) is not None:
                replace_file(target, msgspec.msgpack.encode(robots), is_lasting=False)
        except OSError as error:
            log.warning("%s: the beliefs are not kept: %s", self._file.path, error)


def _pose_of(body: str, belief: Belief) -> Pose:
    at = belief.pose
    return Pose(body, belief.at_s, at.x_m, at.y_m, at.heading_rad, belief.source, belief.spread_m, belief.spread_rad)


def _read(file: KeptFile) -> dict[str, Known] | None:
    """Return what an earlier process of this localizer saved, by robot; None: there was no earlier process."""
    try:
        saved = file.read()
        return None if saved is None else msgspec.msgpack.decode(saved, type=dict[str, Known])
    except (OSError, msgspec.DecodeError) as error:
        log.error("%s: %s", file.path, error)
        return {}  # an earlier process existed, so all places are unknown
