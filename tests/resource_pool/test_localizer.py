"""A localizer at work in a mission on virtual time: what it says of robots that others drive."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest

from backbone.bus.clock import run_virtual
from backbone.bus.neighbor_declarations import Listening
from backbone.keys import Conversation
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from backbone.mission.report import MissionInvalid
from backbone.placer.messages import Start
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process
from resource_pool.dead_reckoning import JUMP_M
from resource_pool.localization import (
    AskFloorPlan,
    AskHome,
    AskPose,
    FloorPlan,
    LandmarkSighting,
    Pose,
    PoseSource,
    ShapeKind,
    UnknownPlace,
)
from resource_pool.localizer import LOST_M, PLACED_M, Localizer, LocalizerParameters
from resource_pool.messages import Applied, Readings

LOCALIZER, WORLD, SCOUT = "resource_pool/localizer", "resource_pool/world", "resource_pool/scout1"

MISSION = """
<mission name="places" priority="10">
  <resources>
    <resource type="command_radio" name="radio" sharable="true"/>
    <resource type="scout" name="scout1">
      <uses type="command_radio" name="radio"/><parameter name="network_id" value="1"/>
    </resource>
    <resource type="localizer" name="localizer">%s</resource>
  </resources>
  <world>
    <room width-m="6" depth-m="4"/>
    <furniture name="box" x-m="5" y-m="3" width-m="0.4" depth-m="0.6" height-m="0.3"/>
    <ramp name="slope" x-m="5" y-m="1" length-m="1" width-m="0.5" height-m="0.1" heading-deg="90"/>
    <dark name="corner" x-m="0.5" y-m="3.5" width-m="1" depth-m="1" height-m="1"/>
    <landmark name="base" x-m="0.1" y-m="2" heading-deg="0"/>
    <robot name="scout1" x-m="1" y-m="1" heading-deg="90"/>
  </world>
  <behaviors>%s</behaviors>
</mission>
"""
PATROL = """
<behavior type="patrol" name="patrol" priority="1">
  <parameter name="waypoints" value="1,2 2.5,2 2.5,1 1,1"/><parameter name="rounds" value="1"/>
  <parameter name="localizer" value="%s"/>
  <arc kind="drive" minimum-runtime-s="5" period-s="0.1"><wish type="scout" name="scout1"/></arc>
</behavior>
"""


def mission(behaviors: str = "", **parameters: str) -> MissionDescription:
    given = "".join(f'<parameter name="{name}" value="{value}"/>' for name, value in parameters.items())
    return read_mission_bytes((MISSION % (given, behaviors)).encode(), "places.xml")


@asynccontextmanager
async def up(description: MissionDescription) -> AsyncIterator[RunningMission]:
    async with mission_in_one_process(description) as running:
        yield running


@asynccontextmanager
async def another(running: RunningMission, folder: Path) -> AsyncIterator[str]:
    """Give the address of one more localizer, which keeps its beliefs in this folder; at the end it falls."""
    launch = msgspec.structs.replace(running.component("localizer").launch, name="other", run_directory=str(folder))
    bus = running.network.join(launch.address, running.clock)
    living = asyncio.create_task(Localizer(launch, bus, running.clock).run())
    await running.clock.sleep_s(0.5)
    yield launch.address
    living.cancel()
    await asyncio.wait({living})


async def ask(running: RunningMission, question: Message, reply: type[Any], at: str = LOCALIZER) -> Any:
    return await running.bus.ask(at, question, reply, within_s=1.0)


async def believed(running: RunningMission) -> Pose:
    return await ask(running, AskPose("scout1"), Pose)


async def truth(running: RunningMission) -> Pose:
    return await ask(running, AskPose("scout1"), Pose, WORLD)


def applied(running: RunningMission, command: str, **values: float) -> None:
    """Publish a motion as the robot's RC does."""
    rc = running.network.join(SCOUT, running.clock)
    told = Applied("scout1", 1, running.clock.now_s(), command, values)
    rc.publish(SCOUT, Conversation.MOTIONS, told)


def error_m(one: Pose, other: Pose) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def test_it_begins_where_the_mission_file_puts_the_robots_and_knows_the_room() -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            pose = await believed(running)
            assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx((1, 1, math.pi / 2))
            assert (pose.source, pose.spread_m) == (PoseSource.DEAD_RECKONING, PLACED_M)
            assert error_m(await ask(running, AskHome("scout1"), Pose), pose) == 0
            assert error_m(await ask(running, AskHome("scout1"), Pose, WORLD), pose) == 0
            plan = await ask(running, AskFloorPlan(), FloorPlan)
            assert plan == await ask(running, AskFloorPlan(), FloorPlan, WORLD)
            assert (plan.width_m, plan.depth_m) == (6, 4)
            assert {shape.name: shape.kind for shape in plan.shapes} == {
                "box": ShapeKind.FURNITURE,
                "slope": ShapeKind.RAMP,
                "corner": ShapeKind.DARK,
                "base": ShapeKind.LANDMARK,
            }
            box = await ask(running, AskPose("box"), Pose)
            assert (box.x_m, box.y_m) == (5, 3)
            for question in (AskPose("nobody"), AskHome("nobody"), AskHome("box")):
                with pytest.raises(UnknownPlace, match="scout1"):
                    await ask(running, question, Pose)

    run_virtual(scene())


def test_places_and_boards_of_its_own_parameters_come_before_those_of_the_world() -> None:
    async def scene() -> None:
        async with up(mission(starts="scout1:2,3,-90", landmarks="door:6,2,180", width_m="7")) as running:
            pose = await believed(running)
            assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx((2, 3, -math.pi / 2))
            plan = await ask(running, AskFloorPlan(), FloorPlan)
            assert (plan.width_m, plan.depth_m, plan.shapes[-1].name) == (7, 4, "door")

    run_virtual(scene())


def test_a_place_that_means_nothing_is_a_fault_of_the_mission_file() -> None:
    with pytest.raises(MissionInvalid, match="is no place"):
        mission(starts="scout1")


def drawn(folder: Path, content: bytes) -> MissionDescription:
    """Return the mission with this picture of its floor."""
    (folder / "plan.png").write_bytes(content)
    text = MISSION % ('<parameter name="floor_plan" value="plan.png"/>', "")
    return read_mission_bytes(text.encode(), str(folder / "places.xml"))


def test_a_picture_of_the_floor_travels_with_the_mission(tmp_path: Path) -> None:
    picture = b"\x89PNG\r\n\x1a\n" + bytes(300_000)

    async def scene() -> None:
        async with mission_in_one_process(drawn(tmp_path, picture)) as running:
            (tmp_path / "plan.png").unlink()
            plan = await running.bus.ask(LOCALIZER, AskFloorPlan(), FloorPlan, within_s=1.0)
            assert (plan.image, plan.width_m) == (picture, 6.0)

    run_virtual(scene())


@pytest.mark.parametrize(
    ("content", "why"),
    [(b"<svg/>", "neither PNG nor JPEG"), (b"\xff\xd8\xff" + bytes(400_000), "larger than 393216 bytes")],
)
def test_a_picture_that_cannot_be_used_is_a_fault_of_the_mission_file(content: bytes, why: str, tmp_path: Path) -> None:
    with pytest.raises(MissionInvalid, match=f":8:78: floor plan 'plan.png' is {why}"):
        drawn(tmp_path, content)


def test_without_a_world_it_needs_its_own_places_only() -> None:
    given = msgspec.convert({"starts": "scout1:1,2", "width_m": 5, "depth_m": 4}, LocalizerParameters)
    assert list(given.begins()) == ["scout1"]
    assert given.plan() == FloorPlan(5.0, 4.0)


def test_it_follows_a_robot_that_patrols_by_it_and_its_spread_covers_its_error() -> None:
    async def scene() -> None:
        async with up(mission(PATROL % "localizer")) as running:
            heard: list[tuple[float, Pose]] = []
            running.bus.subscribe(
                LOCALIZER, Conversation.POSES, Pose, lambda said: heard.append((running.clock.now_s(), said.body))
            )
            patrol: Any = running.component("patrol")
            worst_m = 0.0
            while not patrol.status.is_final:
                await running.clock.sleep_s(0.25)
                pose = await believed(running)
                wrong_m = error_m(pose, await truth(running))
                worst_m = max(worst_m, wrong_m)
                assert wrong_m <= 2 * pose.spread_m, (wrong_m, pose)
            assert running.clock.now_s() < 90
            assert 0.0 < worst_m < 0.5  # measured: 0.36 m on the 5 m of the square
            await running.clock.sleep_s(1.0)
            assert heard[-1][1].x_m == (await believed(running)).x_m
            pauses = [after - before for (before, _), (after, _) in pairwise(heard)]
            assert min(pauses) > 0.19
            quiet = len(heard)
            await running.clock.sleep_s(5.0)
            assert len(heard) == quiet

    run_virtual(scene())


def test_a_sighting_of_a_landmark_brings_it_to_the_landmarks_frame() -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            await running.clock.sleep_s(1.0)
            seer = running.network.join("mission_control/servo", running.clock)
            sighting = LandmarkSighting(running.clock.now_s(), "scout1", 1.2, 0.1, 0.2, 0.04)
            seer.publish(seer.source, Conversation.SIGHTINGS, sighting)
            await running.clock.sleep_s(0.1)
            pose = await believed(running)
            assert (pose.x_m, pose.y_m) == pytest.approx((1.3, 1.9))
            assert math.cos(pose.heading_rad - math.pi - 0.2) == pytest.approx(1.0)
            assert (pose.source, pose.spread_m) == (PoseSource.LANDMARK, 0.04)

    run_virtual(scene())


def test_a_jump_makes_the_spread_larger() -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            applied(running, "jump")
            await running.clock.sleep_s(0.1)
            assert (await believed(running)).spread_m == pytest.approx(math.hypot(PLACED_M, JUMP_M))

    run_virtual(scene())


def test_a_robots_own_count_comes_before_what_was_commanded() -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            rc = running.network.join(SCOUT, running.clock)
            for way_m in (10.0, 10.5):
                applied(running, "move", forward_m_s=0.1, turn_rad_s=0.0)
                told = Readings("scout1", running.clock.now_s(), {"way_m": way_m, "turned_rad": 2.0})
                rc.publish(SCOUT, Conversation.READINGS, told)
                await running.clock.sleep_s(0.2)
            applied(running, "halt")
            await running.clock.sleep_s(0.1)
            pose = await believed(running)
            assert (pose.x_m, pose.y_m) == pytest.approx((1.0, 1.52))

    run_virtual(scene())


def test_what_another_than_the_robots_rc_says_of_its_motion_is_not_believed() -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            stranger = running.network.join("resource_pool/radio2", running.clock)
            told = Applied("scout1", 1, running.clock.now_s(), "move", {"forward_m_s": 0.3, "turn_rad_s": 0.0})
            stranger.publish(stranger.source, Conversation.MOTIONS, told)
            stranger.publish(SCOUT, Conversation.MOTIONS, told)
            await running.clock.sleep_s(1.0)
            assert (await believed(running)).y_m == 1.0

    run_virtual(scene())


def test_without_a_memory_a_restarted_localizer_is_sure_of_no_robot_that_was_moved() -> None:
    async def scene() -> None:
        async with up(mission(PATROL % "world")) as running:
            await running.clock.sleep_s(8.0)
            assert (await believed(running)).spread_m < 1.0
            await running.stop("localizer")
            [resource] = [one for one in running.description.resources if one.name == "localizer"]
            await running.start(Start("localizer", "localizer", resource.rc_parameters()))
            await running.clock.sleep_s(1.0)
            assert (await believed(running)).spread_m >= LOST_M

    run_virtual(scene())


@pytest.mark.parametrize("runs_s", [0.4, 1.0, 5.0])
@pytest.mark.parametrize("dead_s", [0.0, 0.3, 1.0, 20.0])
def test_a_restarted_localizer_misses_no_motion(tmp_path: Path, runs_s: float, dead_s: float) -> None:
    async def scene() -> None:
        async with up(mission(PATROL % "world")) as running:
            async with another(running, tmp_path):
                await running.clock.sleep_s(runs_s)
            await running.clock.sleep_s(dead_s)
            async with another(running, tmp_path) as other:
                after, lasting = await ask(running, AskPose("scout1"), Pose, other), await believed(running)
                assert error_m(after, lasting) < 0.01
                assert math.cos(after.heading_rad - lasting.heading_rad) > math.cos(0.02)

    run_virtual(scene())


@contextmanager
def deaf(running: RunningMission, listener: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Deliver no publication to this address; afterwards its watchers get the tokens anew, as after a cut."""
    network = running.network
    carry = network.carry_publication

    def carry_to_others(listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        if listening.owner.source != listener:
            carry(listening, address, envelope)

    with monkeypatch.context() as cut:
        cut.setattr(network, "carry_publication", carry_to_others)
        yield
    for watching in network.watchers:
        if watching.owner.source == listener:
            network.carry_life(watching, SCOUT, False)
            network.carry_life(watching, SCOUT, True)


@pytest.mark.parametrize("ends", [False, True])
def test_after_a_cut_of_its_link_a_localizer_gets_the_motions_that_it_missed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, *, ends: bool
) -> None:
    async def scene() -> None:
        async with up(mission(PATROL % "world")) as running, another(running, tmp_path) as other:
            await running.clock.sleep_s(3.0)
            with deaf(running, other, monkeypatch):
                await running.clock.sleep_s(6.0)
                if ends:
                    await running.stop("patrol")
                    await running.clock.sleep_s(1.0)
                wrong_m = error_m(await ask(running, AskPose("scout1"), Pose, other), await believed(running))
                assert wrong_m > 0.3
            await running.clock.sleep_s(0.5)
            after, lasting = await ask(running, AskPose("scout1"), Pose, other), await believed(running)
            assert (after.x_m, after.y_m, after.heading_rad) == pytest.approx(
                (lasting.x_m, lasting.y_m, lasting.heading_rad), abs=0.01
            )
            assert after.spread_m == pytest.approx(lasting.spread_m, rel=0.1)

    run_virtual(scene())


def test_a_memory_that_cannot_be_read_makes_it_sure_of_nothing(tmp_path: Path) -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            (tmp_path / "kept" / "localizers").mkdir(parents=True)
            (tmp_path / "kept" / "localizers" / "other").write_bytes(b"torn")
            async with another(running, tmp_path) as other:
                assert (await ask(running, AskPose("scout1"), Pose, other)).spread_m >= LOST_M

    run_virtual(scene())


def test_a_place_where_nothing_can_be_kept_keeps_it_from_nothing(tmp_path: Path) -> None:
    async def scene() -> None:
        async with up(mission()) as running:
            (tmp_path / "kept").touch()  # no folder can be made there
            async with another(running, tmp_path) as other:
                applied(running, "move", forward_m_s=0.1, turn_rad_s=0.0)
                await running.clock.sleep_s(2.0)
                assert (await ask(running, AskPose("scout1"), Pose, other)).y_m == pytest.approx(1.05)

    run_virtual(scene())


def test_a_robots_rc_publishes_each_motion_and_each_halt_without_a_command() -> None:
    async def scene() -> None:
        async with up(mission(PATROL % "world")) as running:
            told: list[Applied] = []
            running.bus.subscribe(SCOUT, Conversation.MOTIONS, Applied, lambda said: told.append(said.body))
            await running.clock.sleep_s(6.0)
            assert {one.command for one in told} == {"move"}
            straight = max(told, key=lambda one: one.values["forward_m_s"])
            assert straight.values["forward_m_s"] == pytest.approx(0.2, rel=0.1)
            assert set(straight.values) == {"left_rad_s", "right_rad_s", "forward_m_s", "turn_rad_s"}
            await running.stop("patrol")
            await running.clock.sleep_s(1.0)
            assert (told[-1].command, told[-1].values) == ("halt", {})

    run_virtual(scene())
