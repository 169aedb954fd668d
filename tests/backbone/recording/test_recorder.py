"""The recorder writes all that is published, of the keys that are meant, until it ends or the disc is full."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.messages import (
    AskParameters,
    AskState,
    AskStory,
    AskTime,
    ComponentState,
    LifeState,
    LogLevel,
    MissionTime,
    Parameters,
    Story,
    StoryEvent,
)
from backbone.keys import Conversation
from backbone.nameserver.messages import Components, ListComponents
from backbone.recording.files import RecordingFiles
from backbone.recording.known_messages import message_classes
from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorder import FLUSH_EACH_S, LEAST_FREE_BYTES, Recorder
from backbone.recording.restoring import mission_at
from backbone.wire import Envelope

CLASSES = message_classes()


class Disc(NamedTuple):
    free: int


def event(number: int) -> StoryEvent:
    return StoryEvent(float(number), "resource_pool/scout1", f"event {number}", "scout1", "", LogLevel.INFO)


@pytest.fixture
def recorded(tmp_path: Path, local_mission: Any) -> Callable[..., list[Recorded]]:
    """Return what records a scene: the scene gets a bus, the clock, and the recorder."""

    def record(scene: Any, *keys: str) -> list[Recorded]:
        path = tmp_path / "it.mcap"

        async def play() -> None:
            clock = VirtualClock()
            async with local_mission("local") as network:
                bus = network.join("backbone/recorder", clock)
                files = RecordingFiles(path)
                recorder = Recorder(bus, clock, files=files, classes=CLASSES, about={}, keys=keys)
                begun = asyncio.Event()
                running = asyncio.create_task(recorder.run(begun.set))
                await begun.wait()
                await scene(network.join("resource_pool/scout1", clock), clock, recorder)
                recorder.end()
                await running
                await bus.close()

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
    assert all(one.stamp_s <= one.heard_s <= one.stamp_s + 0.01 for one in found)


def test_what_senders_send_while_they_learn_of_the_recorder_is_left_out(tmp_path: Path, local_mission: Any) -> None:
    """A sender that knows only some of the subscriptions sends only some of its messages, as if others were lost."""

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            files = RecordingFiles(tmp_path / "it.mcap")
            recorder = Recorder(bus, clock, files=files, classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            for number in range(100):
                await clock.sleep_s(0.01)
                scout.publish(scout.source, Conversation.LOG, event(number))
            recorder.end()
            await running
            await bus.close()

    run_virtual(play())
    with (tmp_path / "it.mcap").open("rb") as file:
        found = [one.body["at_s"] for one in Recording(file).messages() if one.source == "resource_pool/scout1"]
    assert found == [float(number) for number in range(int(found[0]), 100)]
    assert found[0] >= 10, "the first tenth of a second is left out"


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
        assert not recorder.full
        free[0] -= 1
        await clock.sleep_s(2 * FLUSH_EACH_S)
        assert "100 MB" in recorder.full
        bus.publish(bus.source, Conversation.LOG, event(2))

    found = recorded(scene)
    said = [one.body["what"] for one in found if one.source == "resource_pool/scout1"]
    assert said == ["event 1"]


def test_what_is_never_dropped_and_questions_are_recorded_from_their_copies(
    recorded: Callable[..., list[Recorded]],
) -> None:
    async def answer(asked: Envelope[Any]) -> Story:
        return Story([event(asked.body.subject == "scout1")])

    async def scene(bus: Any, clock: Any, _recorder: Recorder) -> None:
        bus.serve(bus.source, AskStory, answer)
        bus.publish(bus.source, Conversation.EVENTS, event(1))
        await bus.ask(bus.source, AskStory("scout1"), Story, within_s=1.0)
        bus.publish(bus.source, Conversation.LOG, event(2))
        await clock.sleep_s(0.1)

    found = [one for one in recorded(scene) if one.source == "resource_pool/scout1"]
    assert [(one.sequence, one.key.rpartition("/")[2], one.schema) for one in found] == [
        (1, "events", "StoryEvent/1"),
        (2, "ask", "AskStory/1"),
        (3, "ask", "Story/1"),
        (4, "log", "StoryEvent/1"),
    ]
    assert found[2].cause == found[1].id
    assert missing_numbers(found) == {}


def test_of_keys_that_are_meant_copies_count_by_what_they_copy(recorded: Callable[..., list[Recorded]]) -> None:
    async def scene(bus: Any, clock: Any, _recorder: Recorder) -> None:
        bus.publish("resource_pool/scout1", Conversation.EVENTS, event(1))
        bus.publish("resource_pool/scout2", Conversation.EVENTS, event(2))
        await clock.sleep_s(0.1)

    [found] = recorded(scene, "*/scout2/events")
    assert (found.key, found.body["what"]) == ("scout/local/resource_pool/scout2/events", "event 2")


def test_it_ends_when_the_mission_has_ended(tmp_path: Path, local_mission: Any) -> None:
    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus = network.join("backbone/recorder", clock)
            links: list[Any] = []
            bus.watch_link = links.append
            files = RecordingFiles(tmp_path / "it.mcap")
            recorder = Recorder(bus, clock, files=files, classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(1.0)
            for is_up, wait_s in ((False, 3.0), (True, 10.0), (False, 3.0)):
                links[0](is_up)
                await clock.sleep_s(wait_s)
                assert not running.done()
            await clock.sleep_s(3.0)
            assert running.done()
            await bus.close()

    run_virtual(play())


@pytest.mark.parametrize(("is_lossless", "away_s", "missed_s"), [(False, 0.5, 0.5), (True, 1.9, 0.0), (True, 2.5, 2.5)])
def test_an_absence_of_the_hub_that_costs_messages_is_told_with_its_length(
    tmp_path: Path, local_mission: Any, is_lossless: bool, away_s: float, missed_s: float
) -> None:
    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus = network.join("backbone/recorder", clock)
            links: list[Any] = []
            bus.watch_link = links.append
            files = RecordingFiles(tmp_path / "it.mcap")
            recorder = Recorder(bus, clock, files=files, classes=CLASSES, about={}, is_lossless=is_lossless)
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(1.0)
            links[0](False)
            await clock.sleep_s(away_s)
            links[0](True)
            await clock.sleep_s(1.0)
            recorder.end()
            await running
            assert recorder.away_s == pytest.approx(missed_s)
            await bus.close()

    run_virtual(play())
    with (tmp_path / "it.mcap").open("rb") as file:
        said = [one.body["what"] for one in Recording(file).messages(("*/log",))]
    line = f"recorder: the hub was away for {missed_s:.1f} s; an unknown number of messages is missing"
    assert (line in said) is bool(missed_s)


def test_it_ends_when_a_later_mission_of_the_name_is_up(tmp_path: Path, local_mission: Any) -> None:
    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            links: list[Any] = []
            bus.watch_link = links.append
            recorder = Recorder(bus, clock, files=RecordingFiles(tmp_path / "it.mcap"), classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(30.0)
            scout.publish(scout.source, Conversation.LOG, event(1))
            links[0](False)
            await clock.sleep_s(3.0)

            async def answer(_asked: object) -> MissionTime:
                return MissionTime(clock.now_s() - 32.0, 1.0)

            network.join(NAMESERVER, clock).serve(NAMESERVER, AskTime, answer)
            links[0](True)
            await clock.sleep_s(0.1)
            scout.publish(scout.source, Conversation.LOG, event(2))
            await clock.sleep_s(3.0)
            assert running.done()
            assert recorder.was_started_again
            await bus.close()

    run_virtual(play())
    with (tmp_path / "it.mcap").open("rb") as file:
        said = [one.body["what"] for one in Recording(file).messages() if one.source == "resource_pool/scout1"]
    assert said == ["event 1"]


def test_it_says_that_it_ended_because_its_hub_stayed_away(tmp_path: Path, local_mission: Any) -> None:
    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus = network.join("backbone/recorder", clock)
            links: list[Any] = []
            bus.watch_link = links.append
            recorder = Recorder(bus, clock, files=RecordingFiles(tmp_path / "it.mcap"), classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(30.0)
            links[0](False)
            await clock.sleep_s(4.0)
            assert (running.done(), recorder.why_ended) == (False, "")
            await clock.sleep_s(4.0)
            assert (running.done(), recorder.why_ended) == (
                True,
                "the mission has ended, or its hub cannot be reached",
            )
            await bus.close()

    run_virtual(play())


@pytest.mark.parametrize(("split_s", "split_bytes"), [(2.0, 10**9), (1e6, 3_000)])
@pytest.mark.parametrize("keep", [0, 2])
def test_a_long_recording_goes_on_in_further_files(
    tmp_path: Path, local_mission: Any, split_s: float, split_bytes: int, keep: int
) -> None:
    (tmp_path / "it-3.mcap").touch()
    written: list[int] = []

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            files = RecordingFiles(tmp_path / "it.mcap", keep)
            recorder = Recorder(
                bus, clock, files=files, split_s=split_s, split_bytes=split_bytes, classes=CLASSES, about={"a": "b"}
            )
            begun = asyncio.Event()
            running = asyncio.create_task(recorder.run(begun.set))
            await begun.wait()
            for number in range(100):
                await clock.sleep_s(0.1)
                scout.publish(scout.source, Conversation.LOG, event(number))
            recorder.end()
            await running
            written.append(recorder.written)
            await bus.close()

    run_virtual(play())
    paths = sorted(tmp_path.glob("it*.mcap"), key=lambda path: int(path.stem.partition("-")[2] or 1))
    assert (tmp_path / "it-3.mcap").read_bytes() == b"", "a name that exists is left out"
    paths.remove(tmp_path / "it-3.mcap")
    found: list[int] = []
    held = 0
    for path in paths:
        with path.open("rb") as file:
            recording = Recording(file)
            contents = recording.contents()
            assert contents.about == {"a": "b"}
            held += contents.messages
            found += [one.sequence for one in recording.messages() if one.source == "resource_pool/scout1"]
    assert found == [*range(found[0], 101)], "each message once"
    if keep:
        assert len(paths) == keep
    else:
        assert (found[0], held) == (1, written[0])
        assert len(paths) > 3


def test_each_further_file_tells_by_itself_who_is_there_and_in_which_state(tmp_path: Path, local_mission: Any) -> None:
    async def answer(asked: Envelope[Any]) -> ComponentState | Parameters | Story:
        match asked.body:
            case AskState():
                return ComponentState("resource_pool/scout1", "scout", "base", 7, LifeState.READY, 0.5, "stands")
            case AskParameters():
                return Parameters({"speed": 1})
        return Story([])

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            gone = network.join("resource_pool/scout2", clock)
            for one in (scout, gone):
                one.serve(one.source, AskState | AskParameters | AskStory, answer)
                one.declare_alive(one.source)
            files = RecordingFiles(tmp_path / "it.mcap")
            recorder = Recorder(bus, clock, files=files, split_s=1.0, classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(0.5)
            await gone.close()
            await clock.sleep_s(1.4)
            recorder.end()
            await running
            await bus.close()

    run_virtual(play())
    with (tmp_path / "it-2.mcap").open("rb") as file:
        mission = mission_at(Recording(file), CLASSES, 10.0)
    listed = mission.answer(NAMESERVER, ListComponents())
    assert isinstance(listed, Components)
    assert [one.address for one in listed.components] == [NAMESERVER, "resource_pool/scout1"]
    assert mission.answer("resource_pool/scout1", AskParameters()) == Parameters({"speed": 1})


def test_if_no_further_file_can_be_opened_it_ends_with_a_whole_file_and_says_so(
    tmp_path: Path, local_mission: Any
) -> None:
    path = tmp_path / f"{'n' * 250}.mcap"  # the longest name; that of the second file is too long

    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            bus, scout = network.join("backbone/recorder", clock), network.join("resource_pool/scout1", clock)
            recorder = Recorder(bus, clock, files=RecordingFiles(path), split_s=1.0, classes=CLASSES, about={})
            running = asyncio.create_task(recorder.run())
            await clock.sleep_s(0.5)
            scout.publish(scout.source, Conversation.LOG, event(1))
            await running
            assert "too long" in recorder.full
            await bus.close()

    run_virtual(play())
    with path.open("rb") as file:
        assert "event 1" in [one.body["what"] for one in Recording(file).messages() if one.source.endswith("scout1")]
