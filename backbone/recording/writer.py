"""Writer: writes messages of the bus into one MCAP file, with a channel for each key, sender and schema.

Times are mission time of sending, nanoseconds. Readers order by ``log_time``. Therefore they yield the messages of each
sender in its order, although the bus delivers urgent ones first. ``heard_s`` beside the body is the time of arrival at
the recorder. Flushed messages survive the recorder's death, see ``reader.recover``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import IO

import msgspec
from mcap.writer import CompressionType, Writer

from backbone.keys import Conversation
from backbone.recording.hearing import Hearing
from backbone.recording.json_schema import schema_json
from backbone.recording.translation import Translated
from backbone.wire import Message

PROFILE = "scout-backbone"
ABOUT = "mission"
"""Name of the metadata about the mission."""
NS = 1_000_000_000
CHUNK_BYTES = 256 * 1024  # chosen: a chunk is written well before the next flush, and still compresses
MOST_AHEAD_S = 60.0  # chosen: larger than any difference of clocks with which a mission works
MOST_CHANNELS = 60_000  # MCAP specification, op 0x04: id is a uint16; the rest is for channels of any sender
MOST_SEQUENCE = 2**32  # MCAP specification, op 0x05: sequence is a uint32
MOST_ASKED = 4096  # chosen: all questions of some seconds; mostly both copies of a question come within less
MIME_XML = "application/xml"
_ASK = f"/{Conversation.ASK}"


class RecordingWriter:
    """Writes one recording.

    Args:
        file: Written from its begin; not closed.
        classes: Known message classes, by schema.
        about: Facts about the mission, for people and programs.
        keys: Patterns of the keys to write, see ``is_meant``; empty: all.
        mission_xml: The mission file; empty: not known.
    """

    def __init__(
        self,
        file: IO[bytes],
        classes: Mapping[str, type[Message]],
        about: Mapping[str, str],
        keys: Sequence[str] = (),
        mission_xml: str = "",
    ) -> None:
        self._writer = begun_writer(file, about, mission_xml)
        self._hearing = Hearing(classes, keys)
        self._schemas: dict[type[Message], int] = {}
        self._channels: dict[tuple[str, str, str], int] = {}
        self._asked: dict[tuple[str, int, float], None] = {}
        self._begin_s, self._end_s, self._is_finished = -math.inf, math.inf, False
        self.written = 0
        """Number of messages so far."""

    def write(self, key: str, raw: bytes, at_s: float) -> None:
        """Add bytes that arrived at a mission time, if their key is selected and they were sent in time."""
        for said_at, message in self._hearing.heard(key, raw, at_s):
            self._write(said_at, message, at_s)

    def begin_at(self, at_s: float) -> None:
        """From now on skip messages sent before this mission time."""
        self._begin_s = at_s

    def end_at(self, at_s: float) -> None:
        """From now on skip messages sent after this mission time; earlier ones may still arrive."""
        self._end_s = at_s

    def _write(self, key: str, message: Translated, at_s: float) -> None:
        # A question comes with its answer, maybe hours later; but nothing is sent before the mission begins.
        is_credible = message.source and -MOST_AHEAD_S <= message.stamp_s <= at_s + MOST_AHEAD_S
        sent_s = message.stamp_s if is_credible else at_s
        if not self._begin_s <= sent_s <= self._end_s:
            return
        if key.endswith(_ASK) and self._was_written(message):
            return
        channel, data = self._channel_and_data(key, message)
        sent_ns = max(0, round(sent_s * NS))
        self._writer.add_message(
            channel_id=channel,
            log_time=sent_ns,
            publish_time=sent_ns,
            sequence=message.sequence % MOST_SEQUENCE,
            data=data,
        )
        self.written += 1

    def _was_written(self, message: Translated) -> bool:
        """Return whether this question or answer was written before.

        Asker and answerer both send a copy of a question whose answer was lost or late.
        """
        own = message.source, message.sequence, message.stamp_s
        if own in self._asked:
            return True
        if message.source:  # else the bytes are no message
            self._asked[own] = None
        if len(self._asked) > MOST_ASKED:
            del self._asked[next(iter(self._asked))]
        return False

    def flush(self) -> None:
        """Hand all messages so far to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index, which lets readers begin anywhere; afterwards nothing more can be written. Idempotent."""
        if not self._is_finished:
            self._is_finished = True
            self._writer.finish()  # type: ignore[no-untyped-call]

    def _channel_and_data(self, key: str, message: Translated) -> tuple[int, bytes]:
        """Return the number of the message's channel, and its data; if channels are scarce, with key and sender."""
        named = (key, message.source, message.schema)
        known = self._channels.get(named)
        if known is not None:
            return known, message.data
        if len(self._channels) < MOST_CHANNELS:
            return self._new_channel(*named, message.kind), message.data
        shared = self._channels.get(("", "", message.schema)) or self._new_channel("", "", message.schema, message.kind)
        if not message.schema:
            return shared, message.data
        data = msgspec.json.decode(message.data) | {"key": key, "source": message.source}
        return shared, msgspec.json.encode(data)

    def _new_channel(self, key: str, source: str, schema: str, kind: type[Message] | None) -> int:
        about = {"key": key, "source": source, "schema": schema}
        number = self._schema(kind) if kind is not None else 0
        made = self._writer.register_channel(topic_of(key, schema), "json" if schema else "", number, about)
        self._channels[key, source, schema] = made
        return made

    def _schema(self, kind: type[Message]) -> int:
        known = self._schemas.get(kind)
        if known is None:
            name = kind.__struct_config__.tag
            known = self._schemas[kind] = self._writer.register_schema(str(name), "jsonschema", schema_json(kind))
        return known


def begun_writer(
    file: IO[bytes], about: Mapping[str, str] | None = None, mission_xml: str = "", profile: str = PROFILE
) -> Writer:
    """Return a writer of a recording that has begun.

    Args:
        about: Facts about the mission; None: they are not known yet.
        mission_xml: The mission file; empty: not known.
        profile: Of another kind of file, which is no recording.
    """
    writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile=profile, library=PROFILE)
    if about is not None:
        writer.add_metadata(ABOUT, dict(about))
    if mission_xml:
        writer.add_attachment(0, 0, "mission.xml", MIME_XML, mission_xml.encode())
    return writer


def topic_of(key: str, schema: str) -> str:
    """Return the topic of messages of a schema at a key, as other tools show it.

    Example:
        >>> topic_of("scout/night/resource_pool/scout1/readings", "Readings/1")
        '/resource_pool/scout1/readings/Readings'
    """
    path = "/".join(key.split("/")[2:])
    return f"/{path}/{schema.partition('/')[0]}".replace("//", "/").rstrip("/")
