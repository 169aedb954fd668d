"""The recorder writes all that is published, of the keys that are meant, until it ends or the disc is full."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorder import FLUSH_EACH_S, LEAST_FREE_BYTES, Recorder

CLASSES = message_classes()


class Disc(NamedTuple):
    free: int


def event(number: int) -> StoryEvent:
    return StoryEvent(float(number), "resource_pool/scout1", f"event {number}", "scout1", "", LogLevel.INFO)


@pytest.fixture
def recorded(tmp_path: Path, local_mission: Any, beside: Any) -> Callable[..., list[Recorded]]:
    """Return what records a scene: the scene gets a bus, the clock, and the recorder."""

    def record(scene: Any, *keys: str) -> list[Recorded]:
        path = tmp_path / "it.mcap"

        async def play() -> None:
            clock = VirtualClock()
            async with local_mission("local") as network:
                parameters = {"keys": list(keys)}
                launch = Launch(
                    "local", Subsystem.BACKBONE, "recorder", "recorder", "x:Y", "here", "", 0.0, 1.0, parameters
                )
                bus = network.join(launch.address, clock)
                with path.open("xb") as file:
                    recorder = Recorder(launch, bus, clock, file=file, path=path, classes=CLASSES, about={})
                    async with beside(recorder):
                        await clock.sleep_s(0.01)
                        await scene(network.join("resource_pool/scout1", clock), clock, recorder)

        run_virtual(play())
        with path.open("rb") as file:
            return [*Recording(file).messages()]

    return record


def test_all_publications_are_recorded_with_key_sender_and_times(recorded: Callable[..., list[Recorded]]) -> None:
    async def scene(bus: Any, clock: Any, _recorder: Recorder) -> None:
        for number in range(5):
            bus.publish(bus.source, Conversation.LOG, event(number))
            await clock.sleep_s(0.3)

    found = [one for one in recorded(scene) if one.source == "resource_pool/scout1"]
    assert [one.body["what"] for one in found] == [f"event {number}" for number in range(5)]
    assert {one.key for one in found} == {"scout/local/resource_pool/scout1/log"}
    assert [one.sequence for one in found] == [1, 2, 3, 4, 5]
    assert all(one.stamp_s <= one.at_s <= one.stamp_s + 0.01 for one in found)


def test_only_keys_that_are_meant_are_recorded(recorded: Callable[..., list[Recorded]]) -> None:
    async def scene(bus: Any, _clock: Any, _recorder: Recorder) -> None:
        bus.publish("resource_pool/scout1", Conversation.LOG, event(1))
        bus.publish("resource_pool/scout2", Conversation.LOG, event(2))
        bus.publish("resource_pool/scout2", Conversation.EVENTS, event(3))

    assert [one.body["what"] for one in recorded(scene, "resource_pool/scout2/log")] == ["event 2"]


def test_below_a_hundred_megabytes_it_ends_with_a_whole_file_and_says_so(
    recorded: Callable[..., list[Recorded]], monkeypatch: pytest.MonkeyPatch
) -> None:
    free = [LEAST_FREE_BYTES]
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: Disc(free[0]))

    async def scene(bus: Any, clock: Any, recorder: Recorder) -> None:
        bus.publish(bus.source, Conversation.LOG, event(1))
        await clock.sleep_s(2 * FLUSH_EACH_S)
        assert not recorder.is_full
        free[0] -= 1
        await clock.sleep_s(2 * FLUSH_EACH_S)
        assert recorder.is_full
        bus.publish(bus.source, Conversation.LOG, event(2))

    found = recorded(scene)
    said = [one.body["what"] for one in found if one.schema == "StoryEvent/1"]
    assert said[0] == "event 1"
    assert "event 2" not in said
