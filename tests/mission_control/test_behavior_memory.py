"""A behavior whose process is killed continues from its progress; one that is started again begins anew."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from behaviors_of_a_placer import MADE, node, root, stop
from fake_resource_pool import FakePlacer, Run
from mortal_behaviors import Jumper, Walker, die

from backbone.atomic_file import replace_file
from backbone.exchange import SwapClass, Swapped
from mission_control.behavior_memory import CALM_S, MOST_RECALLS
from mission_control.messages import BehaviorStatus

SUCCESS, FAILURE, RUNNING = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE, BehaviorStatus.RUNNING


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


def test_a_behavior_continues_on_another_host(kept_world: Run, tmp_path: Path) -> None:
    """From the placer's copy; back on the first host, from the newer one of both."""

    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        for host in ("other", "first", "other"):
            walker.step()
            await placer.clock.sleep_s(1.0)
            placer.run_directory = str(tmp_path / host)
            (tmp_path / host).mkdir(exist_ok=True)
            walker = await die(placer, "walker")
        assert walker.number == 3

    kept_world(scene)


def test_the_newest_progress_reaches_a_placer_that_was_away(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        await placer.clock.sleep_s(1.0)
        placer.silence()
        for _ in range(3):
            walker.step()
            await placer.clock.sleep_s(1.0)
        placer.speak()
        await placer.clock.sleep_s(1.0)
        placer.run_directory = ""
        assert (await die(placer, "walker")).number == 3

    kept_world(scene)


@pytest.mark.parametrize("is_copied", [True, False])
def test_a_damaged_memory_is_left_with_a_warning(
    kept_world: Run, tmp_path: Path, caplog: pytest.LogCaptureFixture, *, is_copied: bool
) -> None:
    async def scene(placer: FakePlacer) -> None:
        walker = await root(placer, node("walker", "walker"))
        walker.step()
        await placer.clock.sleep_s(1.0)
        replace_file(tmp_path / "kept" / "behaviors" / "walker", b"\x99torn")
        if not is_copied:
            placer.memories["walker"] = b"\x99torn"
        walker = await die(placer, "walker")
        assert walker.number == is_copied
        walker.step()
        assert (await die(placer, "walker")).number == 1 + is_copied

    kept_world(scene)
    assert "walker cannot continue from its file" in caplog.text
    assert ("walker cannot continue from the placer's copy" in caplog.text) is not is_copied


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


NEXT = """
from behaviors_of_a_placer import MADE
from mortal_behaviors import Walker


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
