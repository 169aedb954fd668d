"""A behavior among an ARC and a placer, in one process on virtual time: claims, notices, what it says of itself."""

from __future__ import annotations

import subprocess
import sys

import pytest
from behaviors_of_a_placer import ARC, node, root
from fake_resource_pool import FakePlacer, Run

from backbone.component.messages import AskState, ComponentState
from backbone.errors import Refusal
from backbone.placer.messages import NoHost
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus
from resource_pool.arc_client import Noted, NotMyArc, Resumed


def test_a_behavior_claims_its_arc_with_its_path_wish_and_run_time(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        asked = placer.arcs["watch1-capture"].parameters
        assert asked["owner"] == "mission_control/watch1"
        assert asked["path"] == [["iros2001", 10], ["watch1", 3]]
        assert (asked["wish"], asked["minimum_runtime_s"], asked["console"]) == ({"scout": "scout1"}, 5.0, False)

    placer_world(scene)


def test_it_keeps_its_state_over_fifty_suspensions_and_hears_by_whom(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        for turn in range(50):
            await arc.grant()
            assert watcher.rcs == {"scout": "scout1", "framegrabber": "grabber1"}
            arc.publish(b"\0" * 4, 2, 2, turn)
            await placer.clock.sleep_s(0.1)
            await arc.suspend("higher", f"console-{turn}", deadline_s=0.0)
            assert watcher.rcs == {}
            arc.publish(b"\0" * 4, 2, 2, 1000)
            await placer.clock.sleep_s(0.1)
        assert placer.components["watch1"] is watcher
        assert watcher.heard.count("start") == 1
        assert [heard for heard in watcher.heard if heard[0] == "frame"] == [("frame", n + 1, n) for n in range(50)]
        suspensions = [heard for heard in watcher.heard if heard[0] == "suspended"]
        assert suspensions == [("suspended", "higher", f"console-{turn}") for turn in range(50)]
        assert placer.started == ["watch1", "watch1-capture"]

    placer_world(scene)


def test_before_the_end_of_a_slice_it_may_stop_cleanly(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        await arc.suspend("slice", "watch2-capture", deadline_s=0.2)
        assert watcher.heard[-2:] == [("suspending", 0.2), ("suspended", "slice", "watch2-capture")]

    placer_world(scene)


def test_only_a_behavior_that_commands_nothing_lets_its_slice_end_without_being_asked(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        for name, kind in (("looks", "spectator"), ("drives", "driver"), ("brakes", "watcher")):
            await root(placer, node(name, kind, arc=ARC))
        await placer.wait(lambda: len(placer.arcs) == 3)
        at_once = {arc: claimed.parameters["stops_at_once"] for arc, claimed in placer.arcs.items()}
        assert at_once == {"looks-capture": True, "drives-capture": False, "brakes-capture": False}

    placer_world(scene)


def test_an_arc_that_died_is_claimed_again(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["watch1-capture"].grant()
        await placer.kill("watch1-capture")
        await placer.wait(lambda: placer.arcs)
        assert watcher.heard[-1] == ("suspended", "lost", "watch1-capture")
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        arc.publish(b"\0" * 4, 2, 2, 7)
        await placer.wait(lambda: watcher.heard[-1] == ("frame", 1, 7))

    placer_world(scene)


def test_an_arc_its_creator_restarted_at_once_is_not_claimed_again_but_the_lost_grant_is_heard(
    placer_world: Run,
) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        await placer.kill("watch1-capture")
        again = await placer.restart("watch1-capture")
        again.epoch = arc.epoch
        await again.grant()
        assert [heard[0] for heard in watcher.heard[-3:]] == ["resumed", "suspended", "resumed"]
        await placer.clock.sleep_s(3.0)
        assert placer.started.count("watch1-capture") == 2

    placer_world(scene)


def test_a_notice_missed_while_the_arc_was_out_of_sight_is_made_up_for(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["watch1-capture"].grant()
        await placer.kill("watch1-capture")
        await placer.restart("watch1-capture")
        await placer.wait(lambda: watcher.heard[-1] == ("suspended", "slice", "other"))

    placer_world(scene)


def test_an_arc_left_from_an_earlier_life_is_ended_and_claimed_anew(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        old = placer.arcs["watch1-capture"]
        await placer.kill("watch1")
        await placer.restart("watch1")
        await placer.wait(lambda: placer.arcs.get("watch1-capture") not in (None, old))
        assert placer.ended == ["watch1-capture"]

    placer_world(scene)


@pytest.mark.parametrize("named", ["other", "watch1-capture"])
def test_a_notice_of_another_component_than_its_arc_is_refused(placer_world: Run, named: str) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        with pytest.raises(NotMyArc):
            await placer.bus.ask("mission_control/watch1", Resumed(named, {}, {}, 1.0), Noted, within_s=1.0)
        assert top.suspended_because

    placer_world(scene)


def test_a_root_that_cannot_claim_its_arc_is_reported(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.refusals["capture"] = NoHost("no host has tag gl")
        top = await root(placer, node("top", arc=ARC))
        await placer.wait(lambda: top.status.is_final)
        [absence] = top.absences()
        assert (absence.name, absence.cause, absence.doing) == ("top", "no host has tag gl", "")

    placer_world(scene)


def test_a_claim_that_is_refused_for_a_moment_is_made_again(placer_world: Run) -> None:
    """Its host was just coming back, say; the first claim of a life is no last word."""

    async def scene(placer: FakePlacer) -> None:
        placer.refusals["capture"] = NoHost("its creator is gone")
        top = await root(placer, node("top", arc=ARC))
        await placer.clock.sleep_s(2.0)
        assert [absence.name for absence in top.absences()] == ["top-capture"]
        del placer.refusals["capture"]
        await placer.clock.sleep_s(10.0)
        assert top.status is BehaviorStatus.RUNNING
        assert top.absences() == []

    placer_world(scene)


def test_it_tells_how_far_it_is_and_draws_its_branch(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        state = await placer.bus.ask("mission_control/top", AskBehavior(), BehaviorState, within_s=1.0)
        assert state.status is BehaviorStatus.RUNNING
        assert state.tree.splitlines()[1] == "└─ leaf (watcher, priority 3): running"

    placer_world(scene)


def test_it_is_shown_as_finished_with_the_last_line_of_its_work(placer_world: Run) -> None:
    """``status`` showed the last turn of a behavior for ever, as if it still worked."""

    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1"))
        watcher.report("turn 2 of 2")
        watcher.finish(BehaviorStatus.SUCCESS)
        state = await placer.bus.ask("mission_control/watch1", AskState(), ComponentState, within_s=1.0)
        assert state.feedback == "finished: success; last: turn 2 of 2"

    placer_world(scene)


def test_parameters_that_do_not_fit_are_refused_before_anything_runs(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        with pytest.raises(Refusal):
            await root(placer, node("leaf", parameters={"color": "red"}))

    placer_world(scene)


@pytest.mark.processes
def test_a_behaviors_process_loads_neither_pydantic_nor_a_screen() -> None:
    check = (
        "import sys, mission_control.behaviors.watch_for_motion, mission_control.behaviors.surveillance;"
        "import mission_control.behaviors.fallback, mission_control.behaviors.condition;"
        "sys.exit(', '.join({'pydantic', 'typer', 'textual', 'rich', 'mujoco', 'lxml'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
