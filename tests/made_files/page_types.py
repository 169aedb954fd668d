"""The types of the pages' messages, for the checker of their JavaScript.

Tests compare what the servers send with ``View``, ``DesignView`` and the answers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import get_args

import msgspec
from msgspec import inspect

from backbone.component.messages import ComponentState
from backbone.recording.markers import Marker
from backbone.scheduling.views import RequestView
from ui_console.design.answers import DesignAnswer
from ui_console.design.protocol import DesignIntent
from ui_console.design.views import (
    DesignerWelcomed,
    DraftStatus,
    ElementRow,
    ElementView,
    PaletteRow,
    ProblemRow,
    RehearsalView,
)
from ui_console.model import views
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.debug_views import SeenViews
from ui_console.model.key_shown import KeyList, MessageShown
from ui_console.model.map import BodyView, FloorView
from ui_console.model.timeline import TimelineView
from ui_console.web.login import BeatRequest, Hello
from ui_console.web.playing import PlaybackView, Playing
from ui_console.web.protocol import Intent

_PLAIN: dict[type[inspect.Type], str] = {
    inspect.IntType: "number",
    inspect.FloatType: "number",
    inspect.StrType: "string",
    inspect.BoolType: "boolean",
    inspect.NoneType: "null",
}
HEAD = "// What the page and its server send each other. Written by tests/made_files; change the structs.\n"


class Welcomed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Who came in, and where; ``missions`` are all of this server."""

    user: str
    priority: int
    mission: str
    missions: list[str]


class LoggedEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One event of the mission's log, as the command line's JSON has it."""

    at_s: float
    level: str
    subject: str
    what: str
    person: str
    where: str
    cause: str


class FoundEvent(LoggedEvent, frozen=True):
    """One that a search found, with its time of day."""

    time: str


class MissionView(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All sections of the view of a mission; a message has those that changed."""

    welcome: Welcomed
    own: views.OwnView
    abilities: ArcAbilities | None
    robots: list[views.RobotView]
    links: list[views.LinkView]
    alarms: list[views.AlarmView]
    drawn: dict[str, float]
    tree: list[views.NodeView]
    requests: list[RequestView]
    timeline: TimelineView
    health: views.HealthView | None
    parameters: list[views.ParameterView]
    components: list[ComponentState]
    log: list[LoggedEvent]
    floor: FloorView | None
    bodies: list[BodyView]
    now_s: float
    seen: SeenViews
    beat: int


class View(MissionView, frozen=True):
    """Those, and the sections that only a recording has."""

    playback: PlaybackView
    markers: list[Marker]


class LogFound(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of what a search found."""

    number: int
    first: int
    events: list[FoundEvent]
    total: int
    left_out: int
    since_s: float
    asked_s: float


class LogRefused(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A search that finds nothing because it cannot be."""

    number: int
    code: str
    refused: str
    remedy: str


class WhyAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Why something is as it is."""

    why: str
    lines: list[str]


class RefusedAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is not done, or not certain."""

    refused: str


class ParametersAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether a component told its parameters."""

    parameters: str
    told: bool


class SetAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether a parameter was changed."""

    set: str
    parameter: str
    done: bool


class LogFoundAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a search found."""

    log: LogFound


class LogRefusedAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Why a search finds nothing."""

    log: LogRefused


class DesignView(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All sections of the designer's view; a message has those that changed."""

    welcome: DesignerWelcomed
    tree: list[ElementRow]
    problems: list[ProblemRow]
    palette: list[PaletteRow]
    places: dict[str, list[str]]
    status: DraftStatus
    selected: int
    element: ElementView
    rehearsal: RehearsalView | None
    people: list[str]
    handled: int
    beat: int


@dataclass(frozen=True, slots=True)
class Page:
    """What a page and its server send each other.

    Attributes:
        view: All that it shows.
        answers: To what it asks.
        said: What it says.
        packed: What comes to it as pictures do.
    """

    view: type[msgspec.Struct]
    answers: tuple[type[msgspec.Struct], ...]
    said: tuple[type[msgspec.Struct], ...]
    packed: tuple[type[msgspec.Struct], ...] = ()


CONSOLE = Page(
    View,
    (WhyAnswer, RefusedAnswer, ParametersAnswer, SetAnswer, LogFoundAnswer, LogRefusedAnswer),
    (Hello, BeatRequest, *get_args(Intent), *get_args(Playing)),
    (KeyList, MessageShown),
)
DESIGNER = Page(DesignView, get_args(DesignAnswer), (Hello, BeatRequest, *get_args(DesignIntent)))


def declarations(page: Page) -> str:
    """Return the whole file of a page's types."""
    heard = _declared([page.view, *page.answers, *page.packed], is_sent_whole=True)
    said = _declared(page.said, is_sent_whole=False)
    news = f"{{ view: Partial<{page.view.__name__}>; answer?: undefined }}"
    return "\n".join(
        [
            HEAD,
            *heard.values(),
            *(text for name, text in said.items() if heard.get(name) != text),
            _union("Answer", page.answers),
            f"export type Heard = {news} | {{ answer: Answer; view?: undefined }};\n",
            _union("Said", page.said),
        ]
    )


def _union(name: str, kinds: Iterable[type[msgspec.Struct]]) -> str:
    words = "\n".join(f"  | {kind.__name__}" for kind in kinds)
    return f"export type {name} =\n{words};\n"


def _declared(kinds: Iterable[type[msgspec.Struct]], *, is_sent_whole: bool) -> dict[str, str]:
    """Return the name and declaration of each struct and enum that these need, by name.

    Args:
        kinds: The structs.
        is_sent_whole: True: fields with a default are always there, because the server writes them.
    """
    declared: dict[str, str] = {}
    for kind in kinds:
        _type(inspect.type_info(kind), declared, is_sent_whole)
    return dict(sorted(declared.items()))


def _type(kind: inspect.Type, declared: dict[str, str], is_sent_whole: bool) -> str:
    """Return the TypeScript type; what it is made of is declared afterwards.

    Example:
        >>> _type(inspect.type_info(list[float] | None), {}, True)
        'number[] | null'
    """
    match kind:
        case inspect.StructType(cls=cls, fields=fields):
            if cls.__name__ not in declared:
                declared[cls.__name__] = ""  # it may be made of itself
                lines = _tag(kind) + [
                    f"  {field.encode_name}{'' if is_sent_whole or field.required else '?'}: "
                    f"{_type(field.type, declared, is_sent_whole)};\n"
                    for field in fields
                ]
                declared[cls.__name__] = f"export interface {cls.__name__} {{\n{''.join(lines)}}}\n"
            return cls.__name__
        case inspect.EnumType(cls=cls):
            values = "".join(
                f"\n  | {msgspec.json.encode(value).decode()}" for value in sorted(one.value for one in cls)
            )
            declared[cls.__name__] = f"export type {cls.__name__} ={values};\n"
            return cls.__name__
        case inspect.UnionType(types=types):
            return " | ".join(_type(one, declared, is_sent_whole) for one in types)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            of = _type(item, declared, is_sent_whole)
            return f"({of})[]" if " " in of else f"{of}[]"
        case inspect.DictType(value_type=value):
            return f"Record<string, {_type(value, declared, is_sent_whole)}>"
    return _PLAIN.get(type(kind), "unknown")


def _tag(kind: inspect.StructType) -> list[str]:
    """Return the field that says which message it is; messages of the bus go to the page without it."""
    is_tagged = kind.tag is not None and not kind.array_like
    return [f"  {kind.tag_field}: {msgspec.json.encode(kind.tag).decode()};\n"] if is_tagged else []
