"""Missions on virtual time, recorded from their first message to their last."""

from __future__ import annotations

import asyncio
import io
from pathlib import Path
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.bus.neighbor_declarations import Overheard
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.mission.model import MissionDescription
from backbone.recording.files import RecordingFiles
from backbone.recording.hearing import to_overhear
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recording
from backbone.recording.recorder import Recorder
from backbone.recording.writer import RecordingWriter
from backbone.wire import Envelope, Message, write
from mission_control.laboratory.simulation import mission_run, supervised_mission
from mission_control.laboratory.simulation.mission_run import MissionRun, run_mission
from mission_control.laboratory.simulation.supervised_mission import run_supervised
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process

CLASSES = message_classes()


def record_mission(path: Path, mission: MissionDescription, lasts_s: float) -> None:
    """Record so many seconds of a mission in one process, and all before them."""
    recorders: list[tuple[Recorder, asyncio.Task[None]]] = []

    class RecordedNetwork(LocalNetwork):
        """A network at which a recorder is before anybody else."""

        def __init__(self, mission: str) -> None:
            super().__init__(mission)
            clock = VirtualClock()
            bus = self.join("backbone/recorder", clock)
            about: dict[str, Any] = {"mission": mission}
            recorder = Recorder(bus, clock, files=RecordingFiles(path), classes=CLASSES, about=about)
            recorders.append((recorder, asyncio.create_task(recorder.run(), name="recorder")))

    async def record() -> None:
        async with mission_in_one_process(mission, on=RecordedNetwork) as running:
            await running.clock.sleep_s(lasts_s)
        [(recorder, recording)] = recorders
        recorder.end()
        await recording

    run_virtual(record())


def record_seed(seed: int, *, chaos: bool, is_supervised: bool = False) -> tuple[Recording, MissionRun]:
    """Return the recording of a simulated mission, and the mission as it judged itself.

    Args:
        is_supervised: True: with launcher, creators and placer, and with the faults of processes and machines.
    """
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, {})

    class Witness(Overheard):
        """Writes at once, because a step of a sender that is killed would never come."""

        def arrived(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
            if self.hears(address, conversation):
                writer.write(key_of(self.owner.mission, address, conversation), write(envelope), 0.0)

    simulated = supervised_mission if is_supervised else mission_run
    name = "LinkedNetwork" if is_supervised else "UnreliableNetwork"

    class WitnessedNetwork(getattr(simulated, name)):  # type: ignore[misc]  both are LocalNetworks
        """A network of which a witness sees all messages, whatever is lost."""

        def __init__(self, *args: Any) -> None:
            super().__init__(*args)
            bus = LocalBus(self, "backbone/recorder", VirtualClock())
            for conversation in to_overhear(()):
                self.overhearers.append(Witness(bus, lambda: None, conversation, lambda _key, _raw: None, 0, ""))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(simulated, name, WitnessedNetwork)
        run = (run_supervised if is_supervised else run_mission)(seed, chaos=chaos)
    writer.finish()
    return Recording(file), run
