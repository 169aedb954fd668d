"""A translated copy of a recording, for tools that do not know this project's messages.

The recording itself stays unchanged. So recording costs nothing for other tools, and a new translation serves old
recordings, too. The copy contains each message as recorded, with its schema, so that all its numbers can be plotted.
Beside it the copy contains its translation, or only the translation if that is complete. A copy has no profile, so that
no command mistakes it for a recording.
"""

from __future__ import annotations

from typing import IO

from foxglove import Schema
from mcap.records import Channel
from mcap.records import Schema as RecordedSchema
from mcap.writer import Writer

from backbone.foxglove.well_known import ENCODING, Translations, shown_as
from backbone.recording.reader import Recording
from backbone.recording.revival import message_as_sent
from backbone.recording.writer import begun_writer
from backbone.wire import schema_of


def write_copy(recording: Recording, to: IO[bytes], translations: Translations, keys: tuple[str, ...] = ()) -> int:
    """Write the copy; return how many of its messages are in well-known schemas.

    Args:
        to: File of the copy, written from its begin; not closed.
        translations: The functions that translate messages to well-known schemas, by message class.
        keys: Only messages of keys that match one of these; none: all.

    Raises:
        NoRecording: The recording is damaged; the copy is not complete.
    """
    classes = {schema_of(kind): kind for kind in translations}
    writer = begun_writer(to, recording.contents().about, profile="")
    channels, shown = _Channels(writer), 0
    for schema, channel, message, recorded in recording.records(keys):
        at_ns = message.log_time
        views = shown_as(message_as_sent(classes, recorded), translations)
        for one in views:
            number = channels.shown(one.topic, one.message.get_schema())
            writer.add_message(number, at_ns, one.message.encode(), message.publish_time)
        shown += len(views)
        if not any(one.is_all for one in views):
            number = channels.as_recorded(channel, schema)
            writer.add_message(number, at_ns, message.data, message.publish_time, message.sequence)
    writer.finish()  # type: ignore[no-untyped-call]
    return shown


class _Channels:
    """Numbers of the channels and schemas of the copy."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._recorded: dict[int, int] = {}
        self._shown: dict[tuple[str, str], int] = {}

    def as_recorded(self, channel: Channel, schema: RecordedSchema | None) -> int:
        known = self._recorded.get(channel.id)
        if known is None:
            number = self._schema(schema.name, schema.encoding, schema.data) if schema is not None else 0
            known = self._writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
            self._recorded[channel.id] = known
        return known

    def shown(self, topic: str, schema: Schema) -> int:
        known = self._shown.get((topic, schema.name))
        if known is None:
            number = self._schema(schema.name, schema.encoding, schema.data)
            known = self._shown[topic, schema.name] = self._writer.register_channel(topic, ENCODING, number)
        return known

    def _schema(self, name: str, encoding: str, data: bytes) -> int:
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, encoding, data)
        return self._schemas[name]
