"""The elements of the simulated world."""

from __future__ import annotations

from pydantic import Field

from backbone.mission.declaration.parts import PROCESS, Declared, ParameterElement
from backbone.mission.declaration.values import (
    ClassPath,
    Coordinate,
    Degrees,
    Energy,
    Extent,
    File,
    Flag,
    FurnitureShape,
    Height,
    Name,
    Scale,
    Seconds,
    Seed,
    Shape,
    Share,
    Speed,
)


class RoomElement(Declared):
    """The room's floor; the origin is a corner of it, x runs along its width, y along its depth."""

    width_m: Extent = Field(description="Extent along x in meters, above 0, at most 1000.")
    depth_m: Extent = Field(description="Extent along y in meters, above 0, at most 1000.")
    mjcf: File = Field(
        default="",
        description=(
            "An MJCF file with a room of your own, relative to the mission file; left out: walls with marks on them."
        ),
    )


class AirElement(Declared):
    """Disturbances of pictures and packets on the air between robots and base; left out: the mild defaults."""

    noise: Scale = Field(
        default=0.1,
        description="Scale of all five kinds of picture noise together, 0 to 10: 0 none, 1 as in the papers.",
    )
    white_noise: Scale = Field(
        default=1.0, description="Scale of the receiver's grain, 0 to 10; it grows with distance."
    )
    tears: Scale = Field(
        default=1.0, description="Scale of the horizontal lines, 0 to 10; most come while the robot's motors run."
    )
    ghosts: Scale = Field(default=1.0, description="Scale of the echoes a little to the right, 0 to 10.")
    fades: Scale = Field(
        default=1.0, description="Scale of the moments in which rows lose their places, 0 to 10; they come in bursts."
    )
    partial_frames: Scale = Field(
        default=1.0, description="Scale of the pictures whose lower rows the framegrabber lost, 0 to 10."
    )
    weak_signal: Scale = Field(
        default=1.0, description="How much distance counts, 0 to 10; 0: every robot is received as from 4 m."
    )
    settling: Scale = Field(
        default=1.0, description="Scale of the 0.25 s for which a picture rolls after switching, 0 to 10."
    )
    interference: Share = Field(
        default=1.0, description="Share of the rows that two transmitters on one frequency spoil, 0 to 1."
    )
    snow: Share = Field(default=1.0, description="Contrast of the noise on an unused frequency, 0 to 1.")
    radio_loss: Share = Field(default=0.0, description="Share of command packets lost at any distance, 0 to 1.")
    radio_delay_s: Share = Field(
        default=0.002, description="Time from a packet's end on the air until the robot has read it, seconds, 0 to 1."
    )
    antenna_x_m: Coordinate | None = Field(
        default=None, description="The base's antenna along the room's width, meters; left out: the middle of the room."
    )
    antenna_y_m: Coordinate | None = Field(
        default=None, description="The base's antenna along the room's depth, meters; left out: the middle of the room."
    )
    antenna_z_m: Height = Field(
        default=1.0, description="Height of the base's antenna above the floor, meters, 0 to 100."
    )


class FurnitureElement(Declared):
    """Something that stands on the floor: a cupboard, a step, a table."""

    name: Name = Field(description="Name of the box, unique in the world.")
    x_m: Coordinate = Field(description="Its center along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Its center along the room's depth, meters, inside the room.")
    width_m: Extent = Field(description="Extent along x in meters, above 0.")
    depth_m: Extent = Field(description="Extent along y in meters, above 0.")
    height_m: Extent = Field(description="Height above the floor in meters, above 0.")
    shape: FurnitureShape = Field(
        default="box", description="box, or table: a top on four legs, with a dark place beneath it."
    )


class RampElement(Declared):
    """A smooth slope that begins on the floor and ends at an upright edge."""

    name: Name = Field(description="Name of the ramp, unique in the world.")
    x_m: Coordinate = Field(description="Center of its footprint along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Center of its footprint along the room's depth, meters, inside the room.")
    length_m: Extent = Field(description="Extent of its footprint along the way up in meters, above 0.")
    width_m: Extent = Field(description="Extent across the way up in meters, above 0.")
    height_m: Extent = Field(
        description="Height of its upper edge in meters, above 0; a Scout climbs up to 0.36 of the length."
    )
    heading_deg: Degrees = Field(
        default=0.0, description="Direction of the way up, -360 to 360 degrees: 0 along x, 90 along y."
    )


class LandmarkElement(Declared):
    """The home base's board with the four-blob target, to which Scouts navigate."""

    name: Name = Field(description="Name of the landmark, unique in the world.")
    x_m: Coordinate = Field(description="Middle of its face along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Middle of its face along the room's depth, meters, inside the room.")
    heading_deg: Degrees = Field(default=0.0, description="Where it faces, -360 to 360 degrees: 0 along x, 90 along y.")


class DarkElement(Declared):
    """A box-shaped part of the room with little light; below a table there is one already."""

    name: Name = Field(description="Name of the dark place, unique in the world.")
    x_m: Coordinate = Field(description="Its center along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Its center along the room's depth, meters, inside the room.")
    width_m: Extent = Field(description="Extent along x in meters, above 0.")
    depth_m: Extent = Field(description="Extent along y in meters, above 0.")
    height_m: Extent = Field(description="Height above the floor in meters, above 0; what is above that is lit.")


class RobotElement(Declared):
    """The body of a robot, and its starting place; its network id is the resource's."""

    name: Name = Field(description="Name of the robot's resource.")
    x_m: Coordinate = Field(description="Middle of its axle along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Middle of its axle along the room's depth, meters, inside the room.")
    heading_deg: Degrees = Field(
        default=0.0, description="Where its camera looks, -360 to 360 degrees: 0 along x, 90 along y."
    )
    class_path: ClassPath = Field(
        default="",
        alias="class",
        description="The Python class of its body, written package.module:Class; left out: its type's.",
    )
    carried_by: Name = Field(
        default="",
        description=(
            "The target of shape carrier that brings it and sets it down here; left out: it is here from the beginning."
        ),
    )
    battery_j: Energy | None = Field(
        default=None,
        description=(
            "Capacity of its battery in joules, above 0, at most 1000000000; it is full at the beginning; left out: as "
            "its class has it."
        ),
    )


class PointElement(Declared):
    """A way point of a target; each target has at least two."""

    x_m: Coordinate = Field(description="Along the room's width, meters, inside the room.")
    y_m: Coordinate = Field(description="Along the room's depth, meters, inside the room.")


class TargetElement(Declared):
    """A body that walks along its way points repeatedly."""

    name: Name = Field(description="Name of the target, unique in the world.")
    shape: Shape = Field(
        description=(
            "Its appearance: pioneer, person, or carrier, which walks along its way points once and sets down the "
            "robots that it brings."
        )
    )
    speed_m_s: Speed = Field(description="Its speed in meters a second, above 0, at most 100.")
    begin_s: Seconds = Field(
        default=0.0, description="World time of its first departure, seconds, 0 or more, at most a day."
    )
    rest_s: Seconds = Field(
        default=0.0, description="Its pause at each end of the path, seconds, 0 or more, at most a day."
    )
    there_and_back: Flag = Field(
        default=True,
        description="true: it walks back along the path; false: it is back at the beginning after the pause.",
    )
    point: tuple[PointElement, ...] = Field(min_length=2)


class WorldElement(Declared):
    """The simulated world that plays the hardware whose driver is 'simulated'."""

    name: Name = Field(default="world", description="Name of the world's component.")
    type: Name = Field(default="simulated_world", description="Its component type.")
    host: Name = Field(default="", description="The host it runs on; left out: the placer decides.")
    seed: Seed = Field(default=0, description="Seed of everything random in the world, a whole number, 0 or more.")
    process: Name = PROCESS
    parameter: tuple[ParameterElement, ...] = ()
    room: RoomElement
    air: AirElement | None = None
    furniture: tuple[FurnitureElement, ...] = ()
    ramp: tuple[RampElement, ...] = ()
    landmark: tuple[LandmarkElement, ...] = ()
    dark: tuple[DarkElement, ...] = ()
    robot: tuple[RobotElement, ...] = ()
    target: tuple[TargetElement, ...] = ()
