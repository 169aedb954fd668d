"""A robot stays stopped if the process of its RC ends, also if the next one starts on another host."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pool_on_local_network import HARDWARE, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.launch import Launch
from backbone.component.messages import ComponentState, StandingStop
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Envelope
from resource_pool.arc_client import ask_stop, lift_stop, stop_robot
from resource_pool.messages import COMMAND_TIMEOUT_S
from resource_pool.rcs.scout import Scout
from resource_pool.stop_file import StopFile

OPERATOR = "ui_console/console-1"


def scout_launch(run_directory: Path, host: str = "local") -> Launch:
    return Launch(
        "local",
        Subsystem.RESOURCE_POOL,
        "scout1",
        "scout",
        "x:Y",
        host,
        "",
        0.0,
        1.0,
        HARDWARE[0].rc_parameters(),
        run_directory=str(run_directory),
    )


def test_a_stop_outlives_the_process_of_the_robots_rc(local_mission: Any, beside: Any, tmp_path: Path) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            launch = scout_launch(tmp_path)
            operator = pool.voice_of(OPERATOR)
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                stop = await stop_robot(operator, "scout1", "fire", "anna")
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                await pool.clock.sleep_s(COMMAND_TIMEOUT_S)  # as long as the radio may repeat a drive
                assert await ask_stop(operator, "scout1") == stop
                await lift_stop(operator, stop)
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)):
                assert not (await ask_stop(operator, "scout1")).is_stopped

    run_virtual(main())


def test_a_stop_stays_in_force_on_another_host(local_mission: Any, beside: Any, tmp_path: Path) -> None:
    """Host b knows an older stop, which was lifted there, and host a a later one, which was lifted on host b."""

    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            here, there = scout_launch(tmp_path / "a"), scout_launch(tmp_path / "b", "b")
            operator = pool.voice_of(OPERATOR)

            def scout(launch: Launch) -> Scout:
                return Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)

            async with beside(scout(there)):
                await lift_stop(operator, await stop_robot(operator, "scout1", "smoke", "ben"))
            async with beside(scout(here)):
                await stop_robot(operator, "scout1", "", "ben")
                stop = await stop_robot(operator, "scout1", "fire", "anna")
                await pool.clock.sleep_s(0.1)
            async with beside(scout(there)):
                state = await ask_stop(operator, "scout1")
                assert state == stop, "with both authors and their consoles"
                await lift_stop(operator, state)
                await pool.clock.sleep_s(0.1)
            for launch in (scout_launch(tmp_path / "c"), here):
                async with beside(scout(launch)):
                    free = await ask_stop(operator, "scout1")
                    assert (free.is_stopped, free.number) == (False, state.number)

    run_virtual(main())


def test_the_stop_is_published_before_its_operator_has_the_answer(local_mission: Any) -> None:
    """Else it is lost on another host if the machine dies right after the answer."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            operator = pool.voice_of(OPERATOR)
            published: list[StandingStop | None] = []

            def status(heard: Envelope[ComponentState]) -> None:
                published.append(heard.body.stop)

            operator.subscribe("resource_pool/scout1", Conversation.STATUS, ComponentState, status)
            await pool.clock.sleep_s(1.0)
            stop = await stop_robot(operator, "scout1", "fire", "anna")
            assert [one and one.number for one in published[-1:]] == [stop.number]
            await lift_stop(operator, stop)
            assert published[-1] is None

    run_virtual(main())


def test_a_full_disk_keeps_no_wheel_turning_and_it_is_told_that_the_stop_is_not_kept(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    (tmp_path / "kept").touch()  # no folder can be made there

    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            launch = scout_launch(tmp_path)
            async with beside(Scout(launch, pool.network.join(launch.address, pool.clock), pool.clock)) as scout:
                assert (await stop_robot(pool.voice_of(OPERATOR), "scout1", "fire", "anna")).is_stopped
                assert any("will not know that scout1 is stopped" in one.what for one in scout.story.of("scout1"))

    run_virtual(main())


def test_a_stop_file_that_cannot_be_read_counts_as_a_stop(tmp_path: Path) -> None:
    file = StopFile(str(tmp_path), "scout1")
    assert file.read() is None
    (tmp_path / "kept" / "stops").mkdir(parents=True)
    (tmp_path / "kept/stops/scout1").write_bytes(b"half of a")
    (tmp_path / "kept/stops/scout2").mkdir()
    for each in (file, StopFile(str(tmp_path), "scout2")):
        state = each.read()
        assert state is not None
        assert state.is_stopped
