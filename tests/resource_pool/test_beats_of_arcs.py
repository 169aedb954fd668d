"""An ARC beats when the RC manager listens: once after each renewal, and not all ARCs at the same time."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from pool_on_local_network import a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.rc_manager.messages import BEAT_WITHIN_S, RENEW_EVERY_S, Beat, Leases
from resource_pool.owner_watch import BEAT_SPREAD_S

ROBOTS = ["scout1", "scout2", "radio"]


def test_each_arc_beats_once_after_each_renewal_at_a_place_of_its_own(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            for name, robot in [("one", "scout1"), ("two", "scout1"), ("three", "scout2"), ("four", "scout2")]:
                await pool.arc(await pool.owner(name), "drive", robot)
            renewals_s = [pool.clock.now_s()]
            places_s = defaultdict[str, list[float]](list)
            pool.ear.subscribe(RC_MANAGER, Conversation.LEASES, Leases, lambda e: renewals_s.append(e.stamp_s))
            pool.ear.subscribe(
                "resource_pool/*",
                Conversation.BEAT,
                Beat,
                lambda e: places_s[e.body.arc].append(e.stamp_s - renewals_s[-1]),
            )
            await pool.clock.sleep_s(RENEW_EVERY_S)
            places_s.clear()
            await pool.clock.sleep_s(10 * RENEW_EVERY_S)
            assert len(places_s) == 4
            assert all(9 <= len(places) <= 11 for places in places_s.values())
            assert all(0.0 <= place_s <= BEAT_SPREAD_S for places in places_s.values() for place_s in places)
            assert len({round(places[0], 3) for places in places_s.values()}) == 4

    run_virtual(main())


def test_an_arc_without_an_rc_manager_beats_all_the_same_for_the_next_one(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await pool.kill("rc_manager")
            beats_s: list[float] = []
            pool.ear.subscribe("resource_pool/*", Conversation.BEAT, Beat, lambda e: beats_s.append(e.stamp_s))
            await pool.clock.sleep_s(5.0)
            assert len(beats_s) >= 5.0 / BEAT_WITHIN_S - 2

    run_virtual(main())
