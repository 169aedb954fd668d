"""Broken hardware is reported, made up for, and ends nothing else."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from pool_on_local_network import WiretappedRadio, a_pool
from pool_orders import ROBOTS, at, command, connect, connect_robot, disconnect, state_of

from backbone.bus.clock import run_virtual
from backbone.scheduling.requests import Usage
from resource_pool.commands import Drive
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import LoadPacket, PacketLoaded
from scout_model.radio_link import encode_safe


def test_a_radio_that_breaks_refuses_what_is_to_be_sent_at_once(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            pool.radio_driver.breaks = True
            packet = LoadPacket("one", 1, 1, b"J", encode_safe(), 1, at_once=True)
            with pytest.raises(HardwareFault):
                await pool.voice("scout1").ask(at("radio"), packet, PacketLoaded, within_s=1)
            assert pool.is_alive("radio")
            pool.radio_driver.breaks = False

    run_virtual(main())


def test_a_radio_that_breaks_while_it_sends_ends_as_failed_and_says_what_broke(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(1.0, 1.0))
            await pool.clock.sleep_s(0.2)
            pool.radio_driver.breaks = True
            bug = await pool.outcome("radio")
            assert isinstance(bug, HardwareFault)
            assert "antenna" in str(bug)
            assert pool.radio_driver.closed == 1

    run_virtual(main())


class RadioThatDoesNotOpen(WiretappedRadio):
    """Waits for its device for ever, or for a time limit of its own."""

    limit_s: float | None = None

    async def open(self) -> None:
        async with asyncio.timeout(self.limit_s):
            await asyncio.Event().wait()


@pytest.mark.parametrize(("limit_s", "error", "after_s"), [(None, HardwareFault, 60.0), (3.0, TimeoutError, 3.0)])
def test_a_device_whose_opening_hangs_ends_the_start_of_its_rc(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, limit_s: float | None, error: type[Exception], after_s: float
) -> None:
    """Otherwise the mission comes up for ever, and no one learns what it waits for."""
    monkeypatch.setattr(RadioThatDoesNotOpen, "limit_s", limit_s)

    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            begun_s = pool.clock.now_s()
            with pytest.raises(error):
                await pool.rc("radio", driver=f"{__name__}:{RadioThatDoesNotOpen.__name__}")
            assert pool.clock.now_s() - begun_s == pytest.approx(after_s, abs=1.0)

    run_virtual(main())


@pytest.mark.parametrize("reported_s", [math.inf, math.nan, -1.0, 1e9, "soon", (0.002,), 10**50, 10**309])
def test_an_impossible_time_on_the_air_ends_the_radio(local_mission: Any, reported_s: Any) -> None:
    """Otherwise an infinite time blocks the air for all robots, also for an emergency stop, and no one learns why."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            pool.radio_driver.slow_s = reported_s
            await command(pool, "one", 1, Drive(1.0, 1.0))
            await pool.clock.sleep_s(0.5)
            assert not pool.is_alive("radio")
            bug = await pool.outcome("radio")
            assert isinstance(bug, HardwareFault)
            assert f"reports {reported_s!r:.80} s on the air" in str(bug)

    run_virtual(main())


@pytest.mark.parametrize("fault", ["breaks", "hangs"])
def test_a_disconnection_that_reached_no_safe_state_is_refused_and_made_up_for(local_mission: Any, fault: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1, period_s=5.0)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            setattr(pool.radio_driver, fault, True)
            with pytest.raises(HardwareFault):
                await disconnect(pool, "radio", "one", 1)
            assert not (await state_of(pool, "radio")).holders
            with pytest.raises(HardwareFault):
                await connect(pool, "radio", "two", 2)
            assert not (await state_of(pool, "radio")).holders
            setattr(pool.radio_driver, fault, False)
            await connect(pool, "radio", "two", 3)
            assert [heard.payload for heard in pool.radio_driver.heard_by(1)][-1] == encode_safe()
            assert (await state_of(pool, "radio")).holders[0].arc == "two"

    run_virtual(main())


def test_after_a_hardware_fault_the_rc_manager_waits_out_the_lease(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1", usage=Usage(20.0, 0.002))
            await arc.wait_granted()
            await arc.drive(3.0, 3.0)
            pool.radio_driver.breaks = True
            taken_s = pool.clock.now_s()
            _, console = await pool.console("console", "drive", "scout1")
            await pool.clock.sleep_s(0.2)
            pool.radio_driver.breaks = False
            await console.wait_granted()
            assert 1.9 <= pool.clock.now_s() - taken_s <= 2.6
            assert pool.running["radio"].statistics()["safety_faults"] <= 3, "it is not asked again and again"
            assert pool.audit["stale_packets"] == 0

    run_virtual(main())


def test_a_lease_that_ends_on_broken_hardware_does_not_end_the_rc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1, period_s=5.0)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            pool.radio_driver.breaks = True
            await pool.clock.sleep_s(2.5)
            assert pool.is_alive("radio")
            assert not (await state_of(pool, "radio")).holders
            assert "not safe" in (await state_of(pool, "radio")).feedback
            pool.radio_driver.breaks = False

    run_virtual(main())
