"""Files of a recorder that are on a slow disc, or that a person deletes meanwhile."""

from __future__ import annotations

import asyncio
import io
import os
import shutil
import threading
from pathlib import Path
from typing import Any

import pytest

from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.files import RecordingFiles
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recording
from backbone.recording.recorder import FLUSH_EACH_S, Recorder
from backbone.wire import Envelope

CLASSES = message_classes()


def event(number: int) -> StoryEvent:
    return StoryEvent(float(number), "resource_pool/scout1", f"event {number}", "scout1", "", LogLevel.INFO)


def test_a_slow_disc_does_not_delay_the_recorder_when_it_begins_a_further_file(
    tmp_path: Path, local_mission: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on, waited, sync = threading.Event(), list[bool](), os.fsync

    def slow(number: int) -> None:
        waited.append(goes_on.wait(5.0))
        sync(number)

    async def play() -> None:
        clock = MissionClock.started_now()
        async with local_mission("local") as network:
            bus = network.join("backbone/recorder", clock)
            files = RecordingFiles(tmp_path / "it.mcap")
            recorder = Recorder(bus, clock, files=files, classes=CLASSES, about={}, split_s=0.0)
            running = asyncio.create_task(recorder.run())
            async with asyncio.timeout(30.0):
                while not files.path.stem.endswith("-2"):  # noqa: ASYNC110  the recorder has no event of it
                    await asyncio.sleep(0.01)
            goes_on.set()
            recorder.end()
            await running
            await bus.close()

    monkeypatch.setattr(os, "fsync", slow)
    asyncio.run(play())
    assert all(waited), "the event loop went on while the disc was slow"
    for name in ("it.mcap", "it-2.mcap"):
        with (tmp_path / name).open("rb") as file:
            Recording(file)


def test_if_its_folder_is_deleted_it_ends_and_tells_the_loss_once(tmp_path: Path, local_mission: Any) -> None:
    folder, alarms = tmp_path / "gone", list[str]()
    folder.mkdir()

    def heard(said: Envelope[StoryEvent]) -> None:
        if said.body.level is LogLevel.ALARM:
            alarms.append(said.body.what)

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            scout.subscribe("backbone/recorder", Conversation.LOG, StoryEvent, heard)
            recorder = Recorder(bus, clock, files=RecordingFiles(folder / "it.mcap"), classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(0.01)
            scout.publish(scout.source, Conversation.LOG, event(1))
            await clock.sleep_s(2 * FLUSH_EACH_S)
            shutil.rmtree(folder)
            await running
            assert recorder.full == "No such file or directory"
            assert (recorder.deleted > 0, recorder.written) == (True, 0)
            assert alarms == [f"it.mcap was deleted while it was recorded to; {recorder.deleted} messages are lost"]
            await bus.close()

    run_virtual(play())


@pytest.mark.parametrize("is_ending", [False, True])
def test_of_a_file_that_is_deleted_the_loss_is_told_and_the_recording_goes_on(
    tmp_path: Path, local_mission: Any, is_ending: bool
) -> None:
    further = tmp_path / "it-2.mcap"
    alarms: list[str] = []

    def heard(said: Envelope[StoryEvent]) -> None:
        if said.body.level is LogLevel.ALARM:
            alarms.append(said.body.what)

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            scout.subscribe("backbone/recorder", Conversation.LOG, StoryEvent, heard)
            recorder = Recorder(bus, clock, files=RecordingFiles(tmp_path / "it.mcap"), classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(0.01)
            scout.publish(scout.source, Conversation.LOG, event(1))
            await clock.sleep_s(2 * FLUSH_EACH_S)
            if is_ending:
                recorder.end()
                await clock.sleep_s(FLUSH_EACH_S)
            (tmp_path / "it.mcap").unlink()
            await clock.sleep_s(2 * FLUSH_EACH_S)
            scout.publish(scout.source, Conversation.LOG, event(2))
            await clock.sleep_s(FLUSH_EACH_S)
            recorder.end()
            await running
            assert (recorder.deleted > 0, recorder.full) == (True, "")
            assert alarms == [f"it.mcap was deleted while it was recorded to; {recorder.deleted} messages are lost"]
            assert recorder.written == (0 if is_ending else of(further).contents().messages)
            await bus.close()

    def of(path: Path) -> Recording:
        return Recording(io.BytesIO(path.read_bytes()))

    run_virtual(play())
    assert further.exists() is not is_ending
    if not is_ending:
        said = [one.body["what"] for one in of(further).messages() if one.source == "resource_pool/scout1"]
        assert said == ["event 2"]
