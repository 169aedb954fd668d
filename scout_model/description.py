"""Description of a simulated world: plain data, from a mission file or a test. SI units, radians.

The room's frame: origin in a corner of the floor, x along its width, y along its depth, z up.
Headings: 0 is along +x, counter-clockwise is positive.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

Scale = Annotated[float, msgspec.Meta(ge=0, le=10)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Offset = Annotated[float, msgspec.Meta(ge=-1000, le=1000)]


class Block(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box-shaped part of the room that begins on the floor.

    Attributes:
        name: Unique in the world.
        x_m: Centre.
        y_m: Centre.
        width_m: Along x.
        depth_m: Along y.
        height_m: Above the floor.
    """

    name: str
    x_m: float
    y_m: float
    width_m: float
    depth_m: float
    height_m: float


class Furniture(Block, frozen=True, forbid_unknown_fields=True):
    """A piece of furniture on the floor: a cupboard, a step, a table with a dark place beneath.

    Attributes:
        shape: ``box``, or ``table``: a top on four legs, with a dark place beneath it.
    """

    shape: str = "box"


class Ramp(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A smooth slope that begins on the floor and ends at an upright edge.

    Attributes:
        name: Unique in the world.
        x_m: Centre of its footprint.
        y_m: Centre.
        length_m: Footprint's extent along the way up.
        width_m: Across.
        height_m: Of the upper edge.
        heading_rad: Direction of the way up.
    """

    name: str
    x_m: float
    y_m: float
    length_m: float
    width_m: float
    height_m: float
    heading_rad: float = 0.0


class Landmark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A board with the four-blob target, as on a home base; its sizes are in ``dimensions``.

    Attributes:
        name: Unique in the world.
        x_m: Middle of its face.
        y_m: Middle of its face.
        heading_rad: Direction that the board faces; from that direction the pattern appears undistorted.
    """

    name: str
    x_m: float
    y_m: float
    heading_rad: float = 0.0


class DarkPlace(Block, frozen=True, forbid_unknown_fields=True):
    """A box-shaped part of the room with little light.

    Floor and walls at its bounds, furniture in it, and robots while they are in it look dark.
    """


SCOUT = "scout_model.scout:Scout"
"""Class path of the papers' robot."""


class RobotPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A Scout or a robot of another kind, with its start place.

    Attributes:
        network_id: Its address on the command radio, 1 to 254.
        x_m: Position of its axle's middle.
        y_m: Position.
        heading_rad: Where its camera looks.
        kind: Class path ``package.module:Class`` of its kind, a ``scout_model.robot.Robot``.
        carried_by: Target of shape ``carrier`` that brings the robot and sets it down at this place; empty: it begins
            there.
        battery_j: Capacity of its battery, full at the beginning; None: the default of its kind.
    """

    name: str
    network_id: int
    x_m: float
    y_m: float
    heading_rad: float
    kind: str = SCOUT
    carried_by: str = ""
    battery_j: float | None = None


class Target(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A body that walks a path repeatedly; its position depends only on time.

    A carrier walks its path once, and back with ``there_and_back``, and stops to set down its load.

    Attributes:
        name: Unique in the world.
        shape: ``pioneer``, ``person`` or ``carrier``.
        path: Way points (x, y) in metres, at least two.
        speed_m_s: Speed along the path.
        begin_s: World time of its first departure.
        rest_s: Pause at each end of the path.
        there_and_back: True: it returns along the path; False: after the pause it appears at the beginning again.
    """

    name: str
    shape: str
    path: list[tuple[float, float]]
    speed_m_s: float
    begin_s: float = 0.0
    rest_s: float = 0.0
    there_and_back: bool = True


class AirDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Effects of the air on packets and pictures. The defaults are mild: a very good day in the papers' room.

    Scales go from 0 (off) to 10; 1 is the strength described in the papers. ``noise`` multiplies the next five.

    Attributes:
        noise: Scale of all five kinds of noise in a picture.
        white_noise: Grain of the receiver, stronger with distance.
        tears: Horizontal lines: few in general, many while the robot's motors run.
        ghosts: Echoes of the picture a little to its right, from multipath.
        fades: Moments in which multipath makes the signal too weak to keep the rows in place.
        partial_frames: Pictures whose lower rows the framegrabber missed: they are black, noise, or rows of an older
            picture.
        weak_signal: Influence of distance; 0: every robot is received as from ``scout_model.air.REFERENCE_M``.
        settling: Duration for which the picture rolls after transmitter or receiver switched to a frequency.
        interference: Share of the rows that two transmitters on one frequency spoil; the other rows show the nearer
            one.
        snow: Contrast of the noise on an unused frequency; 0: gray.
        radio_loss: Share of command packets lost at any distance, in addition to losses by distance.
        radio_delay_s: Time from a packet's end on the air until the robot has read it.
        antenna_x_m: Position of the base's antenna for packets and pictures; None: the middle of the room.
        antenna_y_m: Same.
        antenna_z_m: Above the floor.
    """

    noise: Scale = 0.1
    white_noise: Scale = 1.0
    tears: Scale = 1.0
    ghosts: Scale = 1.0
    fades: Scale = 1.0
    partial_frames: Scale = 1.0
    weak_signal: Scale = 1.0
    settling: Scale = 1.0
    interference: Share = 1.0
    snow: Share = 1.0
    radio_loss: Share = 0.0
    radio_delay_s: Share = 0.002
    antenna_x_m: Offset | None = None
    antenna_y_m: Offset | None = None
    antenna_z_m: Annotated[float, msgspec.Meta(ge=0, le=100)] = 1.0


AS_THE_PAPERS = AirDescription(noise=1.0)
"""At ``REFERENCE_M`` three quarters of the frames are clean; the others come in bursts of 0.15 s on average."""

CLEAN_AIR = AirDescription(
    noise=0.0, weak_signal=0.0, settling=0.0, interference=0.0, snow=0.0, radio_loss=0.0, radio_delay_s=0.0
)
"""No noise, losses or delays."""


class WorldDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A room with its contents.

    Attributes:
        width_m: Along x.
        depth_m: Along y.
        seed: Seed of all random processes.
        furniture: Furniture on the floor.
        robots: Robots.
        targets: Moving bodies.
        air: Air between robots and base.
        ramps: Slopes.
        landmarks: Boards with the four-blob target.
        dark_places: Places with little light.
        mjcf: The user's own room in place of walls and marks, as MJCF text; empty: none.
    """

    width_m: float
    depth_m: float
    seed: int = 0
    furniture: list[Furniture] = []
    robots: list[RobotPlace] = []
    targets: list[Target] = []
    air: AirDescription = AirDescription()
    ramps: list[Ramp] = []
    landmarks: list[Landmark] = []
    dark_places: list[DarkPlace] = []
    mjcf: str = ""
