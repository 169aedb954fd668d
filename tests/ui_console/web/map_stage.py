"""A localizer and ordered behaviors for the stage of the web console: places change when test or order says so."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, ClassVar

import msgspec
from fake_resource_pool import FakePlacer
from known_arcs import lit_types
from web_stage import MISSION, Stage

from backbone.addresses import DEPENDENCY_DATABASE, RC_MANAGER
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType, ListTypes, TypeCount, Types
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.keys import Conversation
from backbone.mission.behavior_reports import BehaviorStatus, BreakOff, BrokenOff, ChildReport, ReportNoted
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule
from backbone.wire import Envelope, Message
from resource_pool.localization import (
    AskFloorPlan,
    AskPose,
    FloorPlan,
    FloorShape,
    Pose,
    PoseSource,
    ShapeKind,
)

PLAN = FloorPlan(
    6.0,
    4.0,
    [
        FloorShape("table", ShapeKind.FURNITURE, 4.5, 3.0, 1.0, 0.6, 0.3),
        FloorShape("ramp1", ShapeKind.RAMP, 1.0, 3.2, 1.0, 0.5, 0.0),
        FloorShape("board", ShapeKind.LANDMARK, 3.0, 3.95, 0.3, 0.05, 0.0),
    ],
)
STEP_S = 0.05
SPEED_M_S = 1.0


class Eye(Component[Any]):
    """A localizer that knows what the test says."""

    accepts = AskPose | AskFloorPlan

    def __init__(self, *given: Any, plan: FloorPlan = PLAN) -> None:
        super().__init__(*given)
        self.plan, self.poses = plan, dict[str, Pose]()
        self.is_silent = False

    def place(self, body: str, x_m: float, y_m: float, heading_rad: float = 0.0, spread_m: float = 0.04) -> None:
        """Believe, and publish, that a body is there."""
        pose = Pose(body, self.clock.now_s(), x_m, y_m, heading_rad, PoseSource.TRACKING, spread_m)
        self.poses[body] = pose
        self.bus.publish(self.address, Conversation.POSES, pose)

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case AskFloorPlan():
                return self.plan
            case AskPose(body=body) if body in self.poses and not self.is_silent:
                return msgspec.structs.replace(self.poses[body], at_s=self.clock.now_s())
        return await super().answer(asked)


class Goer(Component[Any]):
    """Carries out an order once no ARC has the robot: it glides to the place; without one it stands until its end."""

    class Parameters(msgspec.Struct, frozen=True):
        path: list[Any]
        arc: dict[str, Any]
        children: list[Any]
        keeper: str
        localizer: str = ""
        x_m: float = math.nan
        y_m: float = math.nan
        target: str = ""

    parameters_type = Parameters
    accepts = BreakOff
    eye: ClassVar[Eye]
    placer: ClassVar[FakePlacer]

    async def serve(self) -> None:
        self.start_task(self._work(), "work")
        await super().serve()

    async def answer(self, asked: Envelope[Any]) -> Message:
        if isinstance(asked.body, BreakOff):
            self._is_off = True
            return BrokenOff()
        return await super().answer(asked)

    _is_off = False

    async def _work(self) -> None:
        robot = self.parameters.arc["wish"]["robot"]
        await self._tell(BehaviorStatus.RUNNING, "waits for its turn")
        arcs = self.placer.arcs
        await self.placer.wait(lambda: not any(arc.granted and robot in arc.epochs for arc in arcs.values()))
        await self._tell(BehaviorStatus.RUNNING)
        while not math.isnan(self.parameters.x_m) and not self._is_off:
            pose = self.eye.poses[robot]
            to_x_m, to_y_m = self.parameters.x_m - pose.x_m, self.parameters.y_m - pose.y_m
            rest_m, step_m = math.hypot(to_x_m, to_y_m), SPEED_M_S * STEP_S
            if rest_m < step_m:
                self.eye.place(robot, self.parameters.x_m, self.parameters.y_m, pose.heading_rad)
                await self._tell(BehaviorStatus.SUCCESS)
                return
            heading_rad = math.atan2(to_y_m, to_x_m)
            self.eye.place(robot, pose.x_m + step_m * to_x_m / rest_m, pose.y_m + step_m * to_y_m / rest_m, heading_rad)
            await self.clock.sleep_s(STEP_S)

    async def _tell(self, status: BehaviorStatus, waits_because: str = "") -> None:
        report = ChildReport(self.name, status, suspended_because=waits_because)
        await self.bus.ask(self.parameters.keeper, report, ReportNoted, within_s=5.0)


class Floor:
    """The stage with a floor.

    Attributes:
        eye: The localizer.
    """

    def __init__(self, stage: Stage, eye: Eye) -> None:
        self.stage, self.eye = stage, eye

    @property
    def ordered(self) -> dict[str, list[tuple[str, float, float]]]:
        """Robot → kind and place of each behavior that was ever started for it, oldest first."""
        found: dict[str, list[tuple[str, float, float]]] = {}
        for start in self.stage.placer.placed.values():
            if start.type in KINDS:
                place = start.parameters.get("x_m", 0.0), start.parameters.get("y_m", 0.0)
                found.setdefault(start.parameters["arc"]["wish"]["robot"], []).append((start.type, *place))
        return found


def _with_pictures(kind: ComponentType) -> ComponentType:
    return msgspec.structs.replace(kind, abilities=msgspec.structs.replace(kind.abilities, gives_pictures=True))


KINDS = ("go_to", "watch_for_motion", "return_home", "follow")


@asynccontextmanager
async def floor_on(stage: Stage, beside: Any, plan: FloorPlan = PLAN) -> AsyncIterator[Floor]:
    """Add a localizer that knows scout1 to scout3, and what starts the behaviors of orders."""
    clock, network = stage.clock, stage.network

    def make(kind: Any, subsystem: Subsystem, name: str, type_name: str, **more: Any) -> Any:
        launch = Launch(
            MISSION, subsystem, name, type_name, "x:Y", "local", "", 0.0, 1.0, requester="backbone/launcher"
        )
        return kind(launch, network.join(launch.address, clock), clock, **more)

    eye = make(Eye, Subsystem.RESOURCE_POOL, "eye", "localizer", plan=plan)
    stage.place_robots("scout1", "scout2", "scout3")
    stage.placer.classes.update(dict.fromkeys(KINDS, Goer))
    Goer.eye, Goer.placer = eye, stage.placer
    types = [
        *(_with_pictures(one) if one.name == "capture" else one for one in lit_types("capture")),
        *(ComponentType(kind, "x:Y", Subsystem.MISSION_CONTROL) for kind in KINDS),
    ]
    robots = [Resource(name, "scout", is_robot=True) for name in ("scout1", "scout2", "scout3")]

    class TypeBook(Component[Any]):
        accepts = ListTypes

        async def answer(self, asked: Envelope[Any]) -> Message:
            return Types([TypeCount(one, 1) for one in types])

    async def resources(_asked: Envelope[Any]) -> Message:
        shared = [Resource(kind, kind) for kind in ("command_radio", "video_frequency", "framegrabber", "lamp")]
        return Resources([*robots, *shared])

    async def schedule(_asked: Envelope[Any]) -> Message:
        behaviors = [f"{Subsystem.MISSION_CONTROL}/{name}" for name in stage.placer.components]
        requests = [
            RequestView(f"{at}-arc", at, RequestState.WAITING, [], 0.0, 0.0, 0.0, "", [], 5.0, "", 0)
            for at in behaviors
        ]
        return Schedule(clock.now_s(), [], requests, [])

    database = make(TypeBook, Subsystem.BACKBONE, "component_database", "component_database")
    dependencies = network.join(DEPENDENCY_DATABASE, clock)
    dependencies.serve(DEPENDENCY_DATABASE, AskResources, resources)
    stage.rc_manager.serve(RC_MANAGER, AskSchedule, schedule)
    try:
        async with beside(eye), beside(database):
            for number, robot in enumerate(("scout1", "scout2", "scout3")):
                eye.place(robot, 1.0 + number, 1.0, 0.4 * number)
            yield Floor(stage, eye)
    finally:
        await dependencies.close()
