"""Description of a simulated world: plain data, from a mission file or a test. SI units, radians.

The room's frame: origin in a corner of the floor, x along its width, y along its depth, z up.
Headings: 0 looks along +x, counter-clockwise is positive.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

Scale = Annotated[float, msgspec.Meta(ge=0, le=10)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Offset = Annotated[float, msgspec.Meta(ge=-1000, le=1000)]


class Block(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What takes a box of the room, from the floor on.

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
    """Something that stands on the floor: a cupboard, a step, a table with a dark place beneath.

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
    """A board with the four-blob target, as on a home base; its numbers stand in ``dimensions``.

    Attributes:
        name: Unique in the world.
        x_m: Middle of its face.
        y_m: Middle of its face.
        heading_rad: Where it faces; who stands there and looks back sees the pattern undistorted.
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
"""Class path of the robot of the papers."""


class RobotPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A Scout, or a robot of another kind, and where it begins.

    Attributes:
        network_id: Its address on the command radio, 1 to 254.
        x_m: Position of its axle's middle.
        y_m: Position.
        heading_rad: Where its camera looks.
        kind: Class path ``package.module:Class`` of its kind, a ``scout_model.robot.Robot``.
        carried_by: Target of shape ``carrier`` that brings it and sets it down at this place; empty: it stands there.
        battery_j: Capacity of its battery, full at the beginning; None: as its kind has it.
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
    """A body that walks a path again and again; its position is a function of time alone.

    A carrier walks its path once, and back with ``there_and_back``, and stops to set down its load.

    Attributes:
        name: Unique in the world.
        shape: ``pioneer``, ``person`` or ``carrier``.
        path: Way points (x, y) in metres, at least two.
        speed_m_s: Speed along the path.
        begin_s: World time of its first departure.
        rest_s: Pause at each end of the path.
        there_and_back: True: it returns along the path; False: it is back at the beginning after the pause.
    """

    name: str
    shape: str
    path: list[tuple[float, float]]
    speed_m_s: float
    begin_s: float = 0.0
    rest_s: float = 0.0
    there_and_back: bool = True


class AirDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Effects of the air on packets and pictures. The default is mild: a very good day in the papers' room.

    Scales go from 0, off, over 1, as the papers tell, to 10; ``noise`` multiplies the five next to it.

    Attributes:
        noise: Of all five kinds of noise in a picture.
        white_noise: Grain of the receiver, stronger with distance.
        tears: Horizontal lines, few by themselves, many while the robot's motors run.
        ghosts: Echoes of the picture a little to its right, from multipath.
        fades: Moments in which multipath leaves too little signal to keep the rows in place.
        partial_frames: Pictures whose lower rows the framegrabber did not get: black, noise, or those of an older one.
        weak_signal: How much distance counts; 0: every robot is received as from ``scout_model.air.REFERENCE_M``.
        settling: How long the picture rolls after transmitter or receiver were switched to a
            frequency.
        interference: Share of the rows that two transmitters on one frequency spoil; the rest is the nearer one's.
        snow: Contrast of the noise on an unused frequency; 0: gray.
        radio_loss: Share of command packets lost wherever the robot is, besides those lost by distance.
        radio_delay_s: From a packet's end on the air to the robot's having read it.
        antenna_x_m: Of the base's one antenna for packets and pictures; None: the middle of the room.
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
"""Three quarters of the frames from ``REFERENCE_M`` are clean, the others come in bursts of 0.15 s on average."""

CLEAN_AIR = AirDescription(
    noise=0.0, weak_signal=0.0, settling=0.0, interference=0.0, snow=0.0, radio_loss=0.0, radio_delay_s=0.0
)
"""Every picture arrives as it was sent, every packet at once."""


class WorldDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A room with its contents.

    Attributes:
        width_m: Along x.
        depth_m: Along y.
        seed: Of everything random in it.
        furniture: What stands on the floor.
        robots: Robots.
        targets: Moving bodies.
        air: Between them and the base.
        ramps: Slopes.
        landmarks: Boards with the four-blob target.
        dark_places: Where there is little light.
        mjcf: A room of one's own in place of the walls and their marks, as MJCF text; empty: none.
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
