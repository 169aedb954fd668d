"""The map: the plan of the floor, the estimated place and trail of each body, and each robot's field of view.

Rules of this file: no bus, no clock, no screen; messages go in, views come out; times are mission seconds, and *now* is
an argument. Positions are in meters in the room's frame, see ``resource_pool.localization``.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec
from msgspec.structs import replace

from backbone.component.abilities import CameraForm
from backbone.component_database.messages import ComponentType, Types
from backbone.naming import Subsystem, address
from backbone.picture.mission import MissionPicture
from backbone.scheduling.views import RcView
from resource_pool.arc_client import FloorPlan, FloorShape, Pose, PoseSource
from ui_console.model.floor_pick import NoFloorThere, Stand, floor_place
from ui_console.model.link_board import LinkBoard

STALE_S = 3.0  # chosen: at a Scout's 0.35 m/s it may be a meter away; silent localizers are asked every second
TRAIL_STEP_M = 0.05  # chosen: half a Scout; a body that stands still leaves no trail
TRAIL_POINTS = 100  # chosen: five meters of way; ten robots cost a page 20 kB, only while they move
RECENT = 90  # chosen: three seconds at a camera's rate; the oldest usable picture is a second old
LEAST_ROOM_M = 2.0  # chosen: least size of an unknown floor

SOURCES = {
    PoseSource.SIMULATOR: "from the simulator",
    PoseSource.TRACKING: "tracked from above",
    PoseSource.DEAD_RECKONING: "dead reckoning",
    PoseSource.LANDMARK: "by a landmark",
}
"""Short texts for people, for the space beside a robot."""


class FloorView(msgspec.Struct, frozen=True):
    """The plan of the floor, for a page.

    Attributes:
        width_m: Along x.
        depth_m: Along y.
        shapes: Shapes on it.
        image: A JPEG that covers the whole floor, in base64; empty: none.
    """

    width_m: float
    depth_m: float
    shapes: list[FloorShape]
    image: str = ""


class BodyView(msgspec.Struct, frozen=True):
    """A body on the map.

    Attributes:
        name: Its name.
        is_robot: True for a robot of the mission; False for another body that a localizer knows.
        x_m: Its estimated place.
        y_m: Same.
        heading_rad: Counterclockwise from x.
        spread_m: Standard deviation of the place; 0: exact.
        source: Source of the place, for people.
        is_stale: True: the place is old, and the body may be elsewhere.
        age_s: Age of the place in whole seconds while it is stale; 0 while it is fresh.
        trail: Its past places, oldest first: x and y alternate.
        sees_rad: Angle of view of its camera while its holder gets pictures; 0: no ARC gets them.
        link: State of its commands on the radio, for people; empty: not known.
        does: Activity of its holder, for people, including any operator's order; empty: no ARC holds it.
    """

    name: str
    is_robot: bool
    x_m: float
    y_m: float
    heading_rad: float
    spread_m: float
    source: str
    is_stale: bool
    age_s: float
    trail: list[float]
    sees_rad: float
    link: str
    does: str


@dataclass(slots=True)
class _Track:
    """Places of one body over time."""

    now: Pose
    recent: deque[Pose] = field(default_factory=lambda: deque(maxlen=RECENT))
    trail: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=TRAIL_POINTS))

    def take(self, pose: Pose) -> None:
        self.now = pose
        self.recent.append(pose)
        here_m = pose.x_m, pose.y_m
        if not self.trail or math.dist(self.trail[-1], here_m) >= TRAIL_STEP_M:
            self.trail.append(here_m)


class MapBoard:
    """The map of a mission.

    Args:
        links: Links with the mission's radios.
    """

    def __init__(self, picture: MissionPicture, links: LinkBoard) -> None:
        self._picture, self._links = picture, links
        self._told: FloorPlan | None = None
        self._floor: FloorPlan | None = None
        self._far_m = LEAST_ROOM_M, LEAST_ROOM_M
        self._tracks: dict[str, _Track] = {}
        self._types: dict[str, ComponentType] = {}

    def take_plan(self, plan: FloorPlan) -> None:
        """Record the plan of the floor; the newest plan is used."""
        self._told = plan
        self._lay_floor()

    def take_pose(self, pose: Pose) -> None:
        """Record the estimated place of a body; a message older than the last one changes nothing."""
        track = self._tracks.get(pose.body)
        if track is not None and pose.at_s < track.now.at_s:
            return
        if track is None:
            track = self._tracks[pose.body] = _Track(pose)
        track.take(pose)
        far_x_m, far_y_m = self._far_m
        self._far_m = max(far_x_m, float(math.ceil(pose.x_m))), max(far_y_m, float(math.ceil(pose.y_m)))
        self._lay_floor()

    def take_types(self, types: Types) -> None:
        """Record the component types of the mission, which declare the robots' cameras."""
        self._types = {one.component_type.name: one.component_type for one in types.types}

    @property
    def floor(self) -> FloorPlan | None:
        """The plan of the floor; None: no localizer sent one, and no body has a place.

        Without a known extent, the floor covers all places so far. The object is the same until the plan changes.
        """
        return self._floor

    def views(self, now_s: float) -> list[BodyView]:
        """Return the bodies, sorted by name."""
        schedule = self._picture.schedule
        if schedule is None or not self._tracks:
            return [self._body(track, None, {}, now_s) for _, track in sorted(self._tracks.items())]
        robots = {rc.rc: rc for rc in schedule.rcs if rc.is_robot}
        owners = {request.arc: request.owner for request in schedule.requests}
        return [self._body(track, robots.get(name), owners, now_s) for name, track in sorted(self._tracks.items())]

    def where(self, body: str, at_s: float) -> Stand | None:
        """Return a body's pose at a recent time (the pose nearest in time); None: no place is known."""
        track = self._tracks.get(body)
        if track is None:
            return None
        pose = min(track.recent, key=lambda pose: abs(pose.at_s - at_s))
        return Stand(pose.x_m, pose.y_m, pose.heading_rad)

    def pick(
        self, robot: str, column_px: float, row_px: float, size_px: tuple[int, int], at_s: float
    ) -> tuple[float, float]:
        """Return the place on the floor at a point of a robot's picture: x and y in meters.

        Args:
            column_px: As for ``floor_place``.
            row_px: Same.
            size_px: Width and height of the picture.
            at_s: Mission time of the picture.

        Raises:
            NoFloorThere: No place on the floor of this room can be determined for the point.
        """
        robots = self._picture.schedule.rcs if self._picture.schedule is not None else []
        camera = next((self._camera_of(rc) for rc in robots if rc.rc == robot), None)
        stand = self.where(robot, at_s)
        if camera is None:
            raise NoFloorThere(f"the kind of {robot} declares no camera", remedy="Tap the place on the map.")
        if stand is None:
            raise NoFloorThere(f"no localizer knows where {robot} is", remedy="Drive it by hand.")
        x_m, y_m = floor_place(column_px, row_px, size_px, camera, stand)
        plan = self._told
        is_known = plan is not None and plan.width_m > 0.0 and plan.depth_m > 0.0
        if plan is not None and is_known and not (0.0 <= x_m <= plan.width_m and 0.0 <= y_m <= plan.depth_m):
            raise NoFloorThere(f"the floor there, {x_m:.1f} {y_m:.1f} m, would be outside of the room")
        return x_m, y_m

    def _lay_floor(self) -> None:
        """Update the floor from the localizer's plan; without an extent, the floor covers all places so far."""
        told, (far_x_m, far_y_m) = self._told or FloorPlan(0.0, 0.0), self._far_m
        if told.width_m > 0.0 and told.depth_m > 0.0:
            self._floor = told
            return
        floor = replace(told, width_m=told.width_m or far_x_m, depth_m=told.depth_m or far_y_m)
        if floor != self._floor:
            self._floor = floor

    def _body(self, track: _Track, robot: RcView | None, owners: Mapping[str, str], now_s: float) -> BodyView:
        pose = track.now
        age_s = max(0.0, now_s - pose.at_s)
        is_stale = age_s > STALE_S
        return BodyView(
            name=pose.body,
            is_robot=robot is not None,
            x_m=round(pose.x_m, 3),
            y_m=round(pose.y_m, 3),
            heading_rad=round(math.remainder(pose.heading_rad, math.tau), 3),
            spread_m=round(pose.spread_m, 3),
            source=SOURCES[pose.source],
            is_stale=is_stale,
            age_s=float(round(age_s)) if is_stale else 0.0,
            trail=[round(one, 2) for point in track.trail for one in point],
            sees_rad=self._sees_rad(robot) if robot is not None else 0.0,
            link=self._link(robot) if robot is not None else "",
            does=self._does(robot, owners) if robot is not None else "",
        )

    def _sees_rad(self, robot: RcView) -> float:
        camera = self._camera_of(robot)
        return camera.across_rad if camera is not None and self._gives_pictures(robot) else 0.0

    def _camera_of(self, robot: RcView) -> CameraForm | None:
        kind = self._types.get(robot.kind)
        return kind.abilities.camera if kind is not None else None

    def _gives_pictures(self, robot: RcView) -> bool:
        """Return whether the owner of the ARC that holds the robot gets pictures."""
        at = [address(Subsystem.RESOURCE_POOL, holder.arc) for holder in robot.holders]
        arcs = [self._picture.components[arc] for arc in at if arc in self._picture.components]
        return any(arc.type in self._types and self._types[arc.type].abilities.gives_pictures for arc in arcs)

    def _does(self, robot: RcView, owners: Mapping[str, str]) -> str:
        """Return the activity of the decision process that holds the robot, in its own words."""
        components = self._picture.components
        there = [components.get(owners.get(holder.arc, "")) for holder in robot.holders]
        return ", ".join(filter(None, (self._picture.people.doing(one) for one in there if one is not None)))

    def _link(self, robot: RcView) -> str:
        return self._links.radio_line(robot.holders[0].arc) if robot.holders else ""
