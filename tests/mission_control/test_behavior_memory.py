"""A behavior whose process is killed continues from its progress; one that is started again begins anew."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, ClassVar

import msgspec
import numpy as np
import pytest
from behaviors_of_a_placer import CLASSES, MADE, node, root, stop
from fake_resource_pool import FakePlacer, Run, with_placer

from backbone.atomic_file import replace_file
from backbone.exchange import SwapClass, Swapped
from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behavior_memory import CALM_S, MOST_RECALLS
from mission_control.behaviors.fallback import Fallback
from mission_control.behaviors.repeat import Repeat
from mission_control.behaviors.sequence import Sequence
from mission_control.behaviors.timeout import Timeout
from mission_control.messages import BehaviorStatus

Scene = Callable[[FakePlacer], Awaitable[None]]
SUCCESS, FAILURE, RUNNING = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE, BehaviorStatus.RUNNING


class Steps(msgspec.Struct, frozen=True):
    number: int


class Jumps(msgspec.Struct, frozen=True):
    height_m: str


class WalkerParameters(BehaviorParameters, frozen=True, kw_only=True):
    pace: float = 1.0


class Walker(Behavior[WalkerParameters]):
    """Counts its steps."""

    parameters_type = WalkerParameters
    memory_type = Steps
    recalled: ClassVar[list[int]] = []

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.number = 0

    def memory(self) -> Steps:
        return Steps(self.number)

    def recall(self, memory: Steps) -> None:
        self.number = memory.number
        self.recalled.append(memory.number)

    def step(self) -> None:
        self.number += 1
        self.tell_parent({"steps": self.number})


class Jumper(Behavior[WalkerParameters]):
    """Another class that is put in the place of a walker."""

    parameters_type = WalkerParameters
    memory_type = Jumps
    recalled: ClassVar[list[object]] = []

    def recall(self, memory: Jumps) -> None:
        self.recalled.append(memory)


OWN = {
    **CLASSES,
    "walker": Walker,
    "jumper": Jumper,
    "sequence": Sequence,
    "fallback": Fallback,
    "repeat": Repeat,
    "timeout": Timeout,
}


@pytest.fixture
def kept_world(local_mission: Any, tmp_path: Path) -> Run:
    """Run a scene with a placer whose components have a folder of the mission."""
    Walker.recalled, Jumper.recalled = [], []
    run = with_placer(local_mission, OWN)

    def with_folder(scene: Scene) -> None:
        async def scene_in_folder(placer: FakePlacer) -> None:
            placer.run_directory = str(tmp_path)
            await scene(placer)

        run(scene_in_folder)

    return with_folder


async def die(placer: FakePlacer, name: str) -> Any:
    """Kill it, and start it again as its creator does."""
    await placer.kill(name)
    return await placer.restart(name)


def test_a_killed_behavior_continues_from_its_progress(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        walker.step()
        assert (await die(placer, "walker")).number == 2

    kept_world(scene)


def test_a_behavior_that_is_ordered_again_begins_anew(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        await stop(placer, "walker")
        assert (await root(placer, node("walker", "walker"))).number == 0

    kept_world(scene)


@pytest.mark.parametrize("kind", ["other parameters", "another class"])
def test_a_memory_for_another_work_is_not_used(kept_world: Run, kind: str) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        order = placer.placed["walker"]
        is_other = kind == "another class"
        placer.placed["walker"] = msgspec.structs.replace(
            order,
            type="jumper" if is_other else order.type,
            parameters=order.parameters if is_other else {**order.parameters, "pace": 2.0},
        )
        await die(placer, "walker")
        assert (Walker.recalled, Jumper.recalled) == ([], [])

    kept_world(scene)


def test_a_damaged_memory_is_left_with_a_warning(
    kept_world: Run, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        replace_file(tmp_path / "kept" / "behaviors" / "walker", b"\x99torn")
        walker = await die(placer, "walker")
        assert walker.number == 0
        walker.step()
        assert (await die(placer, "walker")).number == 1

    kept_world(scene)
    assert "walker begins anew" in caplog.text


def test_a_report_that_cannot_be_written_keeps_a_behavior_from_nothing(
    kept_world: Run, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.finish(SUCCESS, {"distance_m": np.float32(1.5)})
        await placer.clock.sleep_s(1.0)
        assert (walker.status, placer.components["walker"]) == (SUCCESS, walker)

    kept_world(scene)
    assert "walker: its next process begins anew: Encoding objects of type numpy.float32" in caplog.text


def test_a_behavior_that_ends_again_and_again_without_progress_begins_anew(kept_world: Run) -> None:
    """Its memory may be the cause."""

    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        numbers = [(await die(placer, "walker")).number for _ in range(MOST_RECALLS + 1)]
        assert numbers == [1] * MOST_RECALLS + [0]

    kept_world(scene)


def test_a_behavior_that_lives_for_a_while_in_between_keeps_its_memory(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        for _ in range(MOST_RECALLS + 1):
            walker = await die(placer, "walker")
            await placer.clock.sleep_s(CALM_S)
        assert walker.number == 1

    kept_world(scene)


def test_a_killed_sequence_continues_with_its_present_child(kept_world: Run) -> None:
    """It once ended the child and drove the way of the first one again."""

    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "sequence", children=[node("first"), node("second")]))
        await placer.wait(lambda: "first" in placer.components)
        placer.components["first"].finish(SUCCESS)
        await placer.wait(lambda: "second" in placer.components)
        second = placer.components["second"]
        top = await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert (top.children, placer.components["second"]) == ({"first": SUCCESS, "second": RUNNING}, second)
        assert placer.started == ["top", "first", "second", "top"]
        second.finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)

    kept_world(scene)


def test_a_child_that_finishes_while_its_parent_is_away_counts_once(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(
            placer, node("top", "repeat", children=[node("a")], parameters={"num_cycles": 3, "pause_s": 0.0})
        )
        await placer.wait(lambda: "a" in placer.components)
        await placer.kill("top")
        placer.components["a"].finish(SUCCESS)
        await placer.clock.sleep_s(1.0)
        top = await placer.restart("top")
        await placer.wait(lambda: placer.started.count("a") == 2)
        for number in (2, 3):
            await placer.wait(lambda number=number: placer.started.count("a") == number and "a" in placer.components)
            placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)
        assert placer.started.count("a") == 3

    kept_world(scene)


def test_a_parent_killed_while_it_ends_a_child_ends_it_before_the_next_start(kept_world: Run) -> None:
    """Else the finished child was adopted as the next cycle, which so never ran."""

    async def scene(placer: FakePlacer) -> None:
        top = await root(
            placer, node("top", "repeat", children=[node("a")], parameters={"num_cycles": 2, "pause_s": 0.0})
        )
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        placer.components["a"].finish(SUCCESS)
        await placer.clock.sleep_s(1.0)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: placer.started.count("a") == 2 and "a" in placer.components)
        await placer.clock.sleep_s(3.0)
        assert (top.status, placer.started.count("a")) == (RUNNING, 2)
        placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)

    kept_world(scene)


def test_a_child_that_its_parent_starts_again_begins_anew(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        again = node("top", "repeat", children=[node("walker", "walker")], parameters={"num_cycles": 2, "pause_s": 0.0})
        await root(placer, again)
        await placer.wait(lambda: "walker" in placer.components)
        first = placer.components["walker"]
        first.step()
        first.finish(SUCCESS)
        await placer.wait(lambda: placer.components.get("walker") not in (None, first))
        await placer.clock.sleep_s(1.0)
        assert (placer.components["walker"].number, Walker.recalled) == (0, [])

    kept_world(scene)


def test_what_is_lost_with_placer_and_creator_carries_on(kept_world: Run) -> None:
    """The owners order all of it again, by the same ids."""

    async def scene(placer: FakePlacer) -> None:
        tree = node("top", "sequence", children=[node("a"), node("walker", "walker")])
        order = msgspec.structs.replace(behavior_order(tree, [("iros2001", 10)]), order_id="1.0")
        await placer.launch(order)
        await placer.wait(lambda: "a" in placer.components)
        placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: "walker" in placer.components)
        placer.components["walker"].step()
        for name in ("top", "walker"):
            await placer.kill(name)
            placer.lose(name)
        await placer.launch(order)
        await placer.wait(lambda: "walker" in placer.components)
        assert (placer.components["walker"].number, placer.started.count("a")) == (1, 1)

    kept_world(scene)


def test_a_child_that_a_person_stopped_stays_stopped(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= placer.components.keys())
        await stop(placer, "a")
        await placer.wait(lambda: "a" not in top.children)
        await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert placer.started.count("a") == 1

    kept_world(scene)


def test_a_behavior_killed_before_its_parent_knew_its_end_reports_it(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "fallback", children=[node("a", "walker"), node("b")]))
        await placer.wait(lambda: "a" in placer.components)
        await placer.kill("top")
        placer.components["a"].finish(FAILURE, {"detail": "the way is blocked"})
        await placer.clock.sleep_s(1.0)
        await die(placer, "a")
        again = placer.components["a"]
        assert (again.status, again.feedback) == (FAILURE, "finished: failure")
        top = await placer.restart("top")
        await placer.wait(lambda: "b" in placer.components)
        assert top.feedback == "runs b, 2 of 2, because a failed: the way is blocked"

    kept_world(scene)


def test_a_finished_parent_that_is_killed_still_ends_its_children(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "timeout", children=[node("a")], parameters={"seconds": 5.0}))
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        await placer.clock.sleep_s(6.0)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: "a" not in placer.components, within_s=3.0)
        await placer.wait(lambda: top.status is FAILURE, within_s=3.0)
        top = await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert (top.status, placer.started.count("a")) == (FAILURE, 1)

    kept_world(scene)


def test_a_behavior_that_finished_by_itself_and_is_killed_still_ends_its_children(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        top.finish(SUCCESS)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: "a" not in placer.components, within_s=3.0)
        assert top.status is SUCCESS

    kept_world(scene)


NEXT = """
from behaviors_of_a_placer import MADE
from test_behavior_memory import Walker


class Next(Walker):
    def recall(self, memory):
        MADE.append(memory)
"""


def test_a_class_that_replaces_another_one_recalls_nothing_beside_it(
    kept_world: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gets the present state of the class in charge."""
    (tmp_path / "next_walker.py").write_text(NEXT)
    monkeypatch.syspath_prepend(tmp_path)
    MADE.clear()

    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        asked = SwapClass("next_walker:Next", {}, 1.0, 2.0, user="anna")
        await placer.bus.ask("mission_control/walker", asked, Swapped, within_s=60.0)
        assert MADE == []

    kept_world(scene)


def test_a_failure_that_no_parent_hears_stays_an_absence(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.finish(FAILURE, {"code": "behavior.needs_arc", "detail": "it has no ARC"})
        await placer.clock.sleep_s(1.0)
        walker = await die(placer, "walker")
        await placer.clock.sleep_s(1.0)
        assert [absence.cause for absence in walker.absences()] == ["it has no ARC"]

    kept_world(scene)
