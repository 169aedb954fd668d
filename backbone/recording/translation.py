"""Translates the bytes of a message on the bus to the form in a recording. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple, Union, cast

import msgspec
from msgspec import inspect

from backbone.bus.interface import Copies, Told
from backbone.recording.json_schema import TAG
from backbone.wire import Envelope, Message, schema_of

_UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
_PLAIN = (
    inspect.NoneType,
    inspect.BoolType,
    inspect.IntType,
    inspect.FloatType,
    inspect.StrType,
    inspect.BytesType,
    inspect.MemoryViewType,
    inspect.EnumType,
    inspect.LiteralType,
    inspect.AnyType,  # decoded as plain values
)
_UNSPEAKABLE = (TypeError, ValueError, OverflowError, RecursionError)  # what MessagePack can say, and JSON cannot


class Translated(NamedTuple):
    """A message in the form of a recording.

    Attributes:
        schema: ``<Name>/<version>``; empty: the bytes are not a message, or JSON cannot represent it.
        source: Address of the sender; empty: the bytes are no message.
        sequence: Its number among the sender's messages.
        stamp_s: Mission time of sending.
        kind: Its class; None: no installed package has it.
        data: JSON; with an empty schema, the unchanged bytes.
        size_bytes: Length on the bus.
    """

    schema: str
    source: str
    sequence: int
    stamp_s: float
    kind: type[Message] | None
    data: bytes
    size_bytes: int


class Translator:
    """Translates messages of known classes to objects with field names; other messages stay without names.

    Args:
        classes: Known message classes, by schema.
    """

    def __init__(self, classes: Mapping[str, type[Message]]) -> None:
        known: Any = Union[tuple(classes.values())]  # noqa: UP007  made at run time
        self._known: Any = msgspec.msgpack.Decoder(Envelope[known])
        self._any: Any = msgspec.msgpack.Decoder(Envelope[Any])

    def translate(self, raw: bytes, heard_s: float) -> Translated:
        """Return the translation of a message that arrived at a mission time; unreadable bytes are kept unchanged."""
        try:
            envelope = self._known.decode(raw)
        except _UNREADABLE:
            return self._unknown(raw, heard_s)
        kind = type(envelope.body)
        try:
            return _translated(envelope, schema_of(kind), kind, named(envelope.body), heard_s, len(raw))
        except _UNSPEAKABLE:
            return Translated("", envelope.source, envelope.sequence, envelope.stamp_s, None, raw, len(raw))

    def _unknown(self, raw: bytes, heard_s: float) -> Translated:
        try:
            envelope = self._any.decode(raw)
        except _UNREADABLE:
            return Translated("", "", 0, 0.0, None, raw, len(raw))
        match envelope.body:
            case [str(schema), *_]:
                with suppress(*_UNSPEAKABLE):
                    return _translated(envelope, schema, None, envelope.body, heard_s, len(raw))
        return Translated("", envelope.source, envelope.sequence, envelope.stamp_s, None, raw, len(raw))


class _Tagged(msgspec.Struct, frozen=True, array_like=True):
    schema: str


class Heading(msgspec.Struct, frozen=True, array_like=True):
    """The begin of a message: sender, number, schema. The rest is not decoded, so a long message costs little."""

    wire: int
    source: str
    sequence: int
    stamp_s: float
    cause: str
    body: _Tagged

    @property
    def schema(self) -> str:
        """``<Name>/<version>``; empty: the bytes are no message."""
        return self.body.schema


NO_HEADING = Heading(0, "", 0, 0.0, "", _Tagged(""))
_to_json = msgspec.json.Encoder().encode
_headings = msgspec.msgpack.Decoder(Heading)
_told = msgspec.msgpack.Decoder(Envelope[Told])


def heading_of(raw: bytes) -> Heading:
    """Return the begin of a message; ``NO_HEADING``: the bytes are not a message."""
    try:
        return _headings.decode(raw)
    except _UNREADABLE:
        return NO_HEADING


def copies_in(raw: bytes) -> list[Copies] | None:
    """Return the copies that these bytes hold; None if they are no copies."""
    try:
        return _told.decode(raw).body.copies
    except _UNREADABLE:
        return None


def _translated(
    envelope: Envelope[Any], schema: str, kind: type[Message] | None, body: object, heard_s: float, size_bytes: int
) -> Translated:
    sequence, stamp_s = envelope.sequence, envelope.stamp_s
    said = {"sequence": sequence, "stamp_s": stamp_s, "heard_s": heard_s, "cause": envelope.cause, "body": body}
    return Translated(schema, envelope.source, sequence, stamp_s, kind, _to_json(said), size_bytes)


def named(body: msgspec.Struct) -> dict[str, Any]:
    """Return the fields of a message by name; a message inside it has its schema beside them."""
    return {
        name: getattr(body, name) if is_plain else _value(getattr(body, name)) for name, is_plain in _fields(type(body))
    }


@cache
def _fields(kind: type[msgspec.Struct]) -> list[tuple[str, bool]]:
    """Return the names of the fields, each with True if it cannot contain a message and is written unchanged."""
    fields = cast("inspect.StructType", inspect.type_info(kind)).fields
    return [(field.name, _is_plain(field.type)) for field in fields]


def _is_plain(field: inspect.Type) -> bool:
    match field:
        case inspect.UnionType(types=inner) | inspect.TupleType(item_types=inner):
            return all(map(_is_plain, inner))
        case inspect.CollectionType(item_type=inner):
            return _is_plain(inner)
        case inspect.DictType(key_type=key, value_type=value):
            return _is_plain(key) and _is_plain(value)
    return isinstance(field, _PLAIN)


def _value(value: object) -> Any:
    if isinstance(value, msgspec.Struct):
        fields = named(value)
        return {TAG: schema_of(type(value)), **fields} if isinstance(value, Message) else fields
    if isinstance(value, list | tuple | set | frozenset):
        return [_value(each) for each in value]
    if isinstance(value, dict):
        return {name: _value(each) for name, each in value.items()}
    return value
