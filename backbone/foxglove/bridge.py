"""Bridge: publishes the overheard messages of a live mission to viewers that speak Foxglove's websocket protocol.

No viewer can publish through it, because it offers only channels to read. Foxglove's library serves the viewers in
threads of its own. If a viewer is too slow, the library drops the oldest messages.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import foxglove
from foxglove import Channel, Context, Schema
from foxglove.websocket import ChannelView, Client, ServerListener

from backbone.foxglove.well_known import ENCODING, Translations, shown_as
from backbone.recording.json_schema import schema_json
from backbone.recording.reader import heard_now
from backbone.recording.revival import message_as_sent
from backbone.recording.translation import Translated
from backbone.recording.writer import NS, topic_of
from backbone.waiting import in_thread_within
from backbone.wire import Message, schema_of

MOST_WAITING = 512  # chosen: half of the library's; in the shipped mission some 10 s, of which pictures are 10 MB
CLOSE_WITHIN_S = 1.0  # chosen: a viewer that reads is disconnected within milliseconds; seconds of the machine
JSON = "json"


@dataclass(slots=True)
class _Newest:
    """The newest message of a channel, for viewers that subscribe later."""

    channel: Channel
    data: bytes = b""
    at_ns: int = 0


class Bridge(ServerListener):
    """Serves viewers until it is closed.

    Args:
        name: Name of the bridge in viewers.
        port: Port to listen at; 0: any free one.
        translations: The functions that translate messages to well-known schemas, by message class.

    Raises:
        RuntimeError: The port cannot be opened.
    """

    def __init__(self, name: str, host: str, port: int, translations: Translations) -> None:
        self._translations = translations
        self._classes: Mapping[str, type[Message]] = {schema_of(kind): kind for kind in translations}
        self._context = Context()
        self._channels: dict[tuple[str, str], _Newest] = {}
        self._by_number: dict[int, _Newest] = {}
        self._server = foxglove.start_server(
            name=name,
            host=host,
            port=port,
            capabilities=[],
            server_listener=self,
            context=self._context,
            message_backlog_size=MOST_WAITING,
        )

    @property
    def port(self) -> int:
        """The port at which it listens."""
        return self._server.port

    def heard(self, key: str, message: Translated, at_s: float) -> None:
        """Show a message that arrived at a mission time."""
        if not message.schema:
            return
        at_ns = max(0, round(at_s * NS))
        sent = (
            message_as_sent(self._classes, heard_now(key, message, at_s))
            if message.kind in self._translations
            else None
        )
        views = shown_as(sent, self._translations)
        for one in views:
            self._show((one.topic, ENCODING), one.message.get_schema(), one.message.encode(), at_ns)
        if not any(one.is_all for one in views):
            schema = schema_json(message.kind) if message.kind is not None else b""
            described = Schema(name=message.schema, encoding="jsonschema", data=schema)
            self._show((topic_of(key, message.schema), JSON), described, message.data, at_ns)

    async def close(self) -> None:
        """Disconnect all viewers; after ``CLOSE_WITHIN_S``, clients that do not read are left to the process's end."""
        with suppress(TimeoutError):  # the library waits for each of its clients without a limit
            await in_thread_within(self._server.stop, CLOSE_WITHIN_S)

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Send the newest message to a late viewer alone, because some messages are published only on a change.

        The sink of a viewer has the viewer's id, as long as the process has no other sinks (measured, SDK 0.30.3).
        """
        newest = self._by_number.get(channel.id)
        if newest is not None and newest.data:
            newest.channel.log(newest.data, log_time=newest.at_ns, sink_id=client.id)

    def _show(self, named: tuple[str, str], schema: Schema, data: bytes, at_ns: int) -> None:
        newest = self._channels.get(named)
        if newest is None:
            topic, encoding = named
            channel = Channel(topic, schema=schema, message_encoding=encoding, context=self._context)
            newest = self._channels[named] = self._by_number[channel.id()] = _Newest(channel)
        newest.data, newest.at_ns = data, at_ns
        newest.channel.log(data, log_time=at_ns)
