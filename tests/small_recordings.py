"""Recordings of a few messages, made for a test."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import NamedTuple

from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.recording.known_messages import message_classes
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, Message, write

CLASSES = message_classes()
MISSION = "night"
SCOUT = "resource_pool/scout1"


class Said(NamedTuple):
    at_s: float
    address: str
    conversation: Conversation
    body: Message
    source: str = SCOUT
    cause: str = ""


def recorded(said: Iterable[Said]) -> io.BytesIO:
    """Return the file of a recording; the messages of each sender are numbered in their order."""
    file, numbers = io.BytesIO(), dict[str, int]()
    writer = RecordingWriter(file, CLASSES, {"mission": MISSION})
    for one in said:
        numbers[one.source] = numbers.get(one.source, 0) + 1
        envelope = Envelope(WIRE_VERSION, one.source, numbers[one.source], one.at_s, one.cause, one.body)
        writer.write(key_of(MISSION, one.address, one.conversation), write(envelope), one.at_s)
    writer.finish()
    return file
