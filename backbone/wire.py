"""Structs to bytes and back, and the envelope around every message.

Every message is a frozen msgspec struct, encoded as a MessagePack array whose first element is its schema name and
version, ``<Name>/<version>``. The envelope adds the sender, its sequence number, the mission time, and the message that
led to this one (``cause``).

Rules of this file:

* An unreadable message is refused with one of four classes: too big, malformed, of an unknown schema, or of another
  version of a known schema.
* The reader returns the whole typed message or raises a refusal.
* Each field has its range (``ranges``); a value outside its range is malformed.

A change of a struct that old readers cannot read gets a new version: ``class Drive(Message, tag="Drive/2")``.
"""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Hashable, Mapping
from typing import Any, Generic, TypeVar, cast

import msgspec

from backbone.errors import Fact, Refusal, code_of, revive
from backbone.ranges import (
    LONGEST_TEXT,
    MOST_FEW,
    Count,
    Facts,
    Instant,
    Mention,
    Source,
    Text,
    Version,
    holds_values_of_any_kind,
    wildness,
)

WIRE_VERSION = 1
MAX_MESSAGE_BYTES = 8 * 1024 * 1024  # chosen: a 1080p colour frame (6.2 MB) fits, a runaway list does not
MAX_LARGE_MESSAGE_BYTES = 64 << 20  # chosen: a 4K picture in color is 25 MB; of ``LARGE`` conversations on a host
BODY = "$[5]"  # of an ``Envelope``, in a complaint of msgspec
LONGEST_QUOTED = 100  # chosen: a name and the first words of a sentence, in a refusal


class Message(
    msgspec.Struct,
    frozen=True,
    array_like=True,
    forbid_unknown_fields=True,
    tag_field="schema_and_version",
    tag=lambda name: f"{name}/1",
):
    """Base class of all messages. Derived classes repeat ``frozen=True`` for the type checker."""


Accepts = type[Message] | types.UnionType
"""The messages of one conversation: one class, or a union of classes."""
Body = TypeVar("Body", bound=Message)
Body_co = TypeVar("Body_co", bound=Message, covariant=True)


class Envelope(msgspec.Struct, Generic[Body_co], frozen=True, array_like=True, forbid_unknown_fields=True):
    """A message with its origin.

    Attributes:
        wire: Version of this envelope.
        source: Address of the sender.
        sequence: Grows by one with each message of that sender.
        stamp_s: Mission time of sending, seconds.
        cause: Id of the message that led to it; empty: a first cause.
    """

    wire: Version
    source: Source
    sequence: Count
    stamp_s: Instant
    cause: Mention
    body: Body_co

    @property
    def id(self) -> str:
        """Id of this message, unique in the mission while its sender lives: ``<source>#<sequence>``."""
        return f"{self.source}#{self.sequence}"


class Refused(Message, frozen=True):
    """A refusal as a message."""

    code: Mention
    detail: Text
    remedy: Text
    facts: Facts = {}

    @classmethod
    def of(cls, refusal: Refusal) -> Refused:
        """Return this refusal as a message."""
        facts = {name: _bounded(fact) for name, fact in list(refusal.facts.items())[:MOST_FEW]}
        return cls(code_of(refusal), refusal.detail[:LONGEST_TEXT], refusal.remedy[:LONGEST_TEXT], facts)

    def revive(self) -> Refusal:
        """Return the refusal that was sent, ready to be raised."""
        return revive(self.code, self.detail, self.remedy, self.facts)


class MalformedMessage(Refusal):
    """The bytes are no valid message of an accepted schema."""

    code = "wire.malformed"
    remedy = "Give each field a value of its declared type and range, and send all fields."


class OversizedMessage(Refusal):
    """The message is longer than its conversation admits."""

    code = "wire.oversized"
    remedy = "Send less in one message, or use another conversation; docs/reference/messages.md has the limit of each."


class UnwritableMessage(Refusal):
    """The message has a number or a text that MessagePack cannot encode.

    These are whole numbers of more than 64 bits, and texts with a lone surrogate, which Python makes of bytes that are
    not UTF-8.
    """

    code = "wire.unwritable"
    remedy = "Give a smaller number, or a text in UTF-8."


class UnknownMessage(Refusal):
    """The component does not answer messages of this schema."""

    code = "wire.unknown"
    remedy = "Ask a component that answers this message; 'facts' lists what is answered here."


class WrongVersion(Refusal):
    """The schema is known, but not its version."""

    code = "wire.version"
    remedy = "Run the same release of scout-backbone on every host; after an upgrade, bring the mission up anew."


def _bounded(fact: Fact) -> Fact:
    """Return the fact in a bounded form, because every refusal must fit a message."""
    if isinstance(fact, str):
        return fact[:LONGEST_TEXT]
    return fact if not wildness(fact) else str(fact)


_encoder = msgspec.msgpack.Encoder()
_UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)  # all that msgspec raises on bad bytes


def write(envelope: Envelope[Message], most_bytes: int = MAX_MESSAGE_BYTES) -> bytes:
    """Return the envelope as bytes.

    Raises:
        OversizedMessage: The message is longer than ``most_bytes``.
        UnwritableMessage: A whole number in it has more than 64 bits, or a text has a lone surrogate.
    """
    try:
        raw = _encoder.encode(envelope)
    except OverflowError as error:
        raise UnwritableMessage(f"{type(envelope.body).__name__} has a whole number of more than 64 bits") from error
    except UnicodeEncodeError as error:
        what = f"{type(envelope.body).__name__} has a text that is not UTF-8"
        raise UnwritableMessage(f"{what}: {error.object!a:.{LONGEST_QUOTED}}") from error
    if len(raw) > most_bytes:
        refuse_oversized(len(raw), most_bytes, type(envelope.body).__name__)
    return raw


def schema_of(kind: type[Message]) -> str:
    """Return ``<Name>/<version>`` of a message class."""
    return cast(str, kind.__struct_config__.tag)


def kinds_of(accepts: Accepts) -> tuple[type[Message], ...]:
    """Return the message classes of a union, or the one class."""
    return typing.get_args(accepts) or (accepts,)


def refuse_oversized(length: int, most_bytes: int = MAX_MESSAGE_BYTES, what: str = "message") -> None:
    """Return if a message may have this length. Call it before the bytes are copied out of the bus.

    Raises:
        OversizedMessage: The message is longer than ``most_bytes``.
    """
    if length > most_bytes:
        raise OversizedMessage(
            f"{what} of {length} bytes, but at most {most_bytes} are admitted", bytes=length, most_bytes=most_bytes
        )


def plain(value: object) -> Any:
    """Return messages, which travel as arrays, and dataclasses as dictionaries of their fields, all the way down.

    Example:
        >>> plain(Refused("link.lost", "no answer", ""))
        {'code': 'link.lost', 'detail': 'no answer', 'remedy': '', 'facts': {}}
    """
    if isinstance(value, msgspec.Struct):
        return {name: plain(getattr(value, name)) for name in value.__struct_fields__}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    return value


def naming_field(complaint: str, kind: type[Message], body: str = "$") -> str:
    """Return a complaint of msgspec about a message with the field's name in place of its number.

    Args:
        body: The place of the message in what was read.

    Example:
        >>> naming_field("Expected `str`, got `int` - at `$[1]`", Refused)
        'Expected `str`, got `int`, in code'
    """
    found = re.fullmatch(rf"(?P<what>.*) - at `{re.escape(body)}\[(?P<number>[1-9]\d*)\](?P<within>.*)`", complaint)
    if found is None or int(found["number"]) > len(kind.__struct_fields__):
        return complaint
    return f"{found['what']}, in {kind.__struct_fields__[int(found['number']) - 1]}{found['within']}"


class Reader(Generic[Body]):
    """Reads the messages of one conversation.

    Args:
        accepts: One message class, or a union of them.
    """

    def __init__(self, accepts: type[Body] | types.UnionType) -> None:
        self._kinds = {schema_of(kind): kind for kind in kinds_of(accepts)}
        self._accepted = tuple(sorted(self._kinds))
        self._decoder = msgspec.msgpack.Decoder(Envelope[accepts])  # type: ignore[valid-type]
        self._of_any_kind = frozenset(
            kind for kind in kinds_of(accepts) if holds_values_of_any_kind(cast("Hashable", kind))
        )

    def read(self, raw: bytes | memoryview, most_bytes: int = MAX_MESSAGE_BYTES) -> Envelope[Body]:
        """Return the envelope these bytes hold. Its fields of type ``memoryview`` are views of them.

        Raises:
            OversizedMessage: The message is longer than ``most_bytes``.
            WrongVersion: The envelope or the message has another version.
            UnknownMessage: The schema of the message is not accepted here.
            MalformedMessage: The message is not valid; the detail names the field.
        """
        refuse_oversized(len(raw), most_bytes)
        try:
            envelope = self._decoder.decode(raw)
        except _UNREADABLE as error:
            raise self._diagnose(raw, str(error)) from None
        if envelope.wire != WIRE_VERSION:
            raise WrongVersion(
                f"envelope version {envelope.wire}, but version {WIRE_VERSION} is expected", got=envelope.wire
            )
        if type(envelope.body) in self._of_any_kind and (wild := wildness(envelope.body)):
            schema = schema_of(type(envelope.body))
            raise MalformedMessage(f"{schema}: {wild}", schema=schema)
        return cast("Envelope[Body]", envelope)

    def _diagnose(self, raw: bytes | memoryview, complaint: str) -> Refusal:
        try:
            outer = msgspec.msgpack.decode(raw)
        except _UNREADABLE:
            return MalformedMessage(f"not MessagePack: {complaint}")
        match outer:
            case [int(version), *_] if version != WIRE_VERSION:
                return WrongVersion(f"envelope version {version}, but version {WIRE_VERSION} is expected", got=version)
            case [_, str(), int(), int() | float(), str(), [str(schema), *_]]:
                return self._diagnose_schema(schema, complaint)
            case _:
                return MalformedMessage(f"not an envelope: {complaint}")

    def _diagnose_schema(self, schema: str, complaint: str) -> Refusal:
        name, _, version = schema.partition("/")
        if kind := self._kinds.get(schema):
            return MalformedMessage(f"{schema}: {naming_field(complaint, kind, BODY)}", schema=schema)
        for known in self._accepted:
            if known.partition("/")[0] == name:
                return WrongVersion(
                    f"{name} version {version}, but version {known.partition('/')[2]} is expected", got=schema
                )
        return UnknownMessage(f"{schema} is not answered here", schema=schema, accepted=", ".join(self._accepted))
