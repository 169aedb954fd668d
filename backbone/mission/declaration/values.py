"""Kinds of attribute values, each with its range.

Rules of this file:

* A kind reads the text of an attribute, as XML Schema would: decimals without exponent, ``true`` or ``1``, names
  separated by blanks. A value that has its type already passes, so that code can make the same objects.
* ``kind`` is the name of the simple type in the XML schema; ``meaning`` is the remedy for a wrong value, if the
  attribute's own description does not state it.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Literal, TypeVar

from pydantic import BeforeValidator, Field, JsonValue

from backbone.component_database.messages import Multiplicity as MultiplicityWord
from backbone.keys import Conversation as ConversationWord
from backbone.naming import Subsystem as SubsystemWord
from backbone.quality import Urgency as UrgencyWord
from backbone.wire import MAX_LARGE_MESSAGE_BYTES

T = TypeVar("T")

LEAST_WHOLE, MOST_WHOLE = -(2**31), 2**31 - 1  # those of xs:int
MOST_DECIMAL = 1e12  # chosen: a thousand times the largest legal one; squares of such numbers are finite

_NAME = r"[a-z][a-z0-9_\-]{0,62}"
_CLASS_PATH = r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*:[A-Za-z_][A-Za-z0-9_]*"
_IN_A_CLASS_PATH = "of the letters A to Z and a to z, digits and '_'; no other letters."
_BLANKS = " \t\r\n"  # those of XML; Python knows more
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_WHOLE = re.compile(r"[+-]?[0-9]{1,20}")
_FLAGS = {"true": True, "1": True, "false": False, "0": False}


def decimal(text: str) -> float | None:
    """Return the number; None if the text is not a decimal number, or larger than any legal one can be."""
    number = float(text) if _DECIMAL.fullmatch(text := text.strip(_BLANKS)) else math.inf
    return number if abs(number) <= MOST_DECIMAL else None


def flag(text: str) -> bool | None:
    """Return true or false; None if the text is neither."""
    return _FLAGS.get(text.strip(_BLANKS))


def _read_decimal(value: object) -> object:
    return _must(decimal(value)) if isinstance(value, str) else value


def _read_whole(value: object) -> object:
    if not isinstance(value, str):
        return value
    return _must(int(value) if _WHOLE.fullmatch(value := value.strip(_BLANKS)) else None)


def _read_flag(value: object) -> object:
    return _must(flag(value)) if isinstance(value, str) else value


def _read_words(value: object) -> object:
    return tuple(re.findall(rf"[^{_BLANKS}]+", value)) if isinstance(value, str) else value


def _must(value: T | None) -> T:
    if value is None:
        raise ValueError("the text has another form")
    return value


def _kind(name: str, meaning: str = "") -> dict[str, JsonValue]:
    return {"kind": name, "meaning": meaning} if meaning else {"kind": name}


# In a type the limits come before the reader: pydantic omits limits after a reader from its JSON schema.
_DECIMAL_TEXT = BeforeValidator(_read_decimal)
_WHOLE_TEXT = BeforeValidator(_read_whole)

Name = Annotated[
    str,
    Field(
        pattern=rf"^{_NAME}$",
        json_schema_extra=_kind(
            "name", "A lower-case letter, then lower-case letters, digits, '_' or '-'; at most 63 characters."
        ),
    ),
]
Names = Annotated[
    tuple[Name, ...],
    BeforeValidator(_read_words),
    Field(
        json_schema_extra=_kind(
            "names", "Names separated by blanks, each a lower-case letter, then lower-case letters, digits, '_' or '-'."
        )
    ),
]
ParameterName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,62}$", json_schema_extra=_kind("parameter-name"))]
ClassPath = Annotated[
    str,
    Field(
        pattern=rf"^{_CLASS_PATH}$",
        json_schema_extra=_kind("class-path", f"Written package.module:Class, each name {_IN_A_CLASS_PATH}"),
    ),
]
Driver = Annotated[
    str,
    Field(
        pattern=rf"^({_NAME}|{_CLASS_PATH})$",
        json_schema_extra=_kind(
            "driver", f"A name, or a class written package.module:Class, each name {_IN_A_CLASS_PATH}"
        ),
    ),
]
Address = Annotated[
    str,
    Field(pattern=r"^[A-Za-z0-9:]([A-Za-z0-9.:\-]{0,251}[A-Za-z0-9])?$", json_schema_extra=_kind("address")),
]
SourceAddress = Annotated[
    str,
    Field(
        pattern=rf"^[a-z_]+(/{_NAME})+$",
        max_length=255,
        json_schema_extra=_kind("source-address", "A subsystem and a component, as in ui_console/joystick."),
    ),
]
File = Annotated[
    str,
    Field(
        min_length=1,
        max_length=4096,
        json_schema_extra=_kind("file", "The name of a file, at most 4096 characters."),
    ),
]
Text = Annotated[str, Field(json_schema_extra=_kind("xs:string"))]
Flag = Annotated[bool, BeforeValidator(_read_flag), Field(json_schema_extra=_kind("xs:boolean"))]

Processors = Annotated[
    str,
    Field(
        pattern=r"^([0-9]{1,4}( [0-9]{1,4})*)?$",
        json_schema_extra=_kind("processors", "Numbers of processors, separated by one blank each, as in '0 1'."),
    ),
]

Subsystem = Annotated[SubsystemWord, Field(json_schema_extra=_kind("subsystem"))]
Multiplicity = Annotated[MultiplicityWord, Field(json_schema_extra=_kind("multiplicity"))]
Conversation = Annotated[ConversationWord, Field(json_schema_extra=_kind("conversation"))]
Urgency = Annotated[UrgencyWord, Field(json_schema_extra=_kind("urgency"))]
OnInput = Annotated[Literal["any", "all", "none"], Field(json_schema_extra=_kind("on-input"))]
Shape = Annotated[Literal["pioneer", "person", "carrier"], Field(json_schema_extra=_kind("shape"))]
FurnitureShape = Annotated[Literal["box", "table"], Field(json_schema_extra=_kind("furniture-shape"))]

Priority = Annotated[int, Field(ge=LEAST_WHOLE, le=MOST_WHOLE, json_schema_extra=_kind("priority")), _WHOLE_TEXT]
Nice = Annotated[int, Field(ge=-20, le=19, json_schema_extra=_kind("nice")), _WHOLE_TEXT]
Seed = Annotated[int, Field(ge=0, le=MOST_WHOLE, json_schema_extra=_kind("seed")), _WHOLE_TEXT]
MessageBytes = Annotated[
    int, Field(ge=1, le=MAX_LARGE_MESSAGE_BYTES, json_schema_extra=_kind("message-bytes")), _WHOLE_TEXT
]
Port = Annotated[int, Field(ge=1, le=65535, json_schema_extra=_kind("port")), _WHOLE_TEXT]

Capacity = Annotated[float, Field(gt=0, le=1, json_schema_extra=_kind("capacity")), _DECIMAL_TEXT]
Frequency = Annotated[float, Field(ge=0, le=1000, json_schema_extra=_kind("frequency")), _DECIMAL_TEXT]
Seconds = Annotated[float, Field(ge=0, le=86400, json_schema_extra=_kind("seconds")), _DECIMAL_TEXT]
Duration = Annotated[float, Field(gt=0, le=86400, json_schema_extra=_kind("duration")), _DECIMAL_TEXT]
Scale = Annotated[float, Field(ge=0, le=10, json_schema_extra=_kind("scale")), _DECIMAL_TEXT]
Share = Annotated[float, Field(ge=0, le=1, json_schema_extra=_kind("share")), _DECIMAL_TEXT]
Height = Annotated[float, Field(ge=0, le=100, json_schema_extra=_kind("height")), _DECIMAL_TEXT]
Coordinate = Annotated[float, Field(ge=-1000, le=1000, json_schema_extra=_kind("coordinate")), _DECIMAL_TEXT]
Extent = Annotated[float, Field(gt=0, le=1000, json_schema_extra=_kind("extent")), _DECIMAL_TEXT]
Speed = Annotated[float, Field(gt=0, le=100, json_schema_extra=_kind("speed")), _DECIMAL_TEXT]
Energy = Annotated[float, Field(gt=0, le=1_000_000_000, json_schema_extra=_kind("energy")), _DECIMAL_TEXT]
Degrees = Annotated[float, Field(ge=-360, le=360, json_schema_extra=_kind("degrees")), _DECIMAL_TEXT]
