"""The watcher, its parent and the skeleton, each with an ARC in one process."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from fake_resource_pool import FakeArc, FakePlacer, Run, with_placer

from backbone.component.messages import Parameters, SetParameter, StoryEvent, WrongParameter
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from mission_control.behaviors.skeleton import Skeleton
from mission_control.behaviors.surveillance import Surveillance
from mission_control.behaviors.watch_for_motion import WatchForMotion
from mission_control.messages import BehaviorStatus, MotionSeen
from resource_pool.messages import WantLonger, WantRuntime

FRAME_S = 1 / 30
SIZE = {"width_px": 320, "height_px": 240}


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    classes = {"watch": WatchForMotion, "surveillance": Surveillance, "skeleton": Skeleton}
    return with_placer(local_mission, classes)


def watcher(scout: str, maximum_runtime_s: float = 0.0, **parameters: Any) -> dict[str, Any]:
    times = {"minimum_runtime_s": 5.0, "maximum_runtime_s": maximum_runtime_s}
    arc = {"kind": "capture", **times, "wish": {"scout": scout}}
    return {"type": "watch", "name": f"watch-{scout}", "priority": 3, "arc": arc, "parameters": parameters}


def room() -> np.ndarray:
    coarse = np.random.default_rng(1).integers(60, 180, (6, 8)).astype(np.uint8)
    return np.asarray(cv2.resize(coarse, (320, 240), interpolation=cv2.INTER_CUBIC), np.uint8)


async def show(placer: FakePlacer, arc: FakeArc, frames: int, *, moving: bool) -> None:
    for number in range(frames):
        picture = room()
        if moving:
            picture[100:140, 8 * number : 8 * number + 40] = 230
        arc.publish(picture.tobytes(), **SIZE, number=number)
        await placer.clock.sleep_s(FRAME_S)


@pytest.mark.parametrize(
    ("parameter", "value"), [("vision", "elsewhere"), ("view_s", 3.0), ("seed", 1), ("is_last", True), ("children", [])]
)
def test_a_watcher_refuses_what_it_cannot_change_and_watches_on(
    placer_world: Run, parameter: str, value: object
) -> None:
    async def scene(placer: FakePlacer) -> None:
        watch = await placer.launch(behavior_order(watcher("scout1"), [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        with pytest.raises(WrongParameter, match=f"cannot change {parameter} while it runs"):
            await placer.bus.ask(watch.address, SetParameter(parameter, value), Parameters, within_s=1.0)
        await placer.bus.ask(watch.address, SetParameter("frames_wanted", 2), Parameters, within_s=1.0)
        await show(placer, arc, 20, moving=False)
        await show(placer, arc, 20, moving=True)
        assert watch.statistics()["events"] == 1

    placer_world(scene)


def test_a_watcher_tells_motion_with_time_robot_and_region_and_nothing_else(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        seen: list[Any] = []
        told: list[Any] = []
        placer.bus.subscribe("mission_control/*", Conversation.EVENTS, MotionSeen, seen.append)
        placer.bus.subscribe("mission_control/*", Conversation.LOG, StoryEvent, told.append)
        watch = await placer.launch(behavior_order(watcher("scout1"), [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        await show(placer, arc, 60, moving=False)
        assert seen == []
        began_s = placer.clock.now_s()
        await show(placer, arc, 30, moving=True)
        assert len(seen) == 1
        motion = seen[0].body
        assert motion.robot == "scout1"
        assert began_s <= motion.at_s <= began_s + 0.5
        assert 80 <= motion.region.y_px <= 140
        assert seen[0].source == "mission_control/watch-scout1"
        assert seen[0].cause.startswith("resource_pool/watch-scout1-capture#")
        assert "motion seen through scout1" in told[0].body.what
        assert watch.feedback.endswith("90 frames, 1 event")

    placer_world(scene)


def test_motion_that_goes_on_is_told_once_a_second(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        seen: list[Any] = []
        placer.bus.subscribe("mission_control/*", Conversation.EVENTS, MotionSeen, seen.append)
        await placer.launch(behavior_order(watcher("scout1"), [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        await show(placer, arc, 20, moving=False)
        for _crossing in range(3):
            await show(placer, arc, 36, moving=True)
        times = [envelope.body.at_s for envelope in seen]
        assert len(times) >= 3
        assert all(later - earlier >= 1.0 for earlier, later in pairwise(times))

    placer_world(scene)


def test_a_glimpse_makes_the_slice_longer_until_it_is_certain(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        order = behavior_order(watcher("scout1", 8.0, frames_wanted=7), [("iros2001", 10)])
        watch = await placer.launch(order)
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        began_s = placer.clock.now_s()
        await show(placer, arc, 145, moving=False)
        assert arc.wishes == []
        await show(placer, arc, 20, moving=True)
        longer = [wish.until_s for wish in arc.wishes if isinstance(wish, WantLonger)]
        assert longer == sorted(set(longer))
        assert 5.0 < longer[0] - began_s < longer[-1] - began_s + 1e-9 <= 6.5
        assert watch.statistics()["events"] == 1
        asked = len(arc.wishes)
        await show(placer, arc, 20, moving=True)
        assert len(arc.wishes) == asked  # it was told: no more is needed

    placer_world(scene)


def test_a_slice_that_cannot_be_longer_is_not_asked_to_be(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await placer.launch(behavior_order(watcher("scout1", frames_wanted=7), [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        await show(placer, arc, 145, moving=False)
        await show(placer, arc, 20, moving=True)
        assert arc.wishes == []

    placer_world(scene)


def test_run_times_that_are_worked_out_are_drawn_for_each_slice_the_same_for_the_same_seed(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        asked: list[list[float]] = []
        for scout, seed in (("scout1", 1), ("scout1", 1), ("scout1", 2)):
            given = watcher(scout, view_s=2.65, frames_wanted=7, seed=seed)
            watch = await placer.launch(behavior_order(given, [("iros2001", 10)]))
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            for _turn in range(4):
                await arc.grant()
                await arc.suspend()
            times = [wish.minimum_runtime_s for wish in arc.wishes if isinstance(wish, WantRuntime)]
            asked.append([arc.parameters["minimum_runtime_s"], *times])
            watch.end("next")
            await placer.wait(lambda: not placer.components)
            placer.arcs.clear()
        assert asked[0] == asked[1] != asked[2]
        assert all(len(set(times)) == 5 for times in asked)
        assert all(0.711 <= one_s <= 0.889 for times in asked for one_s in times)

    placer_world(scene)


def test_a_suspended_watcher_keeps_its_counts_and_its_view(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watch = await placer.launch(behavior_order(watcher("scout1"), [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        for _turn in range(3):
            await arc.grant()
            await show(placer, arc, 40, moving=False)
            await arc.suspend("higher", "console-1", deadline_s=0.0)
            assert "suspended: higher by console-1" in watch.feedback
        assert "120 frames, 0 events" in watch.feedback
        assert watch.statistics()["times_suspended"] == 3

    placer_world(scene)


def test_surveillance_gathers_what_its_watchers_see(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        children = [watcher("scout1"), watcher("scout2")]
        tree = {"type": "surveillance", "name": "surveillance", "priority": 5, "children": children}
        top = await placer.launch(behavior_order(tree, [("iros2001", 10)]))
        await placer.wait(lambda: len(placer.arcs) == 2)
        for scout, arc in (("scout2", placer.arcs["watch-scout2-capture"]),):
            await arc.grant()
            await show(placer, arc, 20, moving=False)
            await show(placer, arc, 30, moving=True)
            assert f"({scout} 1)" in top.feedback
        assert top.statistics()["events_scout2"] == 1
        assert top.children == dict.fromkeys(("watch-scout1", "watch-scout2"), BehaviorStatus.RUNNING)

    placer_world(scene)


def test_surveillance_goes_on_without_a_watcher_that_fails_again_and_again(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        tree = {
            "type": "surveillance",
            "name": "surveillance",
            "priority": 5,
            "children": [watcher("scout1"), watcher("scout2")],
        }
        top = await placer.launch(behavior_order(tree, [("iros2001", 10)]))
        tried: list[Any] = []
        for _attempt in range(4):
            await placer.wait(lambda: placer.components.get("watch-scout1") not in (None, *tried))
            tried.append(placer.components["watch-scout1"])
            tried[-1].finish(BehaviorStatus.FAILURE, {"detail": "lens cap"})
        await placer.clock.sleep_s(2.0)
        assert set(placer.components) == {"surveillance", "watch-scout2"}
        assert top.status is BehaviorStatus.RUNNING

    placer_world(scene)


def test_the_skeleton_turns_keeps_count_over_a_suspension_and_succeeds(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        arc_need = {"kind": "drive", "minimum_runtime_s": 1.0}
        order = {"type": "skeleton", "name": "bones", "priority": 1, "parameters": {"turns": 2}, "arc": arc_need}
        bones = await placer.launch(behavior_order(order, [("iros2001", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        await arc.grant()
        await placer.clock.sleep_s(1.5)
        await arc.suspend()
        assert bones.turned == 1
        await arc.grant()
        await placer.wait(lambda: bones.status is BehaviorStatus.SUCCESS)
        assert bones.payload == {"turned": 2}
        await placer.wait(lambda: not placer.arcs)

    placer_world(scene)
