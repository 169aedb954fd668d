"""What a simulated world keeps for its next process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from resource_pool.localization import AskPose, Pose
from resource_pool.simulated_world import SimulatedWorld
from resource_pool.world_file import WorldFile
from scout_model.description import RobotPlace, WorldDescription
from scout_model.errors import UnstableBody
from scout_model.world import World, WorldMemory

MEMORY = WorldMemory(90, {"scout1": [1.0, 2.0, 0.02, 1.0, 0.0, 0.0, 0.0]}, {"scout1": 0.75})


def file(folder: Path | str) -> WorldFile:
    return WorldFile(str(folder), "world")


def test_what_one_process_writes_the_next_reads(tmp_path: Path) -> None:
    assert file(tmp_path).read() is None
    file(tmp_path).write(MEMORY)
    assert file(tmp_path).read() == MEMORY


def test_an_unstable_world_is_forgotten(tmp_path: Path) -> None:
    former = file(tmp_path)
    former.forget()
    former.write(MEMORY)
    former.forget()
    assert file(tmp_path).read() is None


def test_without_a_folder_nothing_is_kept() -> None:
    nowhere = file("")
    nowhere.write(MEMORY)
    nowhere.forget()
    assert nowhere.read() is None


def test_a_file_that_cannot_be_read_is_as_none(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "kept" / "worlds").mkdir(parents=True)
    (tmp_path / "kept" / "worlds" / "world").write_bytes(b"torn")
    assert file(tmp_path).read() is None
    assert "first places" in caplog.text


def test_a_full_disk_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    kept = file(tmp_path)
    kept.write(MEMORY)
    monkeypatch.setattr("resource_pool.world_file.replace_file", full)
    for _ in range(3):
        kept.write(MEMORY)
    assert caplog.text.count("No space left") == 1


def test_the_next_process_begins_with_it_unless_the_former_could_not_be_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, local_mission: Any, beside: Any
) -> None:
    room = {"world": msgspec.to_builtins(WorldDescription(9.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 1.5, 0.0)]))}
    at = f"{Subsystem.RESOURCE_POOL}/world"

    def unstable(_world: World) -> None:
        raise UnstableBody("scout1 moves too fast to be computed")

    async def main() -> None:
        clock = VirtualClock()
        async with local_mission() as network:
            launch = Launch(
                network.mission, Subsystem.RESOURCE_POOL, "world", "simulated_world", "x:Y", "local", "", 0.0, 1.0, room
            )
            launch = msgspec.structs.replace(launch, run_directory=str(tmp_path))

            def world() -> SimulatedWorld:
                return SimulatedWorld(launch, network.join(at, clock), clock)

            async def x_m() -> float:
                found = await network.join("ui_console/one", clock).ask(at, AskPose("scout1"), Pose, within_s=1)
                return round(found.x_m, 1)

            async with beside(world()):
                await clock.sleep_s(1.5)
                assert await x_m() == 2.0
            memory = file(tmp_path).read()
            assert memory is not None
            memory.positions["scout1"][0] = 4.0
            file(tmp_path).write(memory)
            async with beside(world()):
                assert await x_m() == 4.0
            with monkeypatch.context() as trembling:
                trembling.setattr(World, "step_frame", unstable)
                with pytest.raises(UnstableBody):
                    await world().run()
            async with beside(world()):
                assert await x_m() == 2.0

    run_virtual(main())
