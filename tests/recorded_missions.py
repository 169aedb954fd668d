"""Whole missions on virtual time, recorded from their first message to their last."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.mission.model import MissionDescription
from backbone.recording.files import RecordingFiles
from backbone.recording.known_messages import message_classes
from backbone.recording.recorder import Recorder
from mission_control.laboratory.simulation import whole_mission
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
        async with mission_in_one_process(mission) as running:
            await running.clock.sleep_s(lasts_s)
        [(recorder, recording)] = recorders
        recorder.end()
        await recording

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(whole_mission, "LocalNetwork", RecordedNetwork)
        run_virtual(record())
