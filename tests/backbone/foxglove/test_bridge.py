"""A viewer sees what is said as it is said, and the newest message of each topic when it comes; it can say nothing."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from free_ports import free_port
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from backbone.foxglove.bridge import CLOSE_WITHIN_S, Bridge
from backbone.foxglove.well_known import installed
from backbone.recording.known_messages import message_classes
from backbone.recording.translation import Translator
from backbone.waiting import in_thread_within
from backbone.wire import WIRE_VERSION, Envelope, Message, write
from resource_pool.messages import Frame, Readings

TRANSLATOR = Translator(message_classes())
READINGS = "scout/night/resource_pool/scout1/readings"
FRAMES = "scout/night/resource_pool/watch-capture/frames"
_HEAD = struct.Struct("<BIQ")  # Foxglove's websocket protocol, message data: opcode 1, subscription, nanoseconds


@dataclass
class Viewer:
    """A client of the protocol, by the letter of its specification."""

    link: ClientConnection
    channels: dict[str, dict[str, Any]] = field(default_factory=dict)
    info: dict[str, Any] = field(default_factory=dict)
    complaints: list[str] = field(default_factory=list)

    async def subscribe(self, topic: str) -> None:
        while topic not in self.channels:
            await self._take()
        number = self.channels[topic]["id"]
        wanted = {"op": "subscribe", "subscriptions": [{"id": number, "channelId": number}]}
        await self.link.send(json.dumps(wanted))

    async def say(self, word: dict[str, Any]) -> None:
        await self.link.send(json.dumps(word))

    async def data(self) -> tuple[float, bytes]:
        """Return time and bytes of the next message."""
        while True:
            got = await self._take()
            if got is not None:
                opcode, _subscription, at_ns = _HEAD.unpack_from(got)
                assert opcode == 1
                return at_ns / 1e9, got[_HEAD.size :]

    async def complaint(self) -> str:
        while not self.complaints:
            await self._take()
        return self.complaints.pop()

    async def _take(self) -> bytes | None:
        got = await self.link.recv()
        if isinstance(got, bytes):
            return got
        said = json.loads(got)
        match said["op"]:
            case "serverInfo":
                self.info = said
            case "advertise":
                self.channels |= {channel["topic"]: channel for channel in said["channels"]}
            case "status":
                self.complaints.append(said["message"])
        return None


@asynccontextmanager
async def viewing(port: int) -> AsyncIterator[Viewer]:
    async with connect(f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol("foxglove.sdk.v1")]) as link:
        yield Viewer(link)


@pytest.fixture
async def bridge() -> AsyncIterator[Bridge]:
    made = Bridge("night", "127.0.0.1", free_port(), installed())
    yield made
    await made.close()


def hear(bridge: Bridge, key: str, message: Message, at_s: float) -> None:
    raw = write(Envelope(WIRE_VERSION, "resource_pool/it", 1, at_s, "", message))
    bridge.heard(key, TRANSLATOR.translate(raw, at_s), at_s)


async def test_messages_come_as_they_are_said_with_their_schemas(bridge: Bridge) -> None:
    topic = "/resource_pool/scout1/readings/Readings"
    hear(bridge, READINGS, Readings("scout1", 1.0, {"battery_share": 0.5}), 1.0)
    async with viewing(bridge.port) as viewer:
        await viewer.subscribe(topic)
        at_s, first = await viewer.data()
        assert (at_s, json.loads(first)["body"]["values"]) == (1.0, {"battery_share": 0.5}), "the newest one, at once"
        hear(bridge, READINGS, Readings("scout1", 2.0, {"battery_share": 0.25}), 2.0)
        at_s, second = await viewer.data()
        assert (at_s, json.loads(second)["body"]["values"]) == (2.0, {"battery_share": 0.25})
        channel = viewer.channels[topic]
        assert (channel["encoding"], channel["schemaName"]) == ("json", "Readings/1")
        assert json.loads(channel["schema"])["title"] == "Readings/1"
        assert viewer.info["capabilities"] == []


async def test_a_picture_comes_as_foxglove_shows_it_and_only_so(bridge: Bridge) -> None:
    pixels = bytes(range(6))
    hear(bridge, FRAMES, Frame("grabber", "watch-capture", 1, "scout1", 7, 2.5, 3, 2, memoryview(pixels)), 2.5)
    async with viewing(bridge.port) as viewer:
        await viewer.subscribe("/robots/scout1/camera")
        _at_s, raw = await viewer.data()
        image = RawImage.FromString(raw)
        assert (image.width, image.height, image.data) == (3, 2, pixels)
        assert set(viewer.channels) == {"/robots/scout1/camera"}


async def test_who_watches_can_say_nothing(bridge: Bridge) -> None:
    hear(bridge, READINGS, Readings("scout1", 1.0, {}), 1.0)
    async with viewing(bridge.port) as viewer:
        said = {"id": 1, "topic": "/resource_pool/scout1/ask", "encoding": "json", "schemaName": "Halt/1"}
        await viewer.say({"op": "advertise", "channels": [said]})
        assert "clientPublish" in await viewer.complaint()


async def test_a_client_that_says_nothing_delays_the_end_by_seconds_at_most() -> None:
    bridge = Bridge("night", "127.0.0.1", free_port(), installed())
    with socket.create_connection(("127.0.0.1", bridge.port)):
        async with viewing(bridge.port):
            pass  # the bridge accepts clients in the order in which they come
        await in_thread_within(lambda: asyncio.run(bridge.close()), 5 * CLOSE_WITHIN_S)  # a hang is a failure, no hang


async def test_bytes_that_are_no_message_are_not_shown_and_unknown_ones_have_no_schema(bridge: Bridge) -> None:
    bridge.heard(READINGS, TRANSLATOR.translate(b"nonsense", 1.0), 1.0)
    unknown = Translator({"Readings/1": Readings})
    raw = write(
        Envelope(WIRE_VERSION, "resource_pool/it", 1, 1.0, "", Frame("g", "a", 1, "r", 7, 1.0, 0, 0, memoryview(b"")))
    )
    bridge.heard(FRAMES, unknown.translate(raw, 1.0), 1.0)
    async with viewing(bridge.port) as viewer:
        await viewer.subscribe("/resource_pool/watch-capture/frames/Frame")
        await viewer.data()
        assert [channel["schema"] for channel in viewer.channels.values()] == [""]


async def test_a_viewer_that_subscribes_again_and_again_sends_nothing_to_the_others(bridge: Bridge) -> None:
    topic = "/resource_pool/scout1/readings/Readings"
    hear(bridge, READINGS, Readings("scout1", 1.0, {"battery_share": 0.5}), 1.0)
    async with viewing(bridge.port) as calm, viewing(bridge.port) as restless:
        await calm.subscribe(topic)
        assert (await calm.data())[0] == 1.0
        for _time in range(3):
            await restless.subscribe(topic)
            assert (await restless.data())[0] == 1.0
            await restless.say({"op": "unsubscribe", "subscriptionIds": [restless.channels[topic]["id"]]})
        hear(bridge, READINGS, Readings("scout1", 2.0, {"battery_share": 0.25}), 2.0)
        assert (await calm.data())[0] == 2.0
