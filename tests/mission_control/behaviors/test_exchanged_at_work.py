"""Shipped behaviors whose class is exchanged at work: the new one goes on where the old one was."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from test_changed_while_asking import GREY, stand

from backbone.bus.clock import run_virtual
from backbone.exchange import SwapClass, Swapped
from mission_control.behaviors.give import Give
from mission_control.behaviors.go_to import GoTo, NotThere
from mission_control.behaviors.hide import Hide
from mission_control.behaviors.jump_course import LANDED_AFTER_S
from mission_control.behaviors.jump_over import JumpOver
from mission_control.behaviors.pickup_route import PickupStage
from mission_control.behaviors.return_to_pickup import ReturnToPickup
from mission_control.behaviors.servo_to_target import ServoToTarget
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import word_of
from resource_pool.commands import Jump

OVER = {"localizer": "eye", "front": "5,0", "heading_deg": 0.0}
MOST_LOST = 8  # pictures: the first moves nothing, and a search begins with a look of half a second
RUN_UP, TAKE_OFF, BEYOND = (4.5, 0.0), (4.8, 0.0), (9.0, 0.0)


@pytest.fixture
def exchange(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[FakePlacer, Any], Awaitable[Any]]:
    """Exchange a behavior's class for one derived from it in another file; give the one that is in charge then."""
    monkeypatch.syspath_prepend(tmp_path)

    async def exchanged(placer: FakePlacer, behavior: Any) -> Any:
        kind = type(behavior)
        file = tmp_path / f"again_{kind.__name__.lower()}.py"
        file.write_text(f"from {kind.__module__} import {kind.__name__}\n\n\nclass Again({kind.__name__}):\n    pass\n")
        asked = SwapClass(f"{file.stem}:Again", prove_s=0.5)
        swapped = await placer.bus.ask(behavior.address, asked, Swapped, within_s=10.0)
        assert (swapped.is_proved, swapped.keeps_state) == (True, True), swapped.cause
        return behavior.exchanges.present

    return exchanged


def test_a_new_class_commands_nothing_before_the_robot_has_landed_and_knows_of_the_jump(
    local_mission: Any, exchange: Any
) -> None:
    async def scene() -> None:
        async with stand(local_mission, JumpOver, **OVER) as (behavior, arc, eye, placer):
            eye.at = RUN_UP
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            eye.at = TAKE_OFF
            await placer.wait(lambda: any(isinstance(command, Jump) for _at_s, _epoch, command in arc.commands), 5.0)
            jumped_s = placer.clock.now_s()
            present = await exchange(placer, behavior)
            eye.at = BEYOND
            await placer.clock.sleep_s(LANDED_AFTER_S + 1.0)
            after = [at_s for at_s, _epoch, _command in arc.commands if at_s > jumped_s]
            assert min(after) >= jumped_s + LANDED_AFTER_S - 0.1
            assert (present.status, present.payload) == (BehaviorStatus.SUCCESS, {"jumps": 1})

    run_virtual(scene())


def test_the_time_for_which_a_command_was_held_counts_for_the_new_class_too(local_mission: Any, exchange: Any) -> None:
    async def scene() -> None:
        async with stand(local_mission, Give, word="look", for_s=6.0) as (behavior, arc, _eye, placer):
            await arc.grant()
            began_s = placer.clock.now_s()
            await placer.clock.sleep_s(4.0)
            present = await exchange(placer, behavior)
            await placer.wait(lambda: present.status is BehaviorStatus.SUCCESS, 10.0)
            assert placer.clock.now_s() - began_s == pytest.approx(6.0, abs=0.2)

    run_virtual(scene())


def test_looks_around_count_for_the_new_class_too(local_mission: Any, exchange: Any) -> None:
    async def scene() -> None:
        async with stand(local_mission, Hide, looks=2) as (behavior, arc, _eye, placer):
            await arc.grant()
            behavior.search.looks = 1
            assert (await exchange(placer, behavior)).search.looks == 1

    run_virtual(scene())


def test_the_time_on_the_way_counts_for_the_new_class_too(local_mission: Any, exchange: Any) -> None:
    async def scene() -> None:
        way = {"localizer": "eye", "x_m": 5.0, "y_m": 0.0, "within_s": 3.0}
        async with stand(local_mission, GoTo, **way) as (behavior, arc, _eye, placer):
            await arc.grant()
            began_s = placer.clock.now_s()
            await placer.clock.sleep_s(2.0)
            present = await exchange(placer, behavior)
            await placer.wait(lambda: present.status is BehaviorStatus.FAILURE, 5.0)
            assert present.payload["code"] == NotThere.code
            assert placer.clock.now_s() - began_s == pytest.approx(3.0, abs=0.3)

    run_virtual(scene())


def test_turns_of_a_search_count_for_the_new_class_too(local_mission: Any, exchange: Any) -> None:
    async def pictures_until_failure(exchanged_after: int) -> int:
        async with stand(local_mission, ServoToTarget, search_turns=0.5) as (behavior, arc, _eye, placer):
            await arc.grant()
            present = behavior
            for picture in range(1000):
                if picture == exchanged_after:
                    present = await exchange(placer, behavior)
                if present.status is BehaviorStatus.FAILURE:
                    return picture
                arc.publish(GREY, 320, 240)
                await placer.clock.sleep_s(0.1)
            return 1000

    async def scene() -> None:
        undisturbed = await pictures_until_failure(-1)
        assert 10 < undisturbed < 1000
        assert await pictures_until_failure(undisturbed // 2) <= undisturbed + MOST_LOST

    run_virtual(scene())


def test_searches_in_vain_count_for_the_new_class_too(local_mission: Any, exchange: Any) -> None:
    async def scene() -> None:
        given = {"localizer": "eye", "near": "5,0", "attempts": 2}
        async with stand(local_mission, ReturnToPickup, **given) as (behavior, arc, _eye, placer):
            await arc.grant()
            behavior.route.not_found()
            present = await exchange(placer, behavior)
            assert (present.route.in_vain, present.route.stage) == (1, PickupStage.TRAVEL)

    run_virtual(scene())


@pytest.mark.parametrize("under_way", [False, True])
def test_the_class_that_comes_back_knows_of_a_jump_during_the_trial(
    local_mission: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, under_way: bool
) -> None:
    """The new class fails after the jump, or while its command is under way; the robot must land undisturbed."""
    monkeypatch.syspath_prepend(tmp_path)
    name = f"fails_{'during' if under_way else 'after'}"
    (tmp_path / f"{name}.py").write_text("from mission_control.behaviors.jump_over import JumpOver as Again\n")

    async def scene() -> None:
        async with stand(local_mission, JumpOver, **OVER) as (behavior, arc, eye, placer):
            jumped_s: list[float] = []

            def required(command: object) -> None:
                if isinstance(command, Jump):
                    jumped_s.append(placer.clock.now_s())
                    if under_way:
                        behavior.exchanges.present.fail(ValueError("planted"))

            arc.require = required
            eye.at = RUN_UP
            await arc.grant()
            swapping = asyncio.create_task(
                placer.bus.ask(behavior.address, SwapClass(f"{name}:Again", prove_s=30.0), Swapped, within_s=60.0)
            )
            await placer.clock.sleep_s(1.0)
            eye.at = TAKE_OFF
            await placer.wait(lambda: jumped_s, 5.0)
            if not under_way:
                await placer.clock.sleep_s(0.5)
                behavior.exchanges.present.fail(ValueError("planted"))
            swapped = await swapping
            assert (swapped.is_proved, behavior.exchanges.present) == (False, behavior), swapped.cause
            await placer.clock.sleep_s(0.2)
            eye.at = BEYOND
            await placer.wait(lambda: behavior.status is BehaviorStatus.SUCCESS, LANDED_AFTER_S + 2.0)
            after = [at_s for at_s, _epoch, _command in arc.commands if at_s > jumped_s[0]]
            assert min(after) >= jumped_s[0] + LANDED_AFTER_S - 0.1
            assert behavior.payload == {"jumps": 1}

    run_virtual(scene())


def test_the_class_that_comes_back_knows_of_a_jump_that_was_commanded_by_its_word(
    local_mission: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "jumps_by_word.py").write_text(
        "from mission_control.behaviors.jump_over import JumpOver\n\n\n"
        "class Again(JumpOver):\n"
        "    async def drive_on(self, robot):\n"
        "        await self.held.give('jump', {})\n"
        "        raise ValueError('planted')\n"
    )

    async def scene() -> None:
        async with stand(local_mission, JumpOver, **OVER) as (behavior, arc, eye, placer):
            eye.at = RUN_UP
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            asked = SwapClass("jumps_by_word:Again", prove_s=30.0)
            swapped = await placer.bus.ask(behavior.address, asked, Swapped, within_s=60.0)
            assert "planted" in swapped.cause
            [jumped_s] = [at_s for at_s, _epoch, command in arc.commands if word_of(command) == Jump.word()]
            eye.at = BEYOND
            await placer.wait(lambda: behavior.status is BehaviorStatus.SUCCESS, LANDED_AFTER_S + 2.0)
            after = [at_s for at_s, _epoch, _command in arc.commands if at_s > jumped_s]
            assert min(after) >= jumped_s + LANDED_AFTER_S - 0.1
            assert behavior.payload == {"jumps": 1}

    run_virtual(scene())
