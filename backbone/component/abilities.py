"""Abilities: the commands and reports of the components of one class, as data.

Consoles draw controls and gauges from them, so a new kind of robot or device needs no change in the consoles. A class
declares its commands and reports as structs; units come from the names of the fields, ranges from their types.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from enum import StrEnum
from typing import Annotated, Any

import msgspec

from backbone.component.field_docs import field_docs, first_sentence
from backbone.ranges import FEW, Line, Measure, Mention, Meters, Radians
from backbone.wire import Message

UNITS = {
    "rad_s": "rad/s",
    "m_s": "m/s",
    "m_s2": "m/s²",
    "rad": "rad",
    "deg": "°",
    "hz": "Hz",
    "px": "px",
    "m": "m",
    "n": "N",
    "v": "V",
    "s": "s",
}
"""Last words of a field's name → unit for people; the first entry that fits counts."""


UNLIMITED = 1e18  # the limit of all numbers on the bus, ``ranges.Measure``


class ValueKind(StrEnum):
    """Kind of the values of a field."""

    NUMBER = "number"
    WHOLE = "whole"
    FLAG = "flag"
    TEXT = "text"
    OTHER = "other"  # a console cannot ask a person for it, nor show it as one value


class FieldForm(Message, frozen=True):
    """A field of a command or report.

    Attributes:
        name: Its name, with its unit.
        kind: Kind of its values.
        unit: Its unit for people; empty: none.
        least: Smallest value, at least minus ``UNLIMITED``.
        most: Largest value, at most ``UNLIMITED``.
        default: Its value if a command leaves it out.
        is_required: True if no command can leave it out.
        choices: Its legal values, if they are words.
        doc: Its meaning, for people.
    """

    name: Mention
    kind: ValueKind
    unit: Mention = ""
    least: Measure = -UNLIMITED
    most: Measure = UNLIMITED
    default: Measure | bool | Line = 0.0
    is_required: bool = False
    choices: Annotated[list[Mention], FEW] = []
    doc: Line = ""


class CommandForm(Message, frozen=True):
    """A command.

    Attributes:
        word: Its name in scripts and stories.
        fields: Its fields, in their order.
        moves: True if a stopped robot refuses it.
        roles: Roles of the RCs that obey it; empty for an RC.
        doc: Its effect, for people.
    """

    word: Mention
    fields: Annotated[list[FieldForm], FEW] = []
    moves: bool = False
    roles: Annotated[list[Mention], FEW] = []
    doc: Line = ""


class CameraForm(Message, frozen=True):
    """The camera of a robot: its place on the robot, and its angle of view.

    Attributes:
        forward_m: Distance in front of the point to which the robot's pose refers.
        height_m: Height above the floor.
        tilt_rad: Angle of its view above the horizontal while the robot stands.
        across_rad: Angle between the left edge of the picture and the right edge; the picture's pixels are square.
    """

    forward_m: Meters
    height_m: Meters
    tilt_rad: Radians
    across_rad: Radians


class Abilities(Message, frozen=True):
    """Abilities of the components of a class.

    Attributes:
        is_robot: True for an RC of a robot with a body, which operators can stop.
        gives_pictures: True for an ARC whose owner gets pictures.
        body: Role of the RC with a body in an ARC; empty: none.
        body_class: Class path of the body of a robot's RC in a simulated world; empty: the mission file names one.
        commands: Commands that an RC obeys, or that an ARC passes on.
        reports: Fields of its reports.
        camera: The camera of a robot, from which consoles compute places in its picture; None: none is declared.
    """

    is_robot: bool = False
    gives_pictures: bool = False
    body: Mention = ""
    body_class: Line = ""
    commands: Annotated[list[CommandForm], FEW] = []
    reports: Annotated[list[FieldForm], FEW] = []
    camera: CameraForm | None = None


NO_ABILITIES = Abilities()


def unit_of(name: str) -> str:
    """Return the unit in a field's name; empty: none.

    Example:
        >>> unit_of("turn_rad_s"), unit_of("brightness")
        ('rad/s', '')
    """
    return next((unit for suffix, unit in UNITS.items() if name.endswith(f"_{suffix}")), "")


def range_text(field: FieldForm, number: Callable[[float], str] = "{:g}".format) -> str:
    """Return the legal values of a field, for people; empty: any value is legal.

    Args:
        number: Returns the text of a limit.

    Example:
        >>> range_text(FieldForm("turn_rad_s", ValueKind.NUMBER, "rad/s", -2.0, 2.0))
        '-2 to 2'
        >>> range_text(FieldForm("on", ValueKind.FLAG)), range_text(FieldForm("gait", ValueKind.TEXT, choices=["trot"]))
        ('yes or no', 'trot')
        >>> range_text(FieldForm("count", ValueKind.WHOLE, least=0)), range_text(FieldForm("x_m", ValueKind.NUMBER))
        ('at least 0', '')
    """
    if field.choices:
        return ", ".join(field.choices)
    if field.kind is ValueKind.FLAG:
        return "yes or no"
    least = number(field.least) if field.least > -UNLIMITED else ""
    most = number(field.most) if field.most < UNLIMITED else ""
    if least and most:
        return f"{least} to {most}"
    return f"at least {least}" if least else f"at most {most}" if most else ""


def field_forms(
    struct: type[msgspec.Struct],
    *,
    without: Collection[str] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> list[FieldForm]:
    """Return the form of each field of a struct, in the order of declaration.

    Args:
        without: Names of fields to leave out.
        limits: Name of a field → narrower range than that of its type.
    """
    docs, told = field_docs(struct), limits or {}
    described = msgspec.inspect.type_info(struct)
    assert isinstance(described, msgspec.inspect.StructType)  # noqa: S101  it is a struct
    return [
        _field_form(field, docs.get(field.name, ""), told.get(field.name))
        for field in described.fields
        if field.name not in without
    ]


def command_form(
    struct: type[msgspec.Struct],
    word: str,
    *,
    moves: bool,
    without: Collection[str],
    limits: Mapping[str, tuple[float, float]] | None = None,
    roles: Collection[str] = (),
) -> CommandForm:
    """Return the form of a command; see ``field_forms``."""
    fields = field_forms(struct, without=without, limits=limits)
    return CommandForm(word, fields, moves, list(roles), first_sentence(struct))


def _field_form(field: msgspec.inspect.Field, doc: str, limits: tuple[float, float] | None) -> FieldForm:
    least, most = limits or _range(field.type)
    kind, choices = _kind(field.type)
    return FieldForm(
        field.name,
        kind,
        unit_of(field.name),
        max(-UNLIMITED, least),
        min(UNLIMITED, most),
        _default(field.default),
        field.required,
        choices,
        doc,
    )


def _default(default: object) -> bool | int | float | str:
    """Return the default if a message can carry it; 0 otherwise, also for nan."""
    if isinstance(default, int | float):
        return default if abs(default) <= UNLIMITED else 0.0
    return default if isinstance(default, str) else 0.0


def _kind(kind: msgspec.inspect.Type) -> tuple[ValueKind, list[str]]:
    match kind:
        case msgspec.inspect.Metadata(type=inner):
            return _kind(inner)
        case msgspec.inspect.BoolType():
            return ValueKind.FLAG, []
        case msgspec.inspect.IntType():
            return ValueKind.WHOLE, []
        case msgspec.inspect.FloatType():
            return ValueKind.NUMBER, []
        case msgspec.inspect.StrType():
            return ValueKind.TEXT, []
        case msgspec.inspect.EnumType(cls=words):
            return ValueKind.TEXT, [str(word.value) for word in words]
        case msgspec.inspect.LiteralType(values=values):
            return ValueKind.TEXT, [str(value) for value in values]
        case _:
            return ValueKind.OTHER, []


def _range(kind: msgspec.inspect.Type) -> tuple[float, float]:
    inner: Any = kind.type if isinstance(kind, msgspec.inspect.Metadata) else kind
    least, most = getattr(inner, "ge", None), getattr(inner, "le", None)
    return -UNLIMITED if least is None else float(least), UNLIMITED if most is None else float(most)
