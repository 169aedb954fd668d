"""An operator stops a robot without a grant; nothing moves it until that very stop is lifted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pool_on_local_network import HARDWARE, Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from backbone.rc_manager.messages import Connect, Connected, RcUse, Usage
from resource_pool.arc_client import (
    EmergencyStopped,
    StopState,
    ask_stop,
    lift_stop,
    stop_robot,
    watch_stops,
)
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied, CommandScout, Drive, NotFromYou, OtherStop
from resource_pool.rcs.scout import Scout
from resource_pool.stop_latch import StopLatch
from scout_model.radio_link import encode_drive, encode_halt

RCS = ["scout1", "scout2", "radio"]
OPERATOR = "ui_console/console-1"


def payloads(pool: Pool, network_id: int) -> list[bytes]:
    return [packet.payload for packet in pool.radio_driver.heard_by(network_id)]


# ---------------------------------------------------------------------- the latch
@given(st.lists(st.tuples(st.sampled_from(["stop", "lift"]), st.integers(0, 4)), max_size=30))
def test_a_robot_moves_only_if_its_last_stop_was_lifted_by_its_number(steps: list[tuple[str, int]]) -> None:
    latch, stopped, number = StopLatch("scout1"), False, 0
    for now_s, (step, given_number) in enumerate(steps):
        if step == "stop":
            assert latch.stop(f"user{now_s}", "why", float(now_s)) is not stopped
            number += not stopped
            stopped = True
        elif given_number != number:
            with pytest.raises(OtherStop):
                latch.lift(given_number, "user", float(now_s))
        else:
            assert latch.lift(given_number, "user", float(now_s)) is stopped
            stopped = False
        assert (latch.state.is_stopped, latch.state.number) == (stopped, number)
        if stopped:
            with pytest.raises(EmergencyStopped):
                latch.require_moving()
        else:
            latch.require_moving()


def test_the_first_to_stop_is_the_one_who_is_named() -> None:
    latch = StopLatch("scout1")
    latch.stop("anna", "child in the room", 1.0)
    latch.stop("ben", "me too", 2.0)
    assert (latch.state.by, latch.state.reason, latch.state.at_s) == ("anna", "child in the room", 1.0)


# ---------------------------------------------------------------------- the robot
def test_a_stop_without_a_grant_halts_the_holders_robot_and_tells_the_holder_who_and_why(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            arc = await pool.arc(await pool.owner("patrol"), "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(4.0, 4.0)
            await pool.clock.sleep_s(0.1)
            operator = pool.voice_of(OPERATOR)
            heard: list[StopState] = []
            watch_stops(operator, heard.append)
            state = await stop_robot(operator, "scout1", "child in the room", "anna")
            assert (state.is_stopped, state.by, state.is_confirmed) == (True, "anna", True)
            await pool.clock.sleep_s(0.1)
            sent = payloads(pool, 1)
            assert sent[-1] == encode_halt()
            with pytest.raises(EmergencyStopped) as refusal:
                await arc.drive(4.0, 4.0)
            assert (refusal.value.facts["by"], refusal.value.facts["reason"]) == ("anna", "child in the room")
            with pytest.raises(EmergencyStopped):
                await arc.jump()
            await arc.halt()
            await pool.clock.sleep_s(1.0)
            assert set(payloads(pool, 1)[len(sent) :]) == {encode_halt()}
            assert arc.granted is not None
            assert heard == [state]

    run_virtual(main())


def test_other_robots_of_the_same_radio_drive_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            arc = await pool.arc(await pool.owner("patrol"), "drive", "scout2")
            await arc.wait_granted()
            await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            await arc.drive(4.0, 4.0)
            await pool.clock.sleep_s(0.1)
            assert payloads(pool, 2)[-1] == encode_drive(4.0, 4.0)

    run_virtual(main())


def test_whoever_holds_the_robot_next_cannot_move_it_either_until_the_stop_is_lifted(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            operator = pool.voice_of(OPERATOR)
            stop = await stop_robot(operator, "scout1", "")
            assert not payloads(pool, 1)
            _owner, arc = await pool.console("console-9", "drive", "scout1")
            await arc.wait_granted()
            with pytest.raises(EmergencyStopped):
                await arc.drive(1.0, 1.0)
            lifted = await lift_stop(operator, stop, "ben")
            assert (lifted.is_stopped, lifted.by) == (False, "ben")
            await arc.wait_stop_lifted("scout1")
            await arc.drive(1.0, 1.0)

    run_virtual(main())


def test_a_lift_that_was_overtaken_by_another_stop_lifts_nothing(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            operator = pool.voice_of(OPERATOR)
            first = await stop_robot(operator, "scout1", "")
            await lift_stop(operator, first)
            second = await stop_robot(pool.voice_of("ui_console/console-2"), "scout1", "again")
            with pytest.raises(OtherStop):
                await lift_stop(operator, first)
            assert await ask_stop(operator, "scout1") == second

    run_virtual(main())


@pytest.mark.parametrize("stranger", ["mission_control/patrol", "resource_pool/scout2", "ui_consoles/x"])
def test_only_operators_stop_and_lift(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            voice = pool.voice_of(stranger)
            with pytest.raises(NotFromYou):
                await stop_robot(voice, "scout1", "")
            stop = await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            with pytest.raises(NotFromYou):
                await lift_stop(voice, stop)
            assert (await ask_stop(voice, "scout1")).is_stopped

    run_virtual(main())


def test_a_stop_the_radio_does_not_take_is_told_as_unconfirmed_and_the_robot_stands_by_itself(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool:
            companions = {"scout1": 5, "radio": 6}
            for rc, use in (("radio", RcUse([Usage(0.05, 0.002)])), ("scout1", RcUse())):
                order = Connect("one", companions[rc], 60.0, use, companions)
                await pool.manager_voice.ask(f"resource_pool/{rc}", order, Connected, within_s=1)
            drive = CommandScout("one", 5, Drive(4.0, 4.0))
            await pool.voice("one").ask("resource_pool/scout1", drive, Applied, within_s=1)
            await pool.clock.sleep_s(0.1)
            began = await pool.pose("scout1")
            await pool.kill("radio")
            state = await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            assert (state.is_stopped, state.is_confirmed) == (True, False)
            await pool.clock.sleep_s(COMMAND_TIMEOUT_S + 1.0)
            stood = await pool.pose("scout1")
            await pool.clock.sleep_s(1.0)
            assert await pool.pose("scout1") == pytest.approx(stood, abs=1e-3)
            assert stood != pytest.approx(began, abs=1e-2)

    run_virtual(main())


def test_a_stop_outlives_the_process_of_the_robots_rc(local_mission: Any, beside: Any, tmp_path: Path) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            launch = Launch(
                "local",
                Subsystem.RESOURCE_POOL,
                "scout1",
                "scout",
                "x:Y",
                "local",
                "",
                0.0,
                1.0,
                HARDWARE[0].rc_parameters(),
                run_directory=str(tmp_path),
            )
            operator = pool.voice_of(OPERATOR)
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                stop = await stop_robot(operator, "scout1", "fire", "anna")
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                assert await ask_stop(operator, "scout1") == stop
                await lift_stop(operator, stop)
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                assert not (await ask_stop(operator, "scout1")).is_stopped

    run_virtual(main())


def test_a_full_disk_keeps_no_wheel_turning_and_it_is_told_that_the_stop_is_not_kept(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    (tmp_path / "stops").touch()  # no folder can be made there

    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            launch = Launch(
                "local",
                Subsystem.RESOURCE_POOL,
                "scout1",
                "scout",
                "x:Y",
                "local",
                "",
                0.0,
                1.0,
                HARDWARE[0].rc_parameters(),
                run_directory=str(tmp_path),
            )
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)) as scout:
                assert (await stop_robot(pool.voice_of(OPERATOR), "scout1", "fire", "anna")).is_stopped
                assert any("will not know that scout1 is stopped" in one.what for one in scout.story.of("scout1"))

    run_virtual(main())
