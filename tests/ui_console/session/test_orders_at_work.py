"""Orders on a whole mission in one process: all of the backbone is real, robots of the mission's own are taken over."""

from __future__ import annotations

import asyncio
import json
import math
from importlib.util import find_spec
from typing import Any

import pytest
from orders_on_a_mission import (
    CONSOLE,
    DONE,
    ENDED,
    FAILED,
    FORWARD,
    RUNNING,
    STARTING,
    WAITING,
    Operator,
    patrols,
    play,
    until_over,
)

from backbone.bus.clock import run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.errors import Refusal, code_of
from backbone.mission.behavior_reports import BreakOff, BrokenOff
from backbone.mission_log.operators import OperatorAction
from backbone.placer.messages import Start
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process
from resource_pool.arc_client import AskPose, Pose, lift_stop, stop_robot
from ui_console.model.events import Attention, CommandApplied, GivenBack, OrderChanged, TurnedTo
from ui_console.model.orders import Order, OrderKind, group
from ui_console.model.script import read_script
from ui_console.session.scripted import ScriptDriver
from ui_console.session.teleoperation import Teleoperation


def test_the_robot_goes_from_stick_to_order_and_back_and_is_never_free_for_the_mission() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        since_s = anna.now_s
        await anna.ordered(3.0)
        assert not anna.console.is_held
        await anna.state_becomes(DONE)
        await anna.until(lambda: anna.console.is_held)
        assert anna.grants(since_s=since_s) == [f"{CONSOLE}-order-1-drive", f"{CONSOLE}-capture"]
        await anna.until(lambda: not anna.behaviors())
        assert anna.states() == [STARTING, WAITING, RUNNING, DONE]
        assert anna.console.orders == {}
        acts = [act.action for act in anna.acts if act.action in (OperatorAction.ORDER, OperatorAction.ORDER_END)]
        assert acts == [OperatorAction.ORDER, OperatorAction.ORDER_END]

    play(scene)


def test_a_press_takes_the_robot_from_its_order_at_once_and_moves_it_only_after_the_next_one() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        await anna.running.clock.sleep_s(2.0)
        since_s = anna.now_s
        anna.console.hold(FORWARD)
        assert anna.states()[-1] is ENDED
        await anna.until(lambda: anna.console.is_held, within_s=0.3)
        assert anna.grants(since_s=since_s) == [f"{CONSOLE}-capture"]
        applied = [one for one in anna.shown if isinstance(one, CommandApplied) and one.at_s >= since_s]
        assert {one.command for one in applied} <= {"halt"}
        await anna.until(lambda: not anna.behaviors())
        await anna.running.clock.sleep_s(1.0)
        anna.console.hold(FORWARD)
        await anna.until(lambda: any(isinstance(one, CommandApplied) and one.at_s >= since_s for one in anna.shown))

    play(scene)


def test_a_control_held_since_before_the_order_does_not_end_it() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()

        async def hand() -> None:
            while True:
                anna.console.hold(FORWARD, 0.3)
                await anna.running.clock.sleep_s(0.05)

        holding = asyncio.create_task(hand())
        await anna.running.clock.sleep_s(0.5)
        await anna.ordered()
        await anna.running.clock.sleep_s(2.0)
        assert anna.state() is RUNNING
        holding.cancel()
        await anna.running.clock.sleep_s(0.5)
        anna.console.hold(FORWARD, 0.3)
        assert anna.state() is ENDED

    play(scene)


def test_a_failed_order_says_why_and_leaves_the_robot_with_the_stick() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        since_s = anna.now_s
        await anna.ordered(1.0, y_m=-1.0)
        await anna.until(lambda: anna.console.is_held)
        [failed] = [one.given for one in anna.shown if isinstance(one, OrderChanged) and one.given.state is FAILED]
        assert failed.why == "scout1 sees a wall"
        assert not [arc for arc in anna.grants(since_s=since_s) if not arc.startswith(CONSOLE)]

    play(scene)


def test_an_order_that_says_so_gives_the_robot_back_to_the_mission() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(1.0, then_release=True)
        await anna.until(lambda: anna.grantee() == "patrol-scout1-drive")
        assert anna.states()[-1] is DONE
        assert not anna.console.is_held
        assert not anna.behaviors()

    play(scene)


@pytest.mark.parametrize("returns", [False, True], ids=["still away", "back"])
def test_an_order_that_is_over_while_its_operator_is_away_gives_the_robot_back(returns: bool) -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(6.0)
        await anna.until(lambda: any(isinstance(event, Attention) for event in anna.shown))
        if returns:
            anna.console.touch()
        await anna.state_becomes(DONE)
        holder = f"{CONSOLE}-capture" if returns else "patrol-scout1-drive"
        await anna.until(lambda: anna.grantee() == holder)
        assert anna.console.is_held is returns

    play(scene, away_after_s=4.0)


def test_giving_the_robot_back_ends_its_order() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        await anna.console.give_back()
        assert not anna.behaviors()
        assert anna.states()[-1] is ENDED
        assert isinstance(anna.shown[-1], GivenBack)
        await anna.until(lambda: anna.grantee() == "patrol-scout1-drive", within_s=1.0)
        await anna.running.clock.sleep_s(3.0)
        assert anna.grantee() == "patrol-scout1-drive"

    play(scene)


def test_a_newer_order_has_the_robot_right_after_the_older() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        since_s = anna.now_s
        await anna.ordered()
        anna.console.order(Order(OrderKind.GO_TO, "scout1", 1.0))
        await anna.until(lambda: anna.grantee() == f"{CONSOLE}-order-2-drive")
        await anna.until(lambda: anna.behaviors() == [f"{CONSOLE}-order-2"])
        await anna.until(lambda: anna.console.is_held)
        arcs = [f"{CONSOLE}-{what}" for what in ("order-1-drive", "order-2-drive", "capture")]
        assert anna.grants(since_s=since_s) == arcs
        assert anna.states() == [STARTING, WAITING, RUNNING, ENDED, STARTING, WAITING, RUNNING, DONE]

    play(scene)


def test_one_person_holds_two_robots_and_the_order_of_the_first_goes_on() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        since_s = anna.now_s
        await anna.ordered(6.0)
        await anna.console.switch("scout2")
        await anna.holds("scout2")
        assert anna.state("scout1") is RUNNING
        await anna.state_becomes(DONE)
        await anna.running.clock.sleep_s(3.0)
        assert anna.grantee("scout1") == f"{CONSOLE}-order-1-drive"
        assert anna.console.is_held
        await anna.console.switch("scout1")
        await anna.until(lambda: anna.console.is_held and not anna.behaviors())
        assert not [arc for arc in anna.grants(since_s=since_s) if not arc.startswith(CONSOLE)]

    play(scene)


def test_a_robot_is_left_right_after_its_order_and_is_never_free_for_the_mission() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        since_s = anna.now_s
        anna.console.order(Order(OrderKind.GO_TO, "scout1", 2.0))
        await anna.console.switch("scout2")
        await anna.holds("scout2")
        await anna.state_becomes(DONE)
        assert anna.grants(since_s=since_s) == [f"{CONSOLE}-order-1-drive"]

    play(scene)


def test_the_stick_turns_to_a_robot_whose_order_goes_on_and_takes_it_at_a_touch() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        await anna.console.switch("scout2")
        await anna.holds("scout2")
        await anna.console.switch("scout1")
        assert anna.shown[-1] == TurnedTo(anna.now_s, "scout1") or TurnedTo in map(type, anna.shown)
        await anna.running.clock.sleep_s(2.0)
        assert (anna.state(), anna.console.is_held) == (RUNNING, False)
        anna.console.hold(FORWARD)
        await anna.until(lambda: anna.console.is_held)
        assert anna.states()[-1] is ENDED

    play(scene)


def test_a_group_of_robots_is_ordered_at_once() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        robots = ["scout1", "scout2", "scout3"]
        anna.console.order_group(group(Order(OrderKind.GO_TO, "", 4.0), robots))
        await anna.until(lambda: {anna.state(robot) for robot in robots} == {RUNNING})
        assert sorted(anna.console.orders) == robots
        await anna.until(lambda: anna.console.is_held)
        await anna.until(lambda: [anna.states(robot)[-1] for robot in robots] == [DONE] * 3)
        assert sorted(anna.console.orders) == robots[1:]

    play(scene)


def test_an_order_waits_while_its_robot_is_stopped_and_goes_on_after_the_lift() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(4.0)
        stop = await stop_robot(anna.running.bus, "scout1", "", "ben")
        await anna.running.clock.sleep_s(8.0)
        assert anna.state() is RUNNING
        assert anna.behaviors()
        await lift_stop(anna.running.bus, stop, "ben")
        await anna.state_becomes(DONE)

    play(scene)


def test_the_end_of_a_console_ends_its_orders() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        await anna.running.stop(CONSOLE)
        assert not anna.behaviors()
        await anna.until(lambda: anna.grantee() == "patrol-scout1-drive", within_s=1.0)

    play(scene)


def test_a_killed_console_takes_its_orders_with_it_within_a_second() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        anna.running.hosts.kill(CONSOLE, math.inf)
        await anna.until(lambda: anna.grantee() == "patrol-scout1-drive", within_s=1.5)
        await anna.until(lambda: not anna.behaviors(), within_s=1.0)

    play(scene)


def test_a_console_that_answers_nothing_loses_its_orders() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        anna.console.answer = never  # type: ignore[method-assign]
        await anna.until(lambda: not anna.behaviors(), within_s=3.0)
        assert anna.grantee() == "patrol-scout1-drive"

    play(scene)


def test_only_the_console_of_an_order_can_break_it_off() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered()
        for behavior in (f"{CONSOLE}-order-1", "patrol-scout1"):
            with pytest.raises(Refusal) as refused:
                await anna.running.bus.ask(f"mission_control/{behavior}", BreakOff(), BrokenOff, within_s=1.0)
            assert code_of(refused.value) == "behavior.not_your_order"
        await anna.running.clock.sleep_s(1.0)
        assert anna.state() is RUNNING

    play(scene)


async def never(_asked: Any) -> Any:
    await asyncio.Event().wait()


@pytest.mark.parametrize(
    ("order", "why"),
    [
        (Order(OrderKind.GO_TO, "scout9", 1.0), "no robot is named"),
        (Order(OrderKind.FOLLOW, "scout1", target="anna"), "has no behavior follow"),
    ],
)
def test_an_impossible_order_fails_with_a_remedy_and_the_stick_keeps_its_robot(order: Order, why: str) -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        anna.console.order(order)
        await anna.state_becomes(FAILED, order.robot)
        [failed] = [one.given for one in anna.shown if isinstance(one, OrderChanged) and one.given.state is FAILED]
        assert why in failed.why
        await anna.running.clock.sleep_s(1.0)
        assert anna.console.is_held
        assert anna.console.orders == {}

    play(scene)


@pytest.mark.skipif(find_spec("mission_control.behaviors.go_to") is None, reason="no behavior goes to places yet")
def test_a_robot_is_sent_to_a_place_and_its_order_says_where_it_arrived() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        begin = await anna.running.bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=1.0)
        anna.console.order(Order(OrderKind.GO_TO, "scout1", 2.0, 1.5))
        await anna.until(lambda: anna.states()[-1] is DONE, within_s=60.0)
        there = await anna.running.bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=1.0)
        assert math.hypot(there.x_m - 2.0, there.y_m - 1.5) < 0.15, (begin, there)
        await anna.until(lambda: anna.console.is_held)
        done = [one.given for one in anna.shown if isinstance(one, OrderChanged) and one.given.state is DONE]
        assert done[0].why.startswith("at ")
        assert "simulator" in done[0].by

    play(scene, is_real=True)


def run_script(lines: list[str]) -> tuple[int, list[dict[str, Any]]]:
    """Return exit code and answers of a script that drives scout1 in the mission."""
    told: list[dict[str, Any]] = []
    made: list[Teleoperation] = []
    driver = ScriptDriver(lambda line: told.append(json.loads(line)), read_script("\n".join(lines)))

    def console(launch: Launch, bus: Bus, clock: Clock) -> Teleoperation:
        made.append(Teleoperation(launch, bus, clock, show=driver.show, work=driver.drive, watches=False))
        return made[-1]

    async def main() -> None:
        async with mission_in_one_process(patrols(), consoles={"console": console}) as running:
            await running.start(Start("console", CONSOLE, {"robot": "scout1", "priority": 100}))
            await asyncio.wait_for(until_over(running, CONSOLE), 60.0)

    run_virtual(main())
    return driver.exit_code(made[0]), told


def test_a_script_waits_for_the_end_of_its_order_then_drives_on_and_gives_the_robot_back() -> None:
    code, told = run_script(
        [
            '{"at_s":0,"order":"go_to","x_m":4,"y_m":1,"until_done":true}',
            '{"at_s":0.5,"forward_m_s":0.1}',
            '{"at_s":12,"release":true}',
        ]
    )
    assert code == 0, told
    words = [one["event"] for one in told if one["event"] in ("granted", "order", "applied", "released")]
    done = [at for at, one in enumerate(told) if one["event"] == "order" and one["state"] == "done"]
    assert len(done) == 1
    assert "applied" not in [one["event"] for one in told[: done[0]]]
    assert told[done[0] + 1]["event"] == "granted"
    assert "applied" in [one["event"] for one in told[done[0] :]]
    assert words[-1] == "released"
    assert told[done[0]]["line"] == "scout1: go to 4, 1 (done: scout1 is there)"


def test_a_script_whose_order_fails_ends_with_a_refusal() -> None:
    code, told = run_script(['{"at_s":0,"order":"follow","target":"anna","until_done":true}'])
    assert code == 5, told
    states = [one["state"] for one in told if one["event"] == "order"]
    assert (states[0], states[-1]) == ("starting", "failed"), "nobody is named anna"
