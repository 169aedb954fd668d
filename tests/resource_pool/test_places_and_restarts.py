"""What a restart of the RC manager costs ARCs that wait, or that are about to stop."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Owner, a_pool

from backbone.bus.clock import run_virtual
from backbone.rc_manager.messages import RENEW_EVERY_S, CloseGate, GateClosed
from resource_pool.messages import Suspending

ROBOT = ["scout1", "radio"]


class CarefulOwner(Owner):
    """A decision process that needs a while to stop."""

    async def arc_suspending(self, notice: Suspending) -> None:
        await self.clock.sleep_s(0.8)


def test_equals_keep_their_places_in_line_over_each_restart(local_mission: Any) -> None:
    """They were admitted in the order of their starts, so with a restart in each slice the third one never ran."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOT) as pool:
            owners = [await pool.owner(name) for name in ("first", "second", "third")]
            for owner in owners:
                await pool.arc(owner, "drive", "scout1", minimum_runtime_s=2.0)
            for _ in range(6):
                await pool.clock.sleep_s(2.5)
                await pool.kill("rc_manager")
                await pool.manager()
            turns = [owner.heard().count("Resumed") for owner in owners]
            assert max(turns) - min(turns) <= 1

    run_virtual(main())


def test_an_arc_that_is_idle_for_a_while_goes_behind_its_equals(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOT) as pool:
            owners = [await pool.owner(name) for name in ("first", "second", "third")]
            _, second, _ = [await pool.arc(owner, "drive", "scout1", minimum_runtime_s=2.0) for owner in owners]
            await pool.clock.sleep_s(1.0)
            await second.idle()
            await second.idle(False)
            await pool.kill("rc_manager")
            await pool.manager()
            await pool.clock.sleep_s(2.5)
            assert [owner.heard()[-1:] for owner in owners] == [["Suspended"], [], ["Resumed"]]

    run_virtual(main())


def test_rcs_do_not_stand_idle_where_the_rc_manager_restarts_amid_a_clean_stop(local_mission: Any) -> None:
    """The ARC told the next RC manager that it holds its set, and then carried out the earlier one's order."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOT, manager=False) as pool:
            await pool.manager(grace_s=1.0)
            careful = await pool.start(CarefulOwner, "careful", None, "mission_control")
            arc = await pool.arc(careful, "drive", "scout1", minimum_runtime_s=2.0)
            other = await pool.owner("other")
            await pool.arc(other, "drive", "scout1", minimum_runtime_s=2.0)
            await pool.clock.sleep_s(2.2)
            assert careful.heard() == ["Resumed", "Suspending"]
            for name in ("rc_manager", "other-drive"):
                await pool.kill(name)
            await pool.clock.sleep_s(0.2)
            assert (await arc.state()).granted
            await pool.manager(grace_s=1.0)
            await pool.clock.sleep_s(0.6 + RENEW_EVERY_S)
            assert careful.heard() == ["Resumed", "Suspending", "Suspended", "Resumed"]

    run_virtual(main())


def test_an_order_of_a_dead_rc_manager_that_arrives_late_costs_no_lease(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOT) as pool:
            owner = await pool.owner("owner")
            arc = await pool.arc(owner, "drive", "scout1", minimum_runtime_s=2.0)
            await arc.wait_granted()
            await pool.kill("rc_manager")
            await pool.manager()
            late = CloseGate("higher", "console", 0.0, -1.0)
            await pool.manager_voice.ask(arc.address, late, GateClosed, within_s=1)
            await pool.clock.sleep_s(0.1 + RENEW_EVERY_S)
            assert owner.heard() == ["Resumed", "Suspended", "Resumed"]

    run_virtual(main())


@pytest.mark.parametrize("restarts", [1, 2])
def test_a_slice_that_its_owner_extended_lasts_as_long_over_a_restart(local_mission: Any, restarts: int) -> None:
    """The next RC manager ended it after the minimum run time, although the owner had been told otherwise."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOT) as pool:
            owner, other = await pool.owner("owner"), await pool.owner("other")
            arc = await pool.arc(owner, "drive", "scout1", minimum_runtime_s=2.0, maximum_runtime_s=8.0)
            await arc.wait_granted()
            granted_s = pool.clock.now_s()
            await pool.arc(other, "drive", "scout1", minimum_runtime_s=2.0)
            await pool.clock.sleep_s(1.0)
            await arc.want_longer(granted_s + 6.0)
            for _ in range(restarts):
                await pool.clock.sleep_s(0.3)
                await pool.kill("rc_manager")
                await pool.manager()
            await pool.clock.sleep_s(granted_s + 5.9 - pool.clock.now_s())
            assert owner.heard() == ["Resumed"]
            await pool.clock.sleep_s(0.5)
            assert owner.heard()[-1] == "Suspended"
            assert other.heard() == ["Resumed"]
            await pool.clock.sleep_s(2.5)
            assert owner.heard()[-1] == "Resumed", "its next slice is not extended"
            await pool.kill("rc_manager")
            await pool.manager()
            await pool.clock.sleep_s(2.5)
            assert owner.heard()[-1] == "Suspended"

    run_virtual(main())
