"""Every field of every message has a range: at its limits it is read, beyond them the message is refused."""

from __future__ import annotations

import math
import sys
import typing
from typing import Any

import msgspec
import pytest
from hostile_messages import enveloped
from message_catalogue import catalogue, honest_body, hostile_bodies, limit_bodies

from backbone.component.messages import AskState, SetParameter
from backbone.errors import Refusal
from backbone.wire import MalformedMessage, Message, OversizedMessage, Reader, Refused, WrongVersion

MESSAGES = catalogue()


class Unranged(Message, frozen=True):
    """A message whose author forgot the ranges."""

    speed_m_s: float
    count: int
    name: str
    names: list[str]
    robots: dict[str, float]


class OneSided(Message, frozen=True):
    """A message with no other field than an honest one."""

    ready: bool


def test_the_catalogue_holds_the_messages_of_all_packages() -> None:
    packages = {kind.__module__.partition(".")[0] for kind in MESSAGES}
    assert packages == {"backbone", "resource_pool", "mission_control", "ui_console"}
    assert len(MESSAGES) > 120


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_each_field_beyond_its_limits_is_refused(kind: type[Message]) -> None:
    assert unrefused(kind) == []


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_each_field_at_its_limits_is_read(kind: type[Message]) -> None:
    reader: Reader[Any] = Reader(kind)
    reader.read(enveloped(honest_body(kind)))
    for sample in limit_bodies(kind):
        try:
            reader.read(enveloped(sample.body))
        except OversizedMessage:
            assert sample.name.endswith("longest")
        except Refusal as refusal:
            pytest.fail(f"{sample.name}: {refusal}")


def test_a_message_without_ranges_is_found() -> None:
    found = " ".join(unrefused(Unranged))
    for field in ("speed_m_s: never nan", "speed_m_s: never inf", "count: never 184", "name: 1 MB", "names: too many"):
        assert field in found
    assert "names: item 1 MB" in found
    assert "robots: value never nan" in found
    assert unrefused(OneSided) == []


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (1, "a" * 1_000_000),
        (2, -1),
        (2, 2**64 - 1),
        (3, math.nan),
        (3, math.inf),
        (3, -math.inf),
        (3, 1e308),
        (4, "a" * 1_000_000),
    ],
)
def test_an_envelope_beyond_its_limits_is_refused(place: int, value: Any) -> None:
    envelope: list[Any] = [1, "ui_console/hostile", 1, 0.5, "", AskState()]
    envelope[place] = value
    with pytest.raises(MalformedMessage):
        Reader(AskState).read(msgspec.msgpack.encode(envelope))


def test_a_refusal_travels_whatever_it_is_about() -> None:
    refusal = Refusal("d" * 10_000_000, wait_s=math.inf, share=math.nan, big=2**70, text="t" * 10_000_000)
    read = Reader(Refused).read(enveloped(Refused.of(refusal))).body
    assert read.facts["wait_s"] == "inf"
    assert read.facts["share"] == "nan"
    assert read.facts["big"] == str(2**70)


def test_what_is_wild_is_named() -> None:
    with pytest.raises(MalformedMessage, match="SetParameter/1: a number of nan"):
        Reader(SetParameter).read(enveloped(["SetParameter/1", "speed", [1, {"a": math.nan}]]))


class Branch(Message, frozen=True):
    """A message that contains messages of its own kind, and values of any kind."""

    branches: list[Branch]
    value: Any = None


def test_what_is_wild_in_a_message_that_contains_its_own_kind_is_named() -> None:
    reader = Reader(Branch)
    tree = Branch([Branch([], 1), Branch([Branch([], [2, "leaf"])])])
    assert reader.read(enveloped(msgspec.to_builtins(tree))).body == tree
    with pytest.raises(MalformedMessage, match="a number of nan"):
        reader.read(enveloped(msgspec.to_builtins(Branch([Branch([Branch([], math.nan)])]))))


def unrefused(kind: type[Message]) -> list[str]:
    """Return the names of the hostile messages of this kind that are read."""
    reader: Reader[Any] = Reader(kind)
    found = []
    for sample in hostile_bodies(kind):
        try:
            reader.read(enveloped(sample.body))
        except (MalformedMessage, OversizedMessage):
            continue
        except WrongVersion:
            pass
        found.append(sample.name)
    return found


@pytest.mark.skipif(sys.version_info < (3, 12), reason="Python 3.11 has no aliases that are objects")
def test_an_alias_of_values_of_any_kind_does_not_let_wild_values_in() -> None:
    alias: Any = getattr(typing, "TypeAliasType")  # noqa: B009  as 'type Table = dict[str, Any]' makes it
    key: Any = typing.TypeVar("key")
    table, keyed = alias("Table", dict[str, Any]), alias("Keyed", dict[key, Any], type_params=(key,))
    for kind in (table, keyed[str], dict[str, table]):
        holding = msgspec.defstruct("Holding", [("table", kind)], bases=(Message,), frozen=True, tag="Holding/1")
        with pytest.raises(MalformedMessage, match="nan"):
            Reader(holding).read(enveloped(holding({"speed": {"at": math.nan}})))
