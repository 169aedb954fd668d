"""A mission file's whole mission in one process on virtual time."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from trace_checker import check

from backbone.bus.clock import run_virtual
from backbone.component_database.messages import UnknownType
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from backbone.placer.messages import AskPlacement, ListPlacements, NotPlaced, Placement, Placements, Start
from mission_control.laboratory.simulation.whole_mission import MissionFell, RunningMission, mission_in_one_process

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def shipped() -> MissionDescription:
    return read_mission(ROOT / "mission.xml")


def run_for(mission: MissionDescription, seconds: float) -> tuple[list[dict[str, Any]], dict[str, float]]:
    async def main() -> tuple[list[dict[str, Any]], dict[str, float]]:
        async with mission_in_one_process(mission) as running:
            await running.clock.sleep_s(seconds)
            return list(running.trace), await running.statistics("world")

    return run_virtual(main())


def test_the_shipped_mission_takes_turns_and_never_jams_its_frequency(shipped: MissionDescription) -> None:
    trace, world = run_for(shipped, 12.0)
    granted = [line["arc"] for line in trace if line["ev"] == "grant"]
    assert granted == ["watch-scout1-capture", "watch-scout2-capture", "watch-scout1-capture"]
    assert world["jammed_frames"] == world["stale_packets"] == 0
    assert world["frames"] == 12 * 30


def test_the_same_mission_gives_the_same_run_to_the_byte(shipped: MissionDescription) -> None:
    assert json.dumps(run_for(shipped, 7.0)) == json.dumps(run_for(shipped, 7.0))


def test_the_checker_finds_nothing_wrong_with_its_decisions(shipped: MissionDescription) -> None:
    trace, _ = run_for(shipped, 12.0)
    assert check(json.loads(json.dumps(trace))) == []


def in_running(mission: MissionDescription, work: Callable[[RunningMission], Any]) -> Any:
    async def main() -> Any:
        async with mission_in_one_process(mission) as running:
            return await work(running)

    return run_virtual(main())


def test_what_is_started_can_be_found_and_stopped(shipped: MissionDescription) -> None:
    async def work(running: RunningMission) -> None:
        await running.stop("surveillance")
        with pytest.raises(NotPlaced):
            running.component("surveillance")
        with pytest.raises(NotPlaced):
            await running.bus.ask(running.placer, AskPlacement("surveillance"), Placement, within_s=1.0)
        started = await running.start(Start("surveillance", parameters={"path": []}))
        assert started.address == "mission_control/surveillance-1"
        listed = await running.bus.ask(running.placer, ListPlacements(), Placements, within_s=1.0)
        assert "surveillance-1" in {placed.name for placed in listed.placements}

    in_running(shipped, work)


def test_a_type_the_mission_does_not_have_is_refused(shipped: MissionDescription) -> None:
    async def work(running: RunningMission) -> None:
        with pytest.raises(UnknownType, match="teapot"):
            await running.start(Start("teapot"))

    in_running(shipped, work)


def test_a_component_that_falls_ends_the_run_with_its_name_and_reason(shipped: MissionDescription) -> None:
    worlds = tuple(msgspec.structs.replace(part, parameters={"world": {}}) for part in shipped.components)
    broken = msgspec.structs.replace(shipped, components=worlds)
    with pytest.raises(MissionFell, match=r"world fell.*width_m"):
        run_for(broken, 1.0)
