"""Writer: messages of the bus into one MCAP file, a channel for each key, sender and schema.

Times are mission time, nanoseconds: ``log_time`` when the recorder got the message, ``publish_time`` when its sender
sent it. What was flushed outlives the recorder's death, see ``reader.recover``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO

from mcap.writer import CompressionType, Writer

from backbone.recording.json_schema import schema_json
from backbone.recording.translation import Translated, Translator
from backbone.wire import Message

PROFILE = "scout-backbone"
ABOUT = "mission"
"""Name of the metadata about the mission."""
NS = 1_000_000_000
CHUNK_BYTES = 256 * 1024  # chosen: a chunk is written well before the next flush, and still compresses
MOST_SEQUENCE = 2**32  # MCAP specification, op 0x05: sequence is a uint32
MIME_XML = "application/xml"


class RecordingWriter:
    """Writes one recording.

    Args:
        file: Written from its beginning; not closed.
        classes: Known message classes, by schema.
        about: Facts about the mission, for people and programs.
        mission_xml: Its file; empty: not known.
    """

    def __init__(
        self,
        file: IO[bytes],
        classes: Mapping[str, type[Message]],
        about: Mapping[str, str],
        mission_xml: str = "",
    ) -> None:
        self._writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._translator = Translator(classes)
        self._schemas: dict[type[Message], int] = {}
        self._channels: dict[tuple[str, str, str], int] = {}
        self.written = 0
        """Messages so far."""
        self._writer.start(profile=PROFILE, library=PROFILE)
        self._writer.add_metadata(ABOUT, dict(about))
        if mission_xml:
            self._writer.add_attachment(0, 0, "mission.xml", MIME_XML, mission_xml.encode())

    def write(self, key: str, raw: bytes, at_s: float) -> None:
        """Add a message as it came over the bus at a mission time."""
        message = self._translator.translate(raw)
        at_ns = _ns(at_s)
        self._writer.add_message(
            channel_id=self._channel(key, message),
            log_time=at_ns,
            publish_time=_ns(message.stamp_s) if message.source else at_ns,
            sequence=message.sequence % MOST_SEQUENCE,
            data=message.data,
        )
        self.written += 1

    def flush(self) -> None:
        """Hand everything so far to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index, which lets readers begin anywhere; nothing can be written afterwards."""
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _channel(self, key: str, message: Translated) -> int:
        named = (key, message.source, message.schema)
        known = self._channels.get(named)
        if known is not None:
            return known
        path = "/".join(key.split("/")[2:])
        topic = f"/{path}/{message.schema.partition('/')[0]}".rstrip("/")
        schema = self._schema(message.kind) if message.kind is not None else 0
        about = {"key": key, "source": message.source, "schema": message.schema}
        made = self._writer.register_channel(topic, "json" if message.schema else "", schema, about)
        self._channels[named] = made
        return made

    def _schema(self, kind: type[Message]) -> int:
        known = self._schemas.get(kind)
        if known is None:
            name = kind.__struct_config__.tag
            known = self._schemas[kind] = self._writer.register_schema(str(name), "jsonschema", schema_json(kind))
        return known


def _ns(at_s: float) -> int:
    return max(0, round(at_s * NS))
