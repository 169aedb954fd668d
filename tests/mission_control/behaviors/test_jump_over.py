"""Jumping over a box: the decisions with a played robot, then the behavior in the simulated world."""

from __future__ import annotations

import math

import msgspec
import pytest
from behaviors_at_work import FEW_MOMENTS, MANY_MOMENTS, Person, at_work, driving, example, pose, wait_until
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from backbone.component.messages import Parameters, SetParameter
from backbone.keys import Conversation
from mission_control.behaviors.jump_course import (
    BEYOND_M,
    LANDED_AFTER_S,
    Act,
    JumpCourse,
    JumpStage,
    Obstacle,
)
from mission_control.behaviors.jump_over import JumpOver, JumpOverParameters
from mission_control.behaviors.motion import FloorPoint, Motion, Position, turned
from mission_control.messages import BehaviorStatus
from resource_pool.messages import Applied

STEP_S = 0.1
NAME, ROBOT = "jump-scout2", "scout2"
BOX = Obstacle(FloorPoint(3.0, 2.0), 0.0, 0.1)


class PlayedRobot:
    """Drives on arcs and jumps 0.6 m far, if no command comes meanwhile; the box stops it otherwise."""

    def __init__(self, position: Position, *, lands_on_its_back: bool = False) -> None:
        self.position, self.now_s = position, 0.0
        self.lands_on_its_back, self.is_on_its_back = lands_on_its_back, False
        self.jumped_s: list[float] = []
        self.disturbed = 0

    def obey(self, told: Motion | Act) -> None:
        self.now_s += STEP_S
        airborne = bool(self.jumped_s) and self.now_s < self.jumped_s[-1] + LANDED_AFTER_S
        if airborne:
            self.disturbed += told is not Act.WAIT
            return
        if told is Act.JUMP:
            self.jumped_s.append(self.now_s - STEP_S)
            gap_m = -BOX.passed_m(self.position)
            if 0.15 <= gap_m <= 0.32 and abs(self.position.heading_rad) < 0.2:
                self.position = self._gone(0.6, 0.0)
                if self.lands_on_its_back:
                    self.position = Position(self.position.x_m, self.position.y_m, turned(math.pi))
                    self.is_on_its_back = True
        elif isinstance(told, Motion) and not self.is_on_its_back:
            gone = self._gone(told.forward_m_s * STEP_S, told.turn_rad_s * STEP_S)
            if not -0.05 < BOX.passed_m(gone) < BOX.depth_m + 0.05:
                self.position = gone
        elif isinstance(told, Motion) and told.forward_m_s > 0.3:
            self.is_on_its_back = False
            self.position = Position(self.position.x_m, self.position.y_m, turned(self.position.heading_rad + math.pi))

    def _gone(self, forward_m: float, turn_rad: float) -> Position:
        at = self.position
        half_rad = at.heading_rad + turn_rad / 2
        return Position(
            at.x_m + forward_m * math.cos(half_rad),
            at.y_m + forward_m * math.sin(half_rad),
            turned(at.heading_rad + turn_rad),
        )


def go_on(course: JumpCourse, robot: PlayedRobot, lasts_s: float) -> None:
    until_s = robot.now_s + lasts_s
    while robot.now_s < until_s and not course.is_final:
        told = course.decide(robot.position, robot.now_s)
        robot.obey(told)
        if told is Act.JUMP:
            course.jumped()


def jump_course(attempts: int = 3) -> JumpCourse:
    return JumpCourse(BOX, attempts=attempts, speed_m_s=0.2, onward_m=0.6)


before_the_box = st.builds(Position, st.floats(0.5, 2.8), st.floats(1.0, 3.0), st.floats(-math.pi, math.pi))
somewhere = st.builds(
    Position, st.one_of(st.floats(0.5, 2.8), st.floats(3.2, 5.0)), st.floats(1.0, 3.0), st.floats(-math.pi, math.pi)
)


@given(before_the_box)
def test_from_anywhere_before_the_box_one_jump_brings_the_robot_over_and_it_drives_on(begin: Position) -> None:
    course, robot = jump_course(), PlayedRobot(begin)
    go_on(course, robot, 120.0)
    assert course.stage is JumpStage.OVER
    assert course.jumps == len(robot.jumped_s) == 1
    assert BOX.passed_m(robot.position) > BOX.depth_m + 0.5


def test_a_robot_that_landed_on_its_back_is_righted_before_it_drives_on() -> None:
    course, robot = jump_course(), PlayedRobot(Position(2.0, 2.0, 0.0), lands_on_its_back=True)
    go_on(course, robot, 60.0)
    assert course.stage is JumpStage.OVER
    assert not robot.is_on_its_back


@given(
    before_the_box, st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(0.0, 8.0), st.none() | somewhere), max_size=6)
)
def test_suspended_at_any_moment_it_gets_over_and_never_disturbs_a_jump(
    begin: Position, disturbances: list[tuple[float, float, Position | None]]
) -> None:
    course, robot = jump_course(attempts=20), PlayedRobot(begin)
    for after_s, lasts_s, left_at in disturbances:
        go_on(course, robot, after_s)
        course.interrupt()
        robot.now_s += lasts_s
        robot.position = left_at or robot.position
    go_on(course, robot, 200.0)
    assert course.stage is JumpStage.OVER
    assert course.jumps == len(robot.jumped_s)
    assert robot.disturbed == 0


def test_it_gives_up_after_as_many_jumps_as_it_may_try() -> None:
    course = jump_course(attempts=2)
    robot = PlayedRobot(Position(2.0, 2.0, 0.0))
    while not course.is_final:
        told = course.decide(robot.position, robot.now_s)
        if told is Act.JUMP:
            course.jumped()
            robot.now_s += STEP_S
        else:
            robot.obey(told)
    assert course.stage is JumpStage.FAILED
    assert course.jumps == 2


def test_a_jump_that_was_not_obeyed_does_not_count() -> None:
    course, robot = jump_course(attempts=1), PlayedRobot(Position(2.5, 2.0, 0.0))
    told: Motion | Act = Act.WAIT
    while told is not Act.JUMP:
        told = course.decide(robot.position, robot.now_s)
        robot.obey(told if told is not Act.JUMP else Act.WAIT)
    course.interrupt()
    robot.now_s += 10.0
    go_on(course, robot, 60.0)
    assert course.stage is JumpStage.OVER
    assert course.jumps == 1


def test_it_asks_for_the_time_in_the_air_only() -> None:
    course = jump_course()
    assert course.airborne_s(0.0) == 0
    robot = PlayedRobot(Position(2.5, 2.0, 0.0))
    while not robot.jumped_s:
        go_on(course, robot, STEP_S)
    assert LANDED_AFTER_S - 0.2 <= course.airborne_s(robot.now_s) <= LANDED_AFTER_S


def test_in_the_world_a_scout_jumps_over_a_box_of_thirty_centimeters_and_drives_on() -> None:
    async def scene() -> None:
        async with at_work(example(NAME)) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, JumpOver)
            await wait_until(running, lambda: behavior.status.is_final, 60.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload
            assert behavior.payload == {"jumps": 1}
            at = await pose(running, ROBOT)
            assert at.x_m > 5.0 + 0.1 + BEYOND_M

    run_virtual(scene())


def test_in_the_world_a_new_parameter_amid_a_jump_disturbs_no_jump() -> None:
    async def scene() -> None:
        async with at_work(example(NAME)) as running:
            behavior, told = running.component(NAME), list[str]()
            assert isinstance(behavior, JumpOver)
            at = f"resource_pool/{ROBOT}"
            running.bus.subscribe(at, Conversation.MOTIONS, Applied, lambda heard: told.append(heard.body.command))
            await wait_until(running, lambda: "jump" in told, 60.0)
            told.clear()
            await running.bus.ask(behavior.address, SetParameter("onward_m", 0.3), Parameters, within_s=1.0)
            await running.clock.sleep_s(2.5)
            assert told == []
            await wait_until(running, lambda: behavior.status.is_final, 60.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload

    run_virtual(scene())


take_overs = st.lists(st.tuples(st.floats(2.0, 7.0), st.floats(0.1, 3.0)), min_size=1, max_size=4)


def play(disturbances: list[tuple[float, float]]) -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(example(NAME), person) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, JumpOver)
            await wait_until(running, lambda: behavior.statistics()["times_resumed"], 10.0)
            for after_s, lasts_s in disturbances:
                await running.clock.sleep_s(after_s)
                await person.take_over(ROBOT, driving(-5.0, -5.0, lasts_s))
            await wait_until(running, lambda: behavior.status.is_final, 120.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload
            assert behavior.statistics()["times_suspended"] >= 1

    run_virtual(scene())


@FEW_MOMENTS
@given(take_overs)
def test_in_the_world_it_gets_over_however_often_it_is_taken_over(disturbances: list[tuple[float, float]]) -> None:
    play(disturbances)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@MANY_MOMENTS
@given(take_overs)
def test_in_the_world_it_gets_over_from_many_more_moments(disturbances: list[tuple[float, float]]) -> None:
    play(disturbances)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"front": "1,1 2,2"}, "write one place"),
        ({"front": "near"}, "is no place"),
        ({"heading_deg": math.inf}, "heading_deg"),
        ({"localizer": ""}, "localizer"),
        ({"depth_m": 0.5}, "<= 0.2 - at .*depth_m"),
        ({"onward_m": -1.0}, ">= 0.0 - at .*onward_m"),
        ({"speed_m_s": 1.0}, "<= 0.3 - at .*speed_m_s"),
        ({"attempts": 0}, ">= 1 - at .*attempts"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(given: dict[str, object], complaint: str) -> None:
    fine = {"front": "1,1", "heading_deg": 0, "localizer": "world"}
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert({**fine, **given}, JumpOverParameters)
