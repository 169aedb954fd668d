"""Robots that go to places, home, and after each other, by dead reckoning, on the real bus under the RC manager."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from behaviors_at_work import EXAMPLES, FEW_MOMENTS, MANY_MOMENTS, Person, at_work, driving, pose, wait_until
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from backbone.component.messages import Parameters, SetParameter
from backbone.keys import Conversation
from backbone.mission.behavior_nodes import BehaviorNode
from backbone.mission.behavior_orders import behavior_orders
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from mission_control.behaviors.follow import Follow, FollowParameters
from mission_control.behaviors.go_to import Goer, GoToParameters
from mission_control.behaviors.return_home import ReturnHome
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import BehaviorStatus
from resource_pool.localization import AskPose, Pose
from resource_pool.messages import Applied

GO, HOME, FOLLOW, ROBOT = "go-out", "go-home", "follow-scout1", "scout1"
GOAL, BEGIN = (3.0, 2.0), (1.0, 1.0)


def all_of(behaviors: tuple[BehaviorNode, ...]) -> list[BehaviorNode]:
    return [one for behavior in behaviors for one in (behavior, *all_of(behavior.children))]


def only(*names: str, file: str = "go-to.xml", **parameters: Any) -> MissionDescription:
    """Return the example with these behaviors as roots, and these parameters in each of them."""
    mission = read_mission(EXAMPLES / file)
    kept = [behavior for behavior in all_of(mission.behaviors) if behavior.name in names]
    changed = [msgspec.structs.replace(one, parameters={**one.parameters, **parameters}) for one in kept]
    return msgspec.structs.replace(mission, behaviors=tuple(changed))


async def believed(running: RunningMission, robot: str = ROBOT) -> Pose:
    return await running.bus.ask("resource_pool/localizer", AskPose(robot), Pose, within_s=1.0)


def away_m(at: Pose, place: tuple[float, float]) -> float:
    return math.hypot(at.x_m - place[0], at.y_m - place[1])


async def finished(running: RunningMission, name: str, within_s: float = 90.0) -> Any:
    behavior = running.component(name)
    await wait_until(running, lambda: behavior.status.is_final, within_s)
    return behavior


def test_a_scout_goes_to_its_place_by_dead_reckoning() -> None:
    async def scene() -> None:
        async with at_work(only(GO)) as running:
            behavior = await finished(running, GO)
            assert isinstance(behavior, Goer)
            assert behavior.status is BehaviorStatus.SUCCESS
            at = await believed(running)
            assert away_m(at, GOAL) < 0.09
            assert behavior.payload == pytest.approx({"x_m": at.x_m, "y_m": at.y_m, "spread_m": at.spread_m}, abs=0.02)
            truth = await pose(running, ROBOT)
            assert away_m(truth, (at.x_m, at.y_m)) < 2 * at.spread_m
            assert away_m(truth, GOAL) < 0.3  # measured: 0.15 m
            standing = await pose(running, ROBOT)
            await running.clock.sleep_s(2.0)
            assert away_m(await pose(running, ROBOT), (standing.x_m, standing.y_m)) < 0.01

    run_virtual(scene())


def test_it_goes_by_the_simulated_world_just_the_same() -> None:
    async def scene() -> None:
        async with at_work(only(GO, localizer="world")) as running:
            behavior = await finished(running, GO)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert away_m(await pose(running, ROBOT), GOAL) < 0.09
            assert behavior.payload["spread_m"] == 0

    run_virtual(scene())


Disturbances = list[tuple[float, tuple[float, float], float]]
take_overs = st.lists(
    st.tuples(
        st.floats(0.5, 8.0), st.sampled_from([(8.0, 8.0), (-8.0, -6.0), (3.0, -3.0), (0.0, 0.0)]), st.floats(0.1, 3.0)
    ),
    min_size=1,
    max_size=4,
)


def play(disturbances: Disturbances) -> None:
    """What a person drives the robot in between is reckoned, too."""

    async def scene() -> None:
        person = Person()
        async with at_work(only(GO), person) as running:
            behavior = running.component(GO)
            assert isinstance(behavior, Goer)
            await wait_until(running, lambda: behavior.statistics()["times_resumed"], 10.0)
            for after_s, wheels, lasts_s in disturbances:
                if behavior.status.is_final:
                    break
                await running.clock.sleep_s(after_s)
                await person.take_over(ROBOT, driving(*wheels, lasts_s))
            at_end = await finished(running, GO, 150.0)
            assert at_end.status is BehaviorStatus.SUCCESS, at_end.payload
            at, truth = await believed(running), await pose(running, ROBOT)
            assert away_m(truth, (at.x_m, at.y_m)) <= 2 * at.spread_m
            world = await running.statistics("world")
            assert world["stale_packets"] == 0

    run_virtual(scene())


@FEW_MOMENTS
@given(take_overs)
def test_taken_over_at_any_moment_it_gets_there_and_knows_how_surely(disturbances: Disturbances) -> None:
    play(disturbances)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@MANY_MOMENTS
@given(take_overs)
def test_taken_over_at_many_more_moments_it_gets_there_too(disturbances: Disturbances) -> None:
    play(disturbances)


def test_a_robot_before_a_shelf_fails_with_the_reason() -> None:
    async def scene() -> None:
        async with at_work(only(GO, localizer="world", x_m=5.2, y_m=3.8)) as running:
            behavior = await finished(running, GO)
            assert behavior.status is BehaviorStatus.FAILURE
            assert behavior.payload["code"] == "go_to.not_there"
            assert "m are left" in behavior.payload["detail"]

    run_virtual(scene())


def test_a_place_outside_the_room_is_refused_before_the_robot_moves() -> None:
    async def scene() -> None:
        async with at_work(only(GO, x_m=100.0)) as running:
            go = await finished(running, GO, 10.0)
            assert (go.status, go.payload["code"]) == (BehaviorStatus.FAILURE, "go_to.outside")
            assert away_m(await pose(running, ROBOT), BEGIN) < 0.01

    run_virtual(scene())


def test_a_robot_that_is_too_slow_fails_with_the_reason() -> None:
    async def scene() -> None:
        async with at_work(only(GO, within_s=4.0)) as running:
            behavior = await finished(running, GO, 8.0)
            assert behavior.status is BehaviorStatus.FAILURE
            assert "after 4 s" in behavior.payload["detail"]

    run_virtual(scene())


def test_a_robot_that_its_localizer_does_not_know_fails_with_the_reason() -> None:
    async def scene() -> None:
        mission = only(GO)
        resources = [
            msgspec.structs.replace(one, parameters={"starts": "scout2:1,1"}) if one.name == "localizer" else one
            for one in mission.resources
        ]
        async with at_work(msgspec.structs.replace(mission, resources=tuple(resources))) as running:
            behavior = await finished(running, GO, 10.0)
            assert behavior.status is BehaviorStatus.FAILURE
            assert behavior.payload["code"] == "localizer.unknown_body"
            assert "scout2" in behavior.payload["detail"]

    run_virtual(scene())


def test_a_robot_of_which_its_localizer_is_not_sure_is_not_driven() -> None:
    async def scene() -> None:
        async with at_work(only(GO)) as running:
            rc = running.network.join(f"resource_pool/{ROBOT}", running.clock)
            for _jump in range(2):
                rc.publish(rc.source, Conversation.MOTIONS, Applied(ROBOT, 1, running.clock.now_s(), "jump"))
            behavior = await finished(running, GO, 10.0)
            assert behavior.status is BehaviorStatus.FAILURE
            assert behavior.payload["code"] == "behavior.lost"

    run_virtual(scene())


def test_a_new_place_while_it_goes_is_where_it_goes() -> None:
    async def scene() -> None:
        async with at_work(only(GO)) as running:
            behavior: Any = running.component(GO)
            await wait_until(running, lambda: behavior.way is not None, 10.0)
            await running.clock.sleep_s(2.0)
            await set_parameter(running, GO, "x_m", 1.0)
            await finished(running, GO)
            assert away_m(await believed(running), (1.0, 2.0)) < 0.09

    run_virtual(scene())


async def set_parameter(running: RunningMission, name: str, parameter: str, value: float | str) -> None:
    await running.bus.ask(f"mission_control/{name}", SetParameter(parameter, value), Parameters, within_s=1.0)


def test_a_scout_that_was_driven_away_returns_to_where_it_stood_first() -> None:
    async def scene() -> None:
        person = Person()
        [order] = behavior_orders(only(HOME))
        async with at_work(only(), person) as running:
            await person.take_over(ROBOT, driving(8.0, 6.0, 4.0))
            assert away_m(await pose(running, ROBOT), BEGIN) > 0.3
            await running.start(order)
            behavior = await finished(running, HOME)
            assert isinstance(behavior, ReturnHome)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert away_m(await pose(running, ROBOT), BEGIN) < 0.3

    run_virtual(scene())


def test_the_example_goes_out_and_comes_home() -> None:
    async def scene() -> None:
        async with at_work(only("errand", FOLLOW)) as running:
            errand: Any = running.component("errand")
            farthest_m = 0.0
            while not errand.status.is_final:
                farthest_m = max(farthest_m, away_m(await pose(running, ROBOT), BEGIN))
                await running.clock.sleep_s(0.25)
                assert running.clock.now_s() < 90
            assert errand.status is BehaviorStatus.SUCCESS
            assert farthest_m > 1.9
            assert away_m(await pose(running, ROBOT), BEGIN) < 0.4  # measured: 0.21 m

    run_virtual(scene())


async def distance_m(running: RunningMission) -> float:
    target = await pose(running, ROBOT)
    return away_m(await pose(running, "scout2"), (target.x_m, target.y_m))


def test_a_follower_keeps_its_distance_from_a_robot_that_a_person_drives() -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(only(FOLLOW), person) as running:
            await running.clock.sleep_s(15.0)
            assert 0.45 < await distance_m(running) < 0.75
            await person.take_over(ROBOT, driving(6.0, 6.5, 8.0))
            await running.clock.sleep_s(10.0)
            assert 0.4 < await distance_m(running) < 0.8
            behavior: Any = running.component(FOLLOW)
            assert not behavior.status.is_final
            assert 0.5 < behavior.statistics()["away_m"] < 0.7

    run_virtual(scene())


def test_a_follower_that_is_taken_over_follows_again_from_where_it_was_left() -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(only(FOLLOW, localizer="world"), person) as running:
            behavior: Any = running.component(FOLLOW)
            for after_s, wheels in ((3.0, (8.0, 8.0)), (0.5, (-6.0, -8.0)), (6.0, (4.0, -4.0))):
                await running.clock.sleep_s(after_s)
                await person.take_over("scout2", driving(*wheels, 1.5))
            assert behavior.statistics()["times_suspended"] >= 3
            await running.clock.sleep_s(20.0)
            assert 0.5 < await distance_m(running) < 0.7

    run_virtual(scene())


@pytest.mark.parametrize(
    ("target", "code"), [("nobody", "localizer.unknown_body"), ("scout2", "follow.itself")], ids=["unknown", "itself"]
)
def test_a_target_that_cannot_be_followed_ends_it_with_the_reason(target: str, code: str) -> None:
    async def scene() -> None:
        async with at_work(only(FOLLOW, target=target)) as running:
            behavior = await finished(running, FOLLOW, 10.0)
            assert isinstance(behavior, Follow)
            assert (behavior.status, behavior.payload["code"]) == (BehaviorStatus.FAILURE, code)

    run_virtual(scene())


def test_a_new_target_is_named_and_the_robot_itself_ends_it() -> None:
    async def scene() -> None:
        async with at_work(only(FOLLOW)) as running:
            behavior: Any = running.component(FOLLOW)
            await wait_until(running, lambda: behavior.feedback == "scout2 follows scout1", 10.0)
            await set_parameter(running, FOLLOW, "target", "shelf")
            await wait_until(running, lambda: behavior.feedback == "scout2 follows shelf", 1.0)
            await set_parameter(running, FOLLOW, "target", "scout2")
            await finished(running, FOLLOW, 1.0)
            assert (behavior.status, behavior.payload["code"]) == (BehaviorStatus.FAILURE, "follow.itself")

    run_virtual(scene())


@pytest.mark.parametrize(
    ("kind", "given", "complaint"),
    [
        (GoToParameters, {"x_m": math.inf}, "<= 1000.0 - at .*x_m"),
        (GoToParameters, {"y_m": 2000.0}, "<= 1000.0 - at .*y_m"),
        (GoToParameters, {"localizer": ""}, "localizer"),
        (GoToParameters, {"speed_m_s": 0.0}, "> 0.0 - at .*speed_m_s"),
        (GoToParameters, {"speed_m_s": 0.5}, "<= 0.3 - at .*speed_m_s"),
        (GoToParameters, {"reached_within_m": 0.0}, ">= 0.02 - at .*reached_within_m"),
        (GoToParameters, {"within_s": -1.0}, ">= 0.0 - at .*within_s"),
        (FollowParameters, {"target": ""}, "target"),
        (FollowParameters, {"localizer": ""}, "localizer"),
        (FollowParameters, {"distance_m": 0.1}, "distance_m"),
        (FollowParameters, {"speed_m_s": 0.5}, "<= 0.3 - at .*speed_m_s"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(
    kind: type[Any], given: dict[str, object], complaint: str
) -> None:
    good = {"x_m": 1.0, "y_m": 1.0} if kind is GoToParameters else {"target": "scout1"}
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert({**good, "localizer": "world", **given}, kind)
