"""What the shipped behaviors know after their process was killed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from fake_resource_pool import FakePlacer, with_placer

from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior import Behavior
from mission_control.behaviors.give import Give
from mission_control.behaviors.hide import Hide
from mission_control.behaviors.jump_course import (
    BEYOND_M,
    LANDED_AFTER_S,
    Act,
    JumpCourse,
    JumpStage,
    Obstacle,
)
from mission_control.behaviors.jump_over import JumpOver
from mission_control.behaviors.motion import FloorPoint, Position
from mission_control.behaviors.patrol import Patrol, PatrolMemory
from mission_control.behaviors.return_to_pickup import ReturnToPickup

BOX = Obstacle(FloorPoint(3.0, 2.0), 0.0, 0.1)
BEFORE, BEHIND = Position(1.0, 2.0, 0.0), Position(3.1 + BEYOND_M + 0.05, 2.0, 0.0)
DRIVE = {"kind": "drive", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
PARAMETERS: dict[type[Behavior[Any]], dict[str, Any]] = {
    Give: {"word": "look", "for_s": 60.0},
    Hide: {},
    JumpOver: {"front": "3,2", "heading_deg": 0.0, "localizer": "world"},
    Patrol: {"waypoints": "1,1 2,2", "localizer": "world"},
    ReturnToPickup: {"near": "1,1", "localizer": "world"},
}


def advance(behavior: Any) -> None:
    """Let it make progress."""
    match behavior:
        case Give():
            behavior.held_s = 12.0
        case Hide():
            behavior.search.looks = 3
        case JumpOver():
            behavior.course.jumped_already(20.0)
        case Patrol():
            behavior.recall(PatrolMemory(reached=3))
        case ReturnToPickup():
            behavior.route.not_found()


@pytest.mark.parametrize("kind", PARAMETERS, ids=lambda kind: kind.__name__)
def test_a_killed_behavior_knows_its_progress(local_mission: Any, tmp_path: Path, kind: type[Behavior[Any]]) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.run_directory = str(tmp_path)
        node = {"type": "it", "name": "it", "priority": 3, "parameters": PARAMETERS[kind], "arc": DRIVE}
        before = await placer.launch(behavior_order(node, [("iros2001", 10)]))
        fresh = before.memory()
        advance(before)
        before.keep_memory()
        await placer.kill("it")
        after = await placer.restart("it")
        await placer.clock.sleep_s(0.1)  # it asks for its memory
        assert after.memory() == before.memory() != fresh

    with_placer(local_mission, {"it": kind})(scene)


def course(jumps: int, jumped_s: float) -> JumpCourse:
    made = JumpCourse(BOX, attempts=2, speed_m_s=0.2, onward_m=0.6)
    made.resume(jumps, jumped_s)
    return made


def test_a_robot_in_the_air_gets_no_command_from_the_next_process() -> None:
    resumed = course(1, 10.0)
    assert resumed.decide(BEFORE, 10.0 + LANDED_AFTER_S / 2) is Act.WAIT
    assert resumed.stage is JumpStage.AIRBORNE


@pytest.mark.parametrize(
    ("jumps", "at", "stage"),
    [(1, BEFORE, JumpStage.RUN_UP), (2, BEFORE, JumpStage.FAILED), (2, BEHIND, JumpStage.ONWARD)],
)
def test_the_last_jump_of_an_earlier_process_is_judged(jumps: int, at: Position, stage: JumpStage) -> None:
    resumed = course(jumps, 10.0)
    resumed.decide(at, 10.0 + LANDED_AFTER_S)
    assert resumed.stage is stage


def test_a_course_without_jumps_begins_with_its_run_up() -> None:
    resumed = course(0, -math.inf)
    resumed.decide(BEFORE, 10.0)
    assert (resumed.stage, resumed.jumps) == (JumpStage.RUN_UP, 0)
