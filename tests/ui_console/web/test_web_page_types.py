"""The types that the page's JavaScript is checked by are those of the messages that are sent."""

from __future__ import annotations

import itertools
from typing import Any

import msgspec
from msgspec import inspect
from web_stage import Stage

from backbone.component.messages import StoryEvent
from ui_console.web.page_types import ANSWERS, FILE, LogFound, LogRefused, View, declarations


def fits(answer: dict[str, Any], kinds: tuple[type[msgspec.Struct], ...]) -> list[type[msgspec.Struct]]:
    """Return which of these structs the answer is."""
    fitting = []
    for kind in kinds:
        try:
            msgspec.convert(answer, kind)
        except msgspec.ValidationError:
            continue
        fitting.append(kind)
    return fitting


def odd(value: Any, kind: inspect.Type, where: str = "view") -> list[str]:
    """Return where a value is not of this type; messages of the bus come as dictionaries of their fields."""
    match kind:
        case inspect.StructType(fields=fields) if isinstance(value, dict):
            wrong = value.keys() ^ {field.encode_name for field in fields}
            there = [field for field in fields if field.encode_name in value]
            inside = [odd(value[field.encode_name], field.type, f"{where}.{field.name}") for field in there]
            return [*(f"{where}.{name}" for name in wrong), *itertools.chain(*inside)]
        case inspect.ListType(item_type=item) if isinstance(value, list):
            return [wrong for one in value for wrong in odd(one, item, f"{where}[]")]
        case inspect.UnionType(types=kinds):
            return [] if any(not odd(value, one) for one in kinds) else [where]
        case inspect.StructType() | inspect.ListType():
            return [where]
        case _:
            return [] if fits_plain(value, kind) else [where]


def fits_plain(value: Any, kind: inspect.Type) -> bool:
    """Say whether a value that is no struct and no list is of this type."""
    match kind:
        case inspect.StrType():
            return isinstance(value, str)
        case inspect.BoolType():
            return isinstance(value, bool)
        case inspect.IntType():
            return isinstance(value, int)
        case inspect.FloatType():
            return isinstance(value, int | float)
        case inspect.NoneType():
            return value is None
        case inspect.EnumType(cls=cls):
            return value in [one.value for one in cls]
        case inspect.DictType():
            return isinstance(value, dict)
    return False


def test_the_file_of_types_is_made_from_the_structs() -> None:
    assert FILE.read_text() == declarations(), "run python -m ui_console.web.page_types"


async def test_what_a_server_sends_has_the_types_that_the_page_is_checked_by(stage: Stage) -> None:
    stage.keep_log([StoryEvent(1.0, "ui_console/c", "was stopped", "scout1", "")])
    stage.place_robots("scout1", "scout2")
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held and "log" in anna.view, "held")
        await anna.say(do="stop_robot", robot="scout2")
        await anna.wait(lambda: any(robot["stop"] for robot in anna.view["robots"]), "stopped")
        await anna.say(do="beat", number=1)
        await anna.wait(lambda: "beat" in anna.view, "beat")
        assert odd(anna.view, inspect.type_info(View)) == []
        await anna.say(do="search_log", number=1)
        await anna.say(do="search_log", number=2, level="loud")
        for intent in ({"do": "why", "name": "scout1"}, {"do": "parameters", "name": "scout1"}):
            await anna.say(**intent)
        await anna.say(do="set", name="scout1", parameter="speed", value=1)
        await anna.wait(lambda: len(anna.answers) == 5, "answers")
        for answer in anna.answers:
            found = answer.get("log")
            kinds = fits(answer, ANSWERS) if found is None else fits(found, (LogFound, LogRefused))
            assert len(kinds) == 1, answer
