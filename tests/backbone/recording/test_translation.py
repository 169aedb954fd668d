"""Every message of the product is recorded by the names of its fields, and comes back as it was."""

from __future__ import annotations

from typing import Any

import jsonschema
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from message_catalogue import catalogue, honest_body, limit_bodies

from backbone.recording.json_schema import schema_json
from backbone.recording.known_messages import message_classes
from backbone.recording.revival import OtherForm, revived
from backbone.recording.translation import NO_HEADING, Translator, heading_of
from backbone.wire import Message, schema_of
from resource_pool.messages import GiveCommand

CATALOGUE = catalogue()
SHIPPED = ("resource_pool.devices.pan_camera.rc", "resource_pool.rcs.skeleton", "resource_pool.robots.rover.rc")
"""Modules of component types that have commands of their own."""
KNOWN = message_classes(SHIPPED)
TRANSLATOR = Translator(KNOWN)


def on_the_wire(body: list[Any]) -> bytes:
    return msgspec.msgpack.encode([1, "resource_pool/scout1", 7, 12.5, "ui_console/c#3", body])


def translated(body: list[Any]) -> tuple[type[Message], dict[str, Any]]:
    found = TRANSLATOR.translate(on_the_wire(body), 12.6)
    assert found.kind is not None, body
    assert (found.source, found.sequence, found.stamp_s) == ("resource_pool/scout1", 7, 12.5)
    return found.kind, msgspec.json.decode(found.data)


def test_every_message_class_of_the_product_is_known() -> None:
    unknown = {kind.__module__ for kind in CATALOGUE if kind is not KNOWN.get(schema_of(kind))}
    assert not unknown, "pyproject.toml, scout_backbone.messages, lacks the modules of these"


@pytest.mark.parametrize("kind", CATALOGUE, ids=schema_of)
def test_a_message_is_what_its_schema_says_and_comes_back_as_it_was(kind: type[Message]) -> None:
    validator = jsonschema.Draft202012Validator(msgspec.json.decode(schema_json(kind)))
    validator.check_schema(validator.schema)
    for body in [honest_body(kind), *(sample.body for sample in limit_bodies(kind))]:
        if len(on_the_wire(body)) > 10_000:
            continue  # as another, longer
        made, said = translated(body)
        assert made is kind
        validator.validate(said)
        sent = msgspec.msgpack.decode(msgspec.msgpack.encode(body), type=kind)
        assert revived(kind, said["body"]) == sent


@pytest.mark.parametrize("kind", CATALOGUE, ids=schema_of)
def test_the_heading_of_a_message_says_the_same_as_the_whole_message(kind: type[Message]) -> None:
    raw = on_the_wire(honest_body(kind))
    head, whole = heading_of(raw), TRANSLATOR.translate(raw, 12.6)
    assert (head.source, head.sequence, head.stamp_s) == (whole.source, whole.sequence, whole.stamp_s)
    assert head.schema == whole.schema


@given(st.binary(max_size=200))
def test_bytes_that_are_no_message_have_no_heading(raw: bytes) -> None:
    if TRANSLATOR.translate(raw, 0.0).source == "":
        assert heading_of(raw) == NO_HEADING


def test_a_message_inside_another_keeps_its_schema() -> None:
    _kind, said = translated(msgspec.to_builtins(GiveCommand("shine", {"brightness": 0.5}, "lamp")))
    assert said["body"]["word"] == "shine"
    assert said["body"]["values"] == {"brightness": 0.5}


def test_a_message_of_an_unknown_class_is_recorded_without_names() -> None:
    found = TRANSLATOR.translate(on_the_wire(["Newcomer/1", "hello", [1, 2]]), 12.6)
    assert (found.kind, found.schema, found.source) == (None, "Newcomer/1", "resource_pool/scout1")
    assert msgspec.json.decode(found.data)["body"] == ["Newcomer/1", "hello", [1, 2]]


@pytest.mark.parametrize("raw", [b"", b"\xc1", b"not a message", msgspec.msgpack.encode([1, 2]), b"\x96" * 2000])
def test_bytes_that_are_no_message_are_kept(raw: bytes) -> None:
    found = TRANSLATOR.translate(raw, 12.6)
    assert (found.schema, found.source, found.data) == ("", "", raw)


def test_a_body_of_another_form_is_refused() -> None:
    with pytest.raises(OtherForm, match="GiveCommand/1"):
        revived(GiveCommand, {"word": 3})


PLAIN = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text() | st.binary()
ANYTHING = st.recursive(
    PLAIN | st.just(msgspec.msgpack.Ext(5, b"x")),
    lambda inner: st.lists(inner) | st.dictionaries(st.integers() | st.text() | st.binary(), inner),
    max_leaves=20,
)


@given(ANYTHING)
def test_whatever_a_sender_says_is_recorded_or_kept_as_bytes(value: Any) -> None:
    for body in (value, ["Newcomer/1", value], ["SetParameter/1", "speed", value, "anna"], [value, value]):
        try:
            raw = on_the_wire(body)
        except (OverflowError, TypeError):
            continue  # not even the wire can say it
        found = TRANSLATOR.translate(raw, 12.6)
        assert found.data == raw if not found.schema else msgspec.json.decode(found.data)["sequence"] == 7


def test_a_body_that_is_too_deep_is_kept_as_bytes() -> None:
    envelope = msgspec.msgpack.encode([1, "resource_pool/scout1", 7, 12.5, "", None])[:-1]
    raw = envelope + msgspec.msgpack.encode(["Newcomer/1", None])[:-1] + b"\x91" * 100_000 + b"\x90"
    assert TRANSLATOR.translate(raw, 12.6).data == raw
