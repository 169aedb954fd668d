"""Recordings of a few messages, made for a test."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable
from typing import NamedTuple

import msgspec
from mcap.writer import Writer

from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recording
from backbone.recording.writer import ABOUT, NS, PROFILE, RecordingWriter
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


def recorded(said: Iterable[Said], mission: str = MISSION) -> io.BytesIO:
    """Return the file of a recording; the messages of each sender are numbered in their order."""
    file, numbers = io.BytesIO(), dict[str, int]()
    writer = RecordingWriter(file, CLASSES, {"mission": mission})
    for one in said:
        numbers[one.source] = numbers.get(one.source, 0) + 1
        envelope = Envelope(WIRE_VERSION, one.source, numbers[one.source], one.at_s, one.cause, one.body)
        writer.write(key_of(mission, one.address, one.conversation), write(envelope), one.at_s)
    writer.finish()
    return file


def with_clock_off(recording: Recording, sources: Collection[str], by_s: float) -> io.BytesIO:
    """Return the recording as it would be if the clock of these senders were so far ahead."""
    file = io.BytesIO()
    writer = Writer(file)
    writer.start(profile=PROFILE, library=PROFILE)
    writer.add_metadata(ABOUT, recording.contents().about)
    schemas = {0: 0}
    channels = dict[int, int]()
    for schema, channel, message, said in recording.records():
        if schema is not None and schema.id not in schemas:
            schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
        if channel.id not in channels:
            numbered = schemas[channel.schema_id]
            channels[channel.id] = writer.register_channel(
                channel.topic, channel.message_encoding, numbered, channel.metadata
            )
        off_s = by_s if said.source in sources and said.schema else 0.0
        data = message.data
        if off_s:
            data = msgspec.json.encode(msgspec.json.decode(data) | {"stamp_s": said.stamp_s + off_s})
        at_ns = message.log_time + round(off_s * NS)
        writer.add_message(channels[channel.id], at_ns, data, at_ns, message.sequence)
    writer.finish()
    return file
