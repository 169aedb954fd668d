"""Messages no honest component sends, by name, each with the refusal it must meet.

For every queryable: none of these may crash it, change anything in it, or stay unanswered.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from backbone.component.messages import AskState, SetParameter
from backbone.errors import Refusal
from backbone.wire import (
    MAX_MESSAGE_BYTES,
    WIRE_VERSION,
    Envelope,
    MalformedMessage,
    Message,
    OversizedMessage,
    Refused,
    UnknownMessage,
    WrongVersion,
    write,
)

SOURCE = "ui_console/hostile"


class Hostile(NamedTuple):
    """One bad message.

    Attributes:
        name: What is bad about it.
        payload: The bytes to send.
        refusal: Class of the refusal that must come back.
    """

    name: str
    payload: bytes
    refusal: type[Refusal]


class NeverDefined(Message, frozen=True):
    """A message that no component answers."""


def enveloped(body: object, *, wire: object = WIRE_VERSION, more: tuple[object, ...] = ()) -> bytes:
    """Return an envelope around anything, honest or not."""
    return msgspec.msgpack.encode([wire, SOURCE, 1, 0.5, "", body, *more])


def honest(question: Message) -> bytes:
    """Return the question as an honest component would send it."""
    return write(Envelope(WIRE_VERSION, SOURCE, 1, 0.5, "", question))


def hostile_messages(seed: int = 0) -> Iterator[Hostile]:
    """Yield bad messages, the same for the same seed. None is a readable question of any component."""
    question = honest(AskState())
    before_body = enveloped(None)[:-1]
    yield Hostile("nothing", b"", MalformedMessage)
    yield Hostile("one zero byte", b"\x00", MalformedMessage)
    yield Hostile("text", b"state, please", MalformedMessage)
    yield Hostile("JSON", msgspec.json.encode({"ask": "state"}), MalformedMessage)
    for length in range(1, len(question)):
        yield Hostile(f"truncated after {length} bytes", question[:length], MalformedMessage)
    yield Hostile("bytes behind its end", question + b"\x00", MalformedMessage)
    yield Hostile("said twice", question + question, MalformedMessage)
    dice = random.Random(seed)
    for number in range(20):
        yield Hostile(f"random bytes {number}", b"\xc1" + dice.randbytes(dice.randrange(1, 200)), MalformedMessage)
    yield Hostile("envelope of version 0", enveloped(AskState(), wire=0), WrongVersion)
    yield Hostile("envelope of a later version", enveloped(AskState(), wire=WIRE_VERSION + 1), WrongVersion)
    yield Hostile("longer envelope of a later version", enveloped(AskState(), wire=9, more=("x",)), WrongVersion)
    yield Hostile("envelope with one field more", enveloped(AskState(), more=("x",)), MalformedMessage)
    yield Hostile("envelope version of the wrong type", enveloped(AskState(), wire="one"), MalformedMessage)
    yield Hostile("body without an envelope", msgspec.msgpack.encode(AskState()), MalformedMessage)
    yield Hostile("no body", enveloped(None), MalformedMessage)
    yield Hostile("empty body", enveloped([]), MalformedMessage)
    yield Hostile("a map as body", enveloped({"Stop/1": 1}), MalformedMessage)
    yield Hostile("a number for a schema", enveloped([7]), MalformedMessage)
    yield Hostile("a schema nobody knows", enveloped(NeverDefined()), UnknownMessage)
    yield Hostile("a refusal asked as a question", enveloped(Refused("a", "b", "c")), UnknownMessage)
    yield Hostile("an empty schema", enveloped([""]), UnknownMessage)
    yield Hostile("a schema of another version", enveloped(["AskState/2"]), WrongVersion)
    yield Hostile("a stop of another version", enveloped(["Stop/2", "now"]), WrongVersion)
    yield Hostile("a schema without a version", enveloped(["Stop"]), WrongVersion)
    yield Hostile("a field of the wrong type", enveloped(["Stop/1", 5]), MalformedMessage)
    yield Hostile("a field too many", enveloped(["Stop/1", "now", "", "and again"]), MalformedMessage)
    yield Hostile("a field missing", enveloped(["SetParameter/1"]), MalformedMessage)
    yield Hostile("text that is no UTF-8", before_body + b"\x92\xa6Stop/1\xa2\xff\xfe", MalformedMessage)
    yield Hostile("a schema that is no UTF-8", before_body + b"\x91\xa2\xff\xfe", MalformedMessage)
    yield Hostile("lists in lists in lists", b"\x91" * 1_000_000, MalformedMessage)
    yield Hostile("a value nested too deep", _with_value(b"\x91" * 100_000 + b"\xc0"), MalformedMessage)
    yield Hostile("a map for a key", _with_value(b"\x81\x80\xc0"), MalformedMessage)
    yield Hostile("a time that never was", _with_value(b"\xd7\xff" + b"\xff" * 8), MalformedMessage)
    yield Hostile("a list said to have 4 billion elements", _with_value(b"\xdd\xff\xff\xff\xff"), MalformedMessage)
    yield Hostile("a map said to have 4 billion elements", _with_value(b"\xdf\xff\xff\xff\xff"), MalformedMessage)
    yield Hostile("bytes said to be 4 billion long", _with_value(b"\xc6\xff\xff\xff\xff"), MalformedMessage)
    yield Hostile("one byte too long", _oversized(), OversizedMessage)


def flipped(payload: bytes, bit: int) -> bytes:
    """Return the payload with one bit turned over."""
    place, bit_in_byte = divmod(bit % (len(payload) * 8), 8)
    return payload[:place] + bytes([payload[place] ^ 1 << bit_in_byte]) + payload[place + 1 :]


def _with_value(value: bytes) -> bytes:
    """Return a ``SetParameter`` whose value is these raw bytes."""
    whole = honest(SetParameter("speed", None))
    return whole.replace(b"speed\xc0", b"speed" + value)


def _oversized() -> bytes:
    head = enveloped(None)[:-1] + b"\x92\xa6Stop/1\xdb"
    length = MAX_MESSAGE_BYTES + 1 - len(head) - 4
    return head + struct.pack(">I", length) + b"x" * length
