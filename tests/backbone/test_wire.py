"""Laws of the wire: a written message is read again; all other bytes are refused, by class."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hostile_messages import SOURCE, Hostile, enveloped, flipped, honest, hostile_messages
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import AskState, CommonQuestion, SetParameter, Stop, Story, StoryEvent
from backbone.errors import Refusal
from backbone.wire import (
    MAX_MESSAGE_BYTES,
    WIRE_VERSION,
    Envelope,
    MalformedMessage,
    Message,
    OversizedMessage,
    Reader,
    Refused,
    UnknownMessage,
    UnwritableMessage,
    WrongVersion,
    kinds_of,
    schema_of,
    write,
)

FOUR_REFUSALS = (MalformedMessage, OversizedMessage, UnknownMessage, WrongVersion)


@pytest.mark.parametrize("number", [10**20, -(10**20)])
def test_a_number_that_no_message_can_say_is_refused_with_a_remedy(number: int) -> None:
    with pytest.raises(UnwritableMessage, match="SetParameter has a whole number") as refused:
        write(Envelope(WIRE_VERSION, SOURCE, 1, 0.0, "", SetParameter("rounds", number, "a test")))
    assert refused.value.remedy


@pytest.mark.parametrize("word", ["w\udcffchter", "\ud800", "a" * 300_000 + "\udcff"], ids=["name", "half", "long"])
def test_a_text_that_no_message_can_say_is_refused_with_a_remedy(word: str) -> None:
    """Python reads such a text from a command line, a file name or JSON."""
    with pytest.raises(UnwritableMessage, match="Stop has a text that is not UTF-8") as refused:
        write(Envelope(WIRE_VERSION, SOURCE, 1, 0.0, "", Stop(word)))
    assert "UTF-8" in refused.value.remedy
    write(Envelope(WIRE_VERSION, SOURCE, 1, 0.0, "", Refused.of(refused.value)))


class Sighting(Message, frozen=True, tag="Sighting/3"):
    """A message of a later version than the first."""

    robot: str
    pixels: memoryview


text = st.text(max_size=50)
numbers = st.integers(-(2**63), 2**63 - 1)
reals = st.floats(-1e18, 1e18)
instants = st.floats(-86_400, 1e12)
counts = st.integers(0, 2**53)
values = st.recursive(
    st.none() | st.booleans() | numbers | reals | text | st.binary(max_size=50),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(text, inner, max_size=4),
    max_leaves=20,
)
events = st.builds(StoryEvent, instants, text, text, text, text)
messages = (
    st.just(AskState())
    | st.builds(SetParameter, text, values, text)
    | st.builds(Stop, text)
    | st.builds(Story, st.lists(events, max_size=5))
)
envelopes = st.builds(Envelope, st.just(WIRE_VERSION), text, counts, instants, text, messages)
reader: Reader[Any] = Reader(CommonQuestion | Story)


@given(envelopes)
def test_what_is_written_is_read_again(envelope: Envelope[Any]) -> None:
    assert reader.read(write(envelope)) == envelope


@given(envelopes, st.integers(0))
def test_a_flipped_bit_gives_a_message_or_one_of_four_refusals(envelope: Envelope[Any], bit: int) -> None:
    read_or_be_refused(flipped(write(envelope), bit))


@given(envelopes, st.integers(1))
def test_a_truncated_message_is_malformed(envelope: Envelope[Any], cut: int) -> None:
    whole = write(envelope)
    with pytest.raises(MalformedMessage):
        reader.read(whole[: cut % len(whole)])


@given(st.binary(max_size=300))
def test_random_bytes_give_one_of_four_refusals(raw: bytes) -> None:
    read_or_be_refused(raw)


@given(values)
def test_well_formed_nonsense_gives_one_of_four_refusals(value: Any) -> None:
    for raw in (msgspec.msgpack.encode(value), enveloped(value)):
        with pytest.raises(FOUR_REFUSALS):
            reader.read(raw)


@given(st.binary(max_size=60))
def test_raw_bytes_inside_a_free_value_give_a_message_or_one_of_four_refusals(raw: bytes) -> None:
    head = enveloped(None)[:-1]
    read_or_be_refused(head + b"\x94\xaeSetParameter/1\xa1n" + raw + b"\xa0")


@pytest.mark.parametrize("hostile", list(hostile_messages()), ids=lambda hostile: hostile.name)
def test_each_hostile_message_is_refused_as_what_it_is(hostile: Hostile) -> None:
    with pytest.raises(Refusal) as refused:
        reader.read(hostile.payload)
    assert type(refused.value) is hostile.refusal
    assert refused.value.detail
    write(Envelope(WIRE_VERSION, "here", 1, 0.0, "", Refused.of(refused.value)))


def test_a_refusal_of_a_version_names_both() -> None:
    with pytest.raises(WrongVersion, match="Stop version 2, but version 1 is expected"):
        reader.read(enveloped(["Stop/2", ""]))
    with pytest.raises(WrongVersion, match="envelope version 7, but version 1 is expected"):
        reader.read(enveloped(AskState(), wire=7))


def test_a_refusal_of_an_unknown_schema_lists_what_is_answered() -> None:
    with pytest.raises(UnknownMessage) as refused:
        Reader(AskState | Stop).read(honest(SetParameter("a", 1)))
    assert refused.value.facts == {"schema": "SetParameter/1", "accepted": "AskState/1, Stop/1"}


def test_a_malformed_message_of_a_known_schema_is_told_where() -> None:
    with pytest.raises(MalformedMessage, match="Stop/1: Expected `str`, got `int`, in reason "):
        reader.read(enveloped(["Stop/1", 5]))


def test_a_malformed_value_inside_a_field_is_told_by_its_place_there() -> None:
    event = ["StoryEvent/1", 1.0, 7, "moved", "scout1", "", "info", ""]
    with pytest.raises(MalformedMessage, match=r"Story/1: Expected `str`, got `int`, in events\[0\]\[2\] "):
        Reader(Story).read(enveloped(["Story/1", [event]]))


def test_the_longest_message_passes_and_one_byte_more_does_not() -> None:
    overhead = len(honest(Sighting("scout1", memoryview(bytes(100_000))))) - 100_000
    longest = honest(Sighting("scout1", memoryview(bytes(MAX_MESSAGE_BYTES - overhead))))
    assert len(longest) == MAX_MESSAGE_BYTES
    assert Reader(Sighting).read(longest).source == SOURCE
    with pytest.raises(OversizedMessage):
        honest(Sighting("scout1", memoryview(bytes(MAX_MESSAGE_BYTES - overhead + 1))))


def test_a_message_says_its_schema_and_version() -> None:
    assert schema_of(AskState) == "AskState/1"
    assert schema_of(Sighting) == "Sighting/3"
    assert msgspec.msgpack.decode(honest(AskState())) == [WIRE_VERSION, SOURCE, 1, 0.5, "", ["AskState/1"]]
    assert kinds_of(AskState | Stop) == (AskState, Stop)
    assert kinds_of(AskState) == (AskState,)


def test_pixels_are_read_without_a_copy() -> None:
    raw = honest(Sighting("scout1", memoryview(bytes(range(256)))))
    sighting = Reader(Sighting).read(raw).body
    assert bytes(sighting.pixels) == bytes(range(256))
    assert sighting.pixels.obj is raw


def read_or_be_refused(raw: bytes) -> None:
    try:
        assert isinstance(reader.read(raw), Envelope)
    except FOUR_REFUSALS as refusal:
        assert refusal.detail  # noqa: PT017  whether it is refused is not the point here
