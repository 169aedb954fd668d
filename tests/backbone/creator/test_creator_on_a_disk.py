"""A creator whose files are on a disk says so at its begin, because a slow disk delays the robots of its host."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from in_process_zygote import InProcessZygote
from test_creator_service import CREATOR, TYPES

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.component.messages import StoryEvent
from backbone.creator import service
from backbone.creator.service import Creator
from backbone.keys import Conversation
from backbone.naming import Subsystem


@pytest.mark.parametrize("disk", ["ext4", ""])
def test_a_creator_says_that_its_files_are_on_a_disk(
    local_mission: Any, beside: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, disk: str
) -> None:
    clock, said = VirtualClock(), list[str]()
    monkeypatch.setattr(service, "disk_of", lambda folder: disk if folder == tmp_path else "another")

    async def main() -> None:
        async with local_mission() as network:
            asked: dict[str, Any] = {"tags": [], "preload": [], "types": [msgspec.to_builtins(one) for one in TYPES]}
            of = (Subsystem.BACKBONE, "creator-lab", "creator", "x:Y", "lab", "", 0.0, 1.0, asked)
            launch = Launch("local", *of, run_directory=str(tmp_path))
            bus = network.join("ui_console/ear", clock)
            bus.subscribe(CREATOR, Conversation.LOG, StoryEvent, lambda heard: said.append(heard.body.what))
            async with beside(Creator(launch, network.join(CREATOR, clock), clock, InProcessZygote(network))):
                await clock.sleep_s(3.0)
            await bus.close()

    run_virtual(main())
    assert [what.partition(":")[0] for what in said] == ([f"keeps its files on a disk ({disk})"] if disk else [])
