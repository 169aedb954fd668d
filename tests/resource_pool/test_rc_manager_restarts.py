"""What a restart of the RC manager costs ARCs while something else fails, too."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest
from pool_on_local_network import Pool, a_pool
from pool_orders import state_of

from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from backbone.errors import Refusal
from backbone.rc_manager.messages import AskRequest, Disconnect
from backbone.wire import Envelope, Message
from resource_pool.arcs.drive import DriveArc
from resource_pool.drivers.interface import HardwareFault
from resource_pool.holds import Hold
from resource_pool.messages import COMMAND_TIMEOUT_S
from resource_pool.rcs.skeleton import Lamp

PAINTED = "resource_pool.rcs.skeleton:PaintedLamp"


class StuckLamp(Lamp):
    """A lamp that cannot be switched off while it is stuck: it refuses, or it does not even answer."""

    is_stuck, hangs = True, False

    async def make_safe(self, hold: Hold) -> None:
        if self.is_stuck:
            raise HardwareFault("its relay sticks")
        await super().make_safe(hold)

    async def answer(self, asked: Envelope[Message]) -> Message:
        if self.is_stuck and self.hangs and isinstance(asked.body, Disconnect):
            await asyncio.Event().wait()
        return await super().answer(asked)


class HungDrive(DriveArc):
    """An ARC that does not answer a restarted RC manager."""

    async def answer(self, asked: Envelope[Message]) -> Message:
        if isinstance(asked.body, AskRequest):
            await asyncio.Event().wait()
        return await super().answer(asked)


async def restart_the_rc_manager(pool: Pool, after_s: float = 0.4) -> None:
    await pool.clock.sleep_s(after_s)
    await pool.manager()


@pytest.mark.parametrize("hangs", [False, True])
def test_an_rc_that_keeps_the_hold_of_a_dead_arc_costs_nobody_else_a_grant(local_mission: Any, hangs: bool) -> None:
    async def main() -> None:
        async with a_pool(
            local_mission, ["scout1", "scout2", "radio", "lamp1"], rc_classes={"lamp": StuckLamp}
        ) as pool:
            owner, other = await pool.owner("owner"), await pool.owner("other")
            arc = await pool.arc(owner, "drive", "scout1")
            dying = await pool.arc(other, "lit_drive", "scout2")
            await arc.wait_granted()
            await dying.wait_granted()
            lamp = cast("StuckLamp", pool.running["lamp1"])
            lamp.hangs = hangs
            for name in ("rc_manager", dying.arc, "other"):
                await pool.kill(name)
            await restart_the_rc_manager(pool)
            await pool.clock.sleep_s(4.0)
            assert owner.heard() == ["Resumed"]
            lamp.is_stuck = False
            again = await pool.owner("again")
            lit = await pool.arc(again, "lit_drive", "scout2")
            await pool.clock.sleep_s(2.0)
            assert lit.granted is not None, "the lamp counts as up again as soon as it obeys"

    run_virtual(main())


def test_the_gate_of_an_arc_whose_rcs_were_settling_stays_shut_where_another_gets_them(local_mission: Any) -> None:
    async def main() -> None:
        slow = Resource("slow", "lamp", connect_s=1.5, driver=PAINTED, parameters={"color": "green"})
        async with a_pool(local_mission, ["scout1", "radio", "slow"], hardware=[slow]) as pool:
            console, preferred = await pool.console("console", "drive", "scout1", idle=True)
            owner = await pool.owner("owner")
            settling = await pool.arc(owner, "lit_drive", "scout1")
            await pool.clock.sleep_s(0.4)
            assert set((await state_of(pool, "slow")).holders), "it settles for the ARC"
            await pool.kill("rc_manager")
            with pytest.raises(Refusal, match="no answer"):
                await preferred.idle(False)
            await restart_the_rc_manager(pool, 0.1)
            await pool.clock.sleep_s(4.0)
            assert console.heard() == ["Resumed"]
            assert owner.heard() == []
            assert not (await settling.state()).granted

    run_virtual(main())


def test_an_owner_hears_at_once_that_the_rc_manager_restarted_with_an_rc_of_its_set(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            owner = await pool.owner("owner")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            for name in ("rc_manager", "radio"):
                await pool.kill(name)
            await pool.clock.sleep_s(0.3)
            await pool.manager()
            await pool.clock.sleep_s(0.1)
            assert owner.heard() == ["Resumed", "Suspended"]
            await pool.rc("radio")
            await pool.clock.sleep_s(1.0)
            assert owner.heard() == ["Resumed", "Suspended", "Resumed"]

    run_virtual(main())


def test_a_wish_amid_the_start_of_an_rc_manager_that_has_asked_already_reaches_it(local_mission: Any) -> None:
    """Another ARC hangs, so the RC manager is still asking when this one's owner wants time."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "scout2", "radio"], arc_classes={"capture": HungDrive}) as pool:
            owner, other = await pool.owner("owner"), await pool.owner("other")
            arc = await pool.arc(owner, "drive", "scout1", idle=True)
            await (await pool.arc(other, "capture", "scout2")).wait_granted()
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(0.2)
            starting = asyncio.create_task(pool.manager())
            await pool.clock.sleep_s(0.2)
            assert not starting.done()
            with pytest.raises(Refusal, match="no answer"):
                await arc.idle(False)
            await starting
            await pool.clock.sleep_s(2.0)
            assert owner.heard() == ["Resumed"]

    run_virtual(main())


def test_a_wish_while_the_first_request_finds_no_rc_manager_counts_at_the_next_one(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            owner = await pool.owner("owner")
            arc = await pool.arc(owner, "drive", "scout1")
            await pool.clock.sleep_s(0.5)
            with pytest.raises(Refusal, match="no answer"):
                await arc.idle()
            await pool.manager()
            await pool.clock.sleep_s(1.0)
            assert owner.heard()[-1:] != ["Resumed"]

    run_virtual(main())


def test_a_radio_killed_with_the_rc_manager_confirms_before_its_robots_frequency_is_free(local_mission: Any) -> None:
    """The robot drives and transmits until its own watchdog stops it."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "scout2", "radio", "video"]) as pool:
            await (await pool.arc(await pool.owner("owner"), "video_drive", "scout1")).wait_granted()
            _, preferred = await pool.console("console", "video_drive", "scout2", idle=True)
            for name in ("rc_manager", "radio"):
                await pool.kill(name)
            killed_s = pool.clock.now_s()
            await pool.rc("radio")
            with pytest.raises(Refusal, match="no answer"):
                await preferred.idle(False)
            await pool.manager()
            await pool.clock.sleep_s(2.0)
            assert (await preferred.state()).granted
            (holder,) = (await state_of(pool, "video")).holders
            assert holder.since_s >= killed_s + COMMAND_TIMEOUT_S

    run_virtual(main())
