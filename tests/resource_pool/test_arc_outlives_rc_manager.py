"""What an ARC and its owner know when the RC manager is gone, late, or new."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Owner, Pool, a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.rc_manager.messages import AskRequest, CurrentRequest, GateOpens, Leases, OpenGate
from backbone.scheduling.requests import LEASE_S, Lease, MissingRuntime
from resource_pool.arc_client import ArcClient
from resource_pool.messages import COMMAND_TIMEOUT_S, Resumed, Suspended, SwappedOut

ROBOTS = ["scout1", "scout2", "radio"]


async def granted(pool: Pool, **more: Any) -> tuple[Owner, ArcClient]:
    owner = await pool.owner("watcher")
    arc = await pool.arc(owner, "drive", "scout1", **more)
    await arc.wait_granted()
    return owner, arc


async def asked_for(pool: Pool, arc: ArcClient) -> CurrentRequest:
    return await pool.manager_voice.ask(arc.address, AskRequest(), CurrentRequest, within_s=1)


def test_the_owner_hears_that_its_lease_is_over_when_the_rc_manager_is_gone(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(2.1)
            last = owner.notices[-1]
            assert isinstance(last, Suspended)
            assert last.reason == "lease"
            assert not (await arc.state()).granted
            with pytest.raises(SwappedOut):
                await arc.drive(1.0, 1.0)

    run_virtual(main())


def test_after_a_lease_that_ran_out_the_next_rc_manager_grants_anew(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(5.0)
            await pool.manager()
            await pool.clock.sleep_s(1.0)
            assert owner.heard() == ["Resumed", "Suspended", "Resumed"]
            assert (await arc.drive(1.0, 1.0)).rc == "scout1"

    run_virtual(main())


def test_an_rc_manager_that_restarts_in_time_costs_no_lease(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(0.8)
            await pool.manager()
            await pool.clock.sleep_s(3.0)
            assert owner.heard() == ["Resumed"]
            assert (await arc.drive(1.0, 1.0)).rc == "scout1"

    run_virtual(main())


@pytest.mark.parametrize("missing", [[], ["scout1"], ["radio"]])
def test_a_set_counts_as_held_only_while_every_rc_of_it_is_renewed(local_mission: Any, missing: list[str]) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await granted(pool)
            await pool.kill("rc_manager")
            epochs = {"scout1": 7, "radio": 8}
            manager = pool.network.join(RC_MANAGER, pool.clock)
            await manager.ask(arc.address, OpenGate(epochs, 0.0, 0.0), GateOpens, within_s=1)
            renewed = [Lease(rc, arc.arc, epoch) for rc, epoch in epochs.items() if rc not in missing]
            for _ in range(8):
                manager.publish(RC_MANAGER, Conversation.LEASES, Leases(renewed, 2.0))
                await pool.clock.sleep_s(0.5)
            assert (await arc.state()).granted == (not missing)
            await manager.close()

    run_virtual(main())


def test_an_arc_that_heard_no_renewal_asks_anew_where_the_rc_manager_still_lives(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            running = pool.running[arc.arc]
            epochs = {rc: epoch + 100 for rc, epoch in (await arc.state()).epochs.items()}
            # Epochs the RC manager never gave are never renewed: to the ARC it looks as if every renewal were lost.
            await pool.manager_voice.ask(arc.address, OpenGate(epochs, 0.0, 0.0), GateOpens, within_s=1)
            await pool.clock.sleep_s(4.0)
            assert owner.heard()[-2:] == ["Suspended", "Resumed"]
            assert (await arc.drive(1.0, 1.0)).rc == "scout1"
            assert running.statistics()["commands"] == 1

    run_virtual(main())


def test_who_wanted_to_be_idle_is_idle_for_the_next_rc_manager_too(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await arc.idle()
            await pool.clock.sleep_s(0.5)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(0.3)
            await pool.manager()
            await pool.clock.sleep_s(3.0)
            assert owner.heard() == ["Resumed", "Suspended"]
            await arc.idle(False)
            await pool.clock.sleep_s(0.5)
            assert owner.heard() == ["Resumed", "Suspended", "Resumed"]

    run_virtual(main())


def test_an_arc_that_wants_to_be_idle_while_no_rc_manager_answers_frees_its_rcs_at_the_next_one(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await pool.kill("rc_manager")
            with pytest.raises(Refusal, match="no answer"):
                await arc.idle()
            await pool.manager()
            await pool.clock.sleep_s(0.5)
            assert owner.heard() == ["Resumed", "Suspended"]
            _, other = await pool.console("other", "drive", "scout1", priority=1)
            await pool.clock.sleep_s(0.5)
            assert other.granted is not None
            await pool.end(other.arc)
            await arc.idle(False)
            await pool.clock.sleep_s(0.5)
            assert owner.heard() == ["Resumed", "Suspended", "Resumed"]

    run_virtual(main())


def test_run_times_that_were_changed_are_those_the_next_rc_manager_hears(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await granted(pool)
            await arc.want_runtime(3.0, 9.0)
            request = (await asked_for(pool, arc)).request
            assert (request.minimum_runtime_s, request.maximum_runtime_s) == (3.0, 9.0)

    run_virtual(main())


@pytest.mark.parametrize("least_s", [0.0, -1.0, 1e-4, float("nan"), float("inf")])
def test_run_times_no_slice_can_be_planned_for_are_refused_and_change_nothing(
    local_mission: Any, least_s: float
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await granted(pool)
            before = (await asked_for(pool, arc)).request
            with pytest.raises(MissingRuntime):
                await arc.want_runtime(least_s)
            assert (await asked_for(pool, arc)).request == before

    run_virtual(main())


def test_a_wish_nobody_answers_is_told_as_unknown_and_kept_for_the_next_rc_manager(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await granted(pool)
            await pool.kill("rc_manager")
            with pytest.raises(Refusal, match="no answer"):
                await arc.idle()
            assert (await asked_for(pool, arc)).request.idle

    run_virtual(main())


def test_a_killed_radio_is_free_when_its_robots_have_fallen_silent_and_no_later(local_mission: Any) -> None:
    """Its successor cannot stop what its predecessor set in motion, but knows when that stops by itself."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await granted(pool)
            await pool.kill("radio")
            killed_s = pool.clock.now_s()
            await pool.clock.sleep_s(0.1)
            await pool.rc("radio")
            while not (isinstance(owner.notices[-1], Resumed) and len(owner.notices) > 1):
                await pool.clock.sleep_s(0.01)
            assert 0.1 + COMMAND_TIMEOUT_S <= pool.clock.now_s() - killed_s < LEASE_S / 2
            assert (await arc.state()).granted

    run_virtual(main())


def test_a_killed_robot_rc_is_free_as_soon_as_it_is_back(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, _ = await granted(pool)
            await pool.kill("scout1")
            killed_s = pool.clock.now_s()
            await pool.clock.sleep_s(0.1)
            await pool.rc("scout1")
            while not (isinstance(owner.notices[-1], Resumed) and len(owner.notices) > 1):
                await pool.clock.sleep_s(0.01)
            assert pool.clock.now_s() - killed_s < 0.1 + COMMAND_TIMEOUT_S

    run_virtual(main())
