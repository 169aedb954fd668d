"""What a restart of the RC manager costs ARCs that wait."""

from __future__ import annotations

from typing import Any

from pool_on_local_network import a_pool

from backbone.bus.clock import run_virtual

ROBOT = ["scout1", "radio"]


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
