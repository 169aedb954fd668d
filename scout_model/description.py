"""What a simulated world is made of: plain data, from a mission file or a test. SI units, radians.

The room's frame: origin in a corner of the floor, x along its width, y along its depth, z up.
Headings: 0 looks along +x, counter-clockwise is positive.
"""

from __future__ import annotations

import msgspec


class Furniture(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box on the floor (table, cupboard).

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


class ScoutPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A Scout and where it begins.

    Attributes:
        name: Name of the robot.
        network_id: Its address on the command radio, 1 to 254.
        x_m: Position of its axle's middle.
        y_m: Position.
        heading_rad: Where its camera looks.
    """

    name: str
    network_id: int
    x_m: float
    y_m: float
    heading_rad: float


class Target(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A body that walks a path again and again; its position is a function of time alone.

    Attributes:
        name: Unique in the world.
        shape: ``pioneer`` or ``person``.
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


class WorldDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A room and what is in it.

    Attributes:
        width_m: Along x.
        depth_m: Along y.
        seed: Of everything random in it.
        furniture: Boxes.
        scouts: Robots.
        targets: Moving bodies.
    """

    width_m: float
    depth_m: float
    seed: int = 0
    furniture: list[Furniture] = []
    scouts: list[ScoutPlace] = []
    targets: list[Target] = []
