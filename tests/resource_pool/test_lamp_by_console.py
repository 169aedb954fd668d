"""A console drives a robot by its own reach and dims the lamp beside it, on real RCs and a real ARC."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import Any

from known_arcs import lit_types, serve_types
from pool_on_local_network import a_pool
from pool_placer import PoolPlacer

from backbone.addresses import COMPONENT_DATABASE
from backbone.bus.clock import run_virtual
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import KEYS_LET_GO_S, SPEED, GiveWish, move_by_stick
from ui_console.session.teleoperation import Teleoperation


def test_the_lamp_is_dimmed_while_its_robot_is_stopped_and_a_jump_waits_for_a_fresh_press(
    local_mission: Any, beside: Any
) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1"]) as pool, AsyncExitStack() as stack:
            stack.push_async_callback(PoolPlacer(pool).bus.close)
            sleep_s, model = pool.clock.sleep_s, ConsoleModel("console-7", "anna")
            database = pool.network.join(COMPONENT_DATABASE, pool.clock)
            stack.push_async_callback(database.close)
            serve_types(database, lit_types("lit_drive"))
            wished = {"robot": "scout1", "kind": "lit_drive", "priority": 100}
            launch = Launch("local", Subsystem.UI_CONSOLE, "console-7", "console", "x:Y", "local", "", 0.0, 1.0, wished)
            bus = pool.network.join(launch.address, pool.clock)
            console = Teleoperation(launch, bus, pool.clock, show=model.apply, user="anna")
            await stack.enter_async_context(beside(console))
            await sleep_s(2.0)
            assert console.is_held
            assert model.reach is not None
            assert await console.do(move_by_stick(1.0, 0.0, SPEED, model.reach))
            assert model.own(0.0).applied == "move left +4.4, right +4.4 rad/s"

            async def give(wish: GiveWish) -> str:
                console.give(wish)
                await sleep_s(0.2)
                return model.own(0.0).applied

            assert await console.stop_robot("scout1")
            assert await give(GiveWish("shine", {"brightness": 0.25}, "lamp")) == "shine brightness 0.25"
            lamp = [event.what for event in pool.running["lamp1"].story.of("lamp1")]
            assert lamp[-1] == "shines green at 25%"
            assert await give(GiveWish("shine", {"brightness": 7.0}, "lamp")) == "shine brightness 0.25"
            assert "refused: shine" in " ".join(alarm.line for alarm in model.alarm_views())
            assert await give(GiveWish("jump")) == "shine brightness 0.25"
            stop = model.team.robots.stop_of("scout1")
            assert stop is not None
            assert await console.lift_stop("scout1", stop.number)
            assert await give(GiveWish("jump")) == "shine brightness 0.25", "it was pressed a moment ago"
            await sleep_s(KEYS_LET_GO_S)
            assert await give(GiveWish("jump")) == "jump"

    run_virtual(scene())
