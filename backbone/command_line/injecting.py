"""The work of ``scout-backbone inject``: a person sends a message on the bus; it is validated and logged."""

from __future__ import annotations

import functools
import json
import math
import operator
from typing import Any

from backbone.command_line.connection import connected
from backbone.command_line.watching import mission_classes
from backbone.command_line.where import Where
from backbone.errors import Refusal
from backbone.keys import COPIED, ROOT, Conversation
from backbone.keys import key as key_of
from backbone.launcher.endings import ExitCode, say, show
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.naming import IllegalName, component_of, did_you_mean
from backbone.recording.json_schema import TAG
from backbone.recording.revival import WRITE_ONE, OtherForm, message_from
from backbone.wire import plain, schema_of

LEFT_OUT = (Conversation.ALIVE, *COPIED)


class NoKey(Refusal):
    """No message can be sent at this key."""

    code = "usage.key"
    remedy = "Name a key as 'watch' prints it: <subsystem>/<component>/<conversation>; questions go to '/ask'."


async def inject(where: Where, key: str, text: str, within_s: float) -> ExitCode:
    """Send the message, and print the answer to a question.

    Raises:
        NoKey: The text is not a key of one component.
        OtherForm: The text is not a message, or its fields or values do not fit the schema.
        Refusal: The component refused it.
    """
    said = read_object(text)
    async with connected(where) as (bus, clock):
        address, conversation = _place(key, bus.mission)
        classes = await mission_classes(bus)
        message = message_from(classes, said)
        told = f"{schema_of(type(message))} at {address}/{conversation}"
        publish_action(bus, clock, OperatorAction.INJECT, component_of(address), told)
        if conversation is not Conversation.ASK:
            bus.publish(address, conversation, message)
            say(f"published {told}")
            return ExitCode.DONE
        anything: Any = functools.reduce(operator.or_, classes.values())
        answer = await bus.ask(address, message, anything, within_s=within_s)
    show([json.dumps({TAG: schema_of(type(answer))} | plain(answer))])
    return ExitCode.DONE


def read_object(text: str) -> object:
    """Return what a person wrote as JSON.

    Raises:
        OtherForm: It is no JSON, too deep, an object has a name twice, or a number is too large.
    """
    try:
        return json.loads(text, object_pairs_hook=_each_name_once, parse_float=_finite, parse_constant=_finite)
    except (ValueError, RecursionError) as error:
        raise OtherForm(f"it is no JSON: {error}", remedy=WRITE_ONE) from error


def _each_name_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    said = dict(pairs)
    if len(said) < len(pairs):
        raise ValueError("a name stands twice in one object")
    return said


def _finite(text: str) -> float:
    """Return the number; the message would have no value in place of one that is not finite."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is no finite number")
    return number


def _place(key: str, mission: str) -> tuple[str, Conversation]:
    """Return address and conversation of a key, with or without ``scout/<mission>/``.

    Raises:
        NoKey: The text is not a key of one component.
    """
    short = key.removeprefix(f"{ROOT}/{mission}/")
    address, _, name = short.rpartition("/")
    known = {one.value: one for one in Conversation if one not in LEFT_OUT}
    if name not in known or "/" not in address or "*" in address:
        hint = did_you_mean(name, known) if name not in known else ""
        raise NoKey(f"{key!r} is no key of one component{hint}")
    try:
        key_of(mission, address, known[name])
    except IllegalName as error:
        raise NoKey(f"{key!r} is no key of one component: {error.detail}") from error
    return address, known[name]
