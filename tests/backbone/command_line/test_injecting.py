"""What a person writes to be injected is read as it stands, or refused with how to write it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line import injecting
from backbone.command_line.injecting import NoKey, read_object
from backbone.command_line.options import json_or_text
from backbone.command_line.where import Where
from backbone.component.messages import AskTime, SetParameter
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed
from backbone.recording.revival import WRITE_ONE, OtherForm, message_from
from backbone.wire import Envelope, Message, schema_of

CLASSES: dict[str, type[Message]] = {schema_of(kind): kind for kind in (AskTime, SetParameter)}
DEEP = "[" * 10_000 + "]" * 10_000


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no JSON"),
        ("{'schema': 1}", "no JSON"),
        (DEEP, "no JSON"),
        ('{"schema": "AskState", "schema": "Stop"}', "twice"),
        ('{"schema": "SetParameter", "deep": {"a": 1, "a": 2}}', "twice"),
        ('{"schema": "SetParameter", "name": "limit", "value": NaN}', "NaN"),
        ('{"schema": "SetParameter", "name": "limit", "value": [-Infinity]}', "-Infinity"),
        ('{"schema": "SetParameter", "name": "limit", "value": 1e999}', "1e999"),
    ],
    ids=["nothing", "Python", "deep", "twice", "twice within", "no number", "no end", "too large"],
)
def test_what_is_no_json_is_refused_with_how_to_write_it(text: str, told: str) -> None:
    with pytest.raises(OtherForm, match=told) as refused:
        read_object(text)
    assert refused.value.remedy == WRITE_ONE


@pytest.mark.parametrize(
    "key",
    ["/resource_pool/scout1/ask", "resource_pool//ask", "resource_pool/sc?t/readings", "resource_pool/*/ask", "ask"],
)
def test_a_key_of_no_component_is_refused_and_the_log_names_no_sender(
    key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    acted: list[Envelope[OperatorActed]] = []

    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        bus = LocalBus(LocalNetwork("night"), "ui_console/cli-1", VirtualClock())
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, acted.append)
        try:
            yield bus, VirtualClock()
        finally:
            await asyncio.sleep(1.0)  # what was published arrives

    async def mission_classes(_bus: object) -> dict[str, type[Message]]:
        return CLASSES

    monkeypatch.setattr(injecting, "connected", connected)
    monkeypatch.setattr(injecting, "mission_classes", mission_classes)
    with pytest.raises(NoKey) as refused:
        run_virtual(injecting.inject(Where(None, None, None), key, '{"schema": "AskTime"}', 1.0))
    assert key in refused.value.detail
    assert "did you mean" not in refused.value.detail, "its conversation is one"
    assert not acted


@pytest.mark.parametrize("said", [{}, {"name": 5}, {"name": "x", "value": None, "user": "a" * 10_000}], ids=str)
def test_a_message_with_other_values_is_refused_with_how_to_write_it(said: dict[str, object]) -> None:
    with pytest.raises(OtherForm, match="SetParameter/") as refused:
        message_from(CLASSES, {"schema": "SetParameter"} | said)
    assert refused.value.remedy == WRITE_ONE


@pytest.mark.parametrize("text", [DEEP, "9" * 5000], ids=["deep", "many digits"])
def test_a_value_that_is_too_much_to_be_json_is_a_text(text: str) -> None:
    assert json_or_text(text) == text


def test_the_field_with_a_wrong_value_is_named() -> None:
    with pytest.raises(OtherForm) as refused:
        message_from(CLASSES, {"schema": "SetParameter", "name": 5, "value": 1})
    assert refused.value.detail == "SetParameter/1: Expected `str`, got `int`, in name"
