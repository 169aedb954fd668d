"""Ranges: the legal values of each kind of number, name and text on the bus.

Every field of every message has one of these types, so that the decoder refuses illegal values with
``MalformedMessage`` before a component gets them. A test examines all message classes and fails for a field without a
range.

Rules of this file:

* A number has both limits. ``NaN`` fails each comparison and so each lower limit, an infinity fails one of the two;
  a number with one limit only would let one infinity pass.
* A range is wide enough for every honest mission, and narrow enough that sums of such numbers stay exact. If a refusal
  at the place of use has the better remedy (a run time of 0, a lease of 0), the range admits the value.
* A field that introduces a name has the pattern of legal names. A field that only mentions a name has a limit of
  length, because a pattern costs 0.3 µs a name, and one message may renew thousands of leases.

Inside one process objects are delivered without decoding, because all code there is trusted and type-checked.
"""

from __future__ import annotations

import functools
import typing
from collections.abc import Iterable
from enum import Enum
from itertools import chain, repeat
from typing import Annotated, Any

from msgspec import Meta, Struct

from backbone.incarnation import START_BYTES
from backbone.naming import MAX_NAME_LENGTH
from backbone.type_aliases import unaliased

# How much.
MOST_ENTRIES = 65_536  # chosen: twice the leases of 10 000 ARCs on three RCs each
MOST_FEW = 256  # chosen: tags, features, roles, steps of a path; the largest tested mission has 12
MOST_STREAMS = 64  # chosen: one for each kind of packet; the largest mission has four
MANY = Meta(max_length=MOST_ENTRIES)
FEW = Meta(max_length=MOST_FEW)
FEW_STREAMS = Meta(max_length=MOST_STREAMS)

# Words.
LONGEST_MENTION = 255  # chosen: four names and their separators; the longest file name
LONGEST_SOURCE = LONGEST_MENTION - 18  # leaves room for ``#<sequence>``
LONGEST_LINE = 4_096  # chosen: far more than a person reads in one line
LONGEST_TEXT = 262_144  # chosen: the names of 10 000 ARCs in one sentence
LONGEST_DOCUMENT = 4_194_304  # chosen: half a message; the XML of 254 Scouts, 6 KB each, in the largest room

Name = Annotated[str, Meta(max_length=MAX_NAME_LENGTH, pattern=r"^[a-z][a-z0-9_-]*\Z")]
"""A legal name, see ``naming``."""
NameOrNone = Annotated[str, Meta(max_length=MAX_NAME_LENGTH, pattern=r"^([a-z][a-z0-9_-]*)?\Z")]
"""A legal name, or empty."""
Address = Annotated[str, Meta(max_length=LONGEST_MENTION, pattern=r"^[a-z_]+(/[A-Za-z0-9_.-]+)+\Z")]
"""``<subsystem>/<component>``, or the address of a process or token below it."""
Mention = Annotated[str, Meta(max_length=LONGEST_MENTION)]
"""A name, an address or an id that is looked up, compared or shown: an unknown one finds nothing."""
Source = Annotated[str, Meta(max_length=LONGEST_SOURCE)]
"""Address of a sender: shorter than a mention, so that a message id, which is ``<source>#<sequence>``, is a mention."""
Line = Annotated[str, Meta(max_length=LONGEST_LINE)]
"""One line for people or for the operating system: a reason, a path, a class."""
Text = Annotated[str, Meta(max_length=LONGEST_TEXT)]
"""Text of several lines from a component."""
Document = Annotated[str, Meta(max_length=LONGEST_DOCUMENT)]
"""A whole file."""

# Bytes.
MOST_PAYLOAD_BYTES = 4_096  # chosen: forty times the radio's longest packet
Payload = Annotated[bytes, Meta(max_length=MOST_PAYLOAD_BYTES)]
StateVector = Annotated[bytes, Meta(max_length=524_288)]  # chosen: 65 536 numbers; three Scouts need 700
MOST_QUOTED_BYTES = 4_000_000  # chosen: two of them fit a message
Quoted = Annotated[bytes, Meta(max_length=MOST_QUOTED_BYTES)]
"""A message inside another, as bytes."""
MOST_PIXEL_BYTES = 8_000_000  # chosen: a frame of 1080p in color is 6.2 MB
Pixels = Annotated[memoryview, Meta(max_length=MOST_PIXEL_BYTES)]
MOST_BULK_BYTES = 60_000_000  # chosen: fits a message of the longest kind, see ``wire.MAX_LARGE_MESSAGE_BYTES``
Bulk = Annotated[memoryview, Meta(max_length=MOST_BULK_BYTES)]
"""Large data of a module's output, such as a map; over 8 MB it reaches listeners of the same host only."""

# Counts and ids.
EXACT = 2**53  # up to here integers are exact in a double, a JSON trace and JavaScript

Epoch = Annotated[int, Meta(ge=0, le=EXACT)]
"""Fencing number of a connection; ``most_epoch`` in ``rc_manager.messages`` returns the highest plausible one."""
Count = Annotated[int, Meta(ge=0, le=EXACT)]
"""A count, or a number in a sequence."""
Number = Annotated[int, Meta(ge=-EXACT, le=EXACT)]
"""Any integer, such as a seed."""
Version = Annotated[int, Meta(ge=0, le=1_000_000)]  # chosen: a version grows by one with a release
Pid = Annotated[int, Meta(ge=0, le=2**22)]  # Linux, PID_MAX_LIMIT; 0: none
Start = Annotated[int, Meta(ge=0, lt=2 ** (8 * START_BYTES))]
"""Random number of a component's life; 0: not known."""
ExitCode = Annotated[int, Meta(ge=-255, le=255)]  # POSIX: a byte; Python: minus the signal
Signal = Annotated[int, Meta(ge=1, le=64)]  # Linux, the real-time signals included
Priority = Annotated[int, Meta(ge=-(2**31), le=2**31 - 1)]  # the mission file's xs:int
Rank = Annotated[int, Meta(ge=-1, le=MOST_ENTRIES)]  # place among the holders of one RC; -1: unchanged
MOST_PX = 8_192  # chosen: twice the width of a 4K picture
PixelCount = Annotated[int, Meta(ge=0, le=MOST_PX)]
PictureSide = Annotated[int, Meta(ge=1, le=MOST_PX)]  # pixels; an empty picture shows nothing
PixelPlace = Annotated[int, Meta(ge=-8_192, le=8_192)]  # a region may begin outside the picture

# Times, seconds.
A_DAY_S = 86_400.0  # chosen: as the longest time of a mission file
Instant = Annotated[float, Meta(ge=-A_DAY_S, le=1e12)]
"""Mission time; negative: unknown, or before the mission began. Chosen: 1e12 s are still exact to 0.1 ms."""
MachineTime = Annotated[float, Meta(ge=-1e12, le=1e12)]
"""Time of a machine's clock; it may have begun after mission time 0."""
Duration = Annotated[float, Meta(ge=0, le=A_DAY_S)]
"""A duration."""
RunTime = Annotated[float, Meta(ge=0, le=A_DAY_S)]
"""Shortest or longest time of a slice; 0: not stated."""
Period = Annotated[float, Meta(ge=0, le=A_DAY_S)]
"""Period of a stream, its packet time, deadline or jitter."""
Pause = Annotated[float, Meta(ge=-1, le=A_DAY_S)]
"""A pause; negative: it never ends."""
LONGEST_LEASE_S = 3_600.0  # chosen: 2 s at 1800 times the speed; --speed goes to 100
LeaseSeconds = Annotated[float, Meta(ge=0, le=LONGEST_LEASE_S)]
"""Duration of a hold without renewal, mission time."""
Rate = Annotated[float, Meta(gt=0, le=1_000)]  # chosen: mission seconds a second; --speed goes to 100

# Measures.
Share = Annotated[float, Meta(ge=0, le=1)]
"""A share of a whole, 0 to 1."""
Meters = Annotated[float, Meta(ge=-1e6, le=1e6)]  # chosen: a thousand kilometres from the corner of the room
Radians = Annotated[float, Meta(ge=-1e6, le=1e6)]  # chosen: a heading may count turns
Speed = Annotated[float, Meta(ge=-100, le=100)]  # chosen: m/s, three hundred times a Scout's; RCs clip
TurnRate = Annotated[float, Meta(ge=-1e3, le=1e3)]  # chosen: rad/s, a hundred times a Scout's; RCs clip
WheelSpeed = Annotated[float, Meta(ge=-1e4, le=1e4)]  # chosen: a hundred times a Scout's; RCs clip
MOST_MEASURE = 1e18  # chosen: far beyond every counter
Measure = Annotated[float, Meta(ge=-MOST_MEASURE, le=MOST_MEASURE)]
"""A number whose meaning is in its name: statistics, facts."""
Whole = Annotated[int, Meta(ge=-(2**63), le=2**63 - 1)]
"""An integer whose meaning is in its name."""

Facts = Annotated[dict[Mention, Text | Whole | Measure | bool], FEW]
"""A fact of a refusal, for programs."""

# Values of any kind.
Values = Annotated[dict[Mention, Any], MANY]
"""Named values of any kind, as in a mission file; ``wildness`` finds illegal values."""
DEEPEST = 72  # chosen: a behavior tree is two deep for each of the 32 levels of a mission file; and room around it


def wildness(value: object, depth: int = 0) -> str:
    """Return why a value of any kind is illegal, empty if it is legal: plain, finite and bounded.

    The reader calls this for messages with fields of any kind; types check all other messages and fields.

    Example:
        >>> wildness({"speed": [1, 2.5, None]}), wildness([float("nan")])
        ('', 'a number of nan')
    """
    match value:
        case str() if len(value) <= LONGEST_DOCUMENT:
            return ""  # the most common values first: a message holds thousands
        case None | bool() | Enum():
            return ""
        case float() if not -1e18 <= value <= 1e18:
            return f"a number of {value}"
        case int() if not -(2**63) <= value < 2**63:
            return "an integer of more than 64 bits"
        case int() | float():
            return ""
        case str() | bytes() | memoryview() if len(value) > LONGEST_DOCUMENT:
            return f"{len(value)} characters in one value"
        case bytes() | memoryview():
            return ""
        case list() | tuple() | dict() if len(value) > MOST_ENTRIES:
            return f"{len(value)} entries in one value"
        case list() | tuple() | dict() if depth > DEEPEST:
            return f"more than {DEEPEST} values inside each other"
        case list() | tuple():
            inside: Iterable[object] = value
        case dict():
            inside = chain(value.keys(), value.values())
        case Struct():
            inside = (getattr(value, name) for name in _fields_of_any_kind(type(value)))
        case _:
            return f"a value of type {type(value).__name__}"
    return next(filter(None, map(wildness, inside, repeat(depth + 1))), "")


@functools.cache
def holds_values_of_any_kind(kind: Any) -> bool:
    """Return whether this type admits values of any kind, which types alone cannot check."""
    waiting, seen = [kind], set[object]()  # a struct may contain itself
    while waiting:
        one = unaliased(waiting.pop())
        if one is Any:
            return True
        if one not in seen:
            seen.add(one)
            is_struct = isinstance(one, type) and issubclass(one, Struct)
            waiting += typing.get_type_hints(one).values() if is_struct else typing.get_args(one)
    return False


@functools.cache
def _fields_of_any_kind(kind: type[Struct]) -> list[str]:
    return [name for name, field in typing.get_type_hints(kind).items() if holds_values_of_any_kind(field)]
