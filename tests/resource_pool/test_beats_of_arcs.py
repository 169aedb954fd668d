"""An ARC beats when the RC manager listens: once after each renewal, and not all ARCs at the same time."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import pytest
from pool_on_local_network import a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.errors import OutcomeUnknown, Refusal
from backbone.keys import Conversation
from backbone.rc_manager.messages import BEAT_WITHIN_S, RENEW_EVERY_S, Beat, Leases
from backbone.wire import Envelope, UnknownMessage
from resource_pool.arc_listener import NotMyArc
from resource_pool.messages import ArcState, AskBeat, Noted
from resource_pool.owner_watch import BEAT_SPREAD_S, OwnerWatch

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


@pytest.mark.parametrize(
    ("refusal", "ends"),
    [
        (NotMyArc("drive is not claimed here"), True),
        (UnknownMessage("AskBeat is not answered here"), True),
        (OutcomeUnknown("its camera did not answer"), False),
    ],
    ids=["another ARC's owner", "no owner", "a hook that failed"],
)
def test_only_an_owner_that_does_not_know_its_arc_ends_it(refusal: Refusal, ends: bool) -> None:
    """A heartbeat has the ARC's state: after a lost notice the owner calls its hook then, and the hook may fail."""

    async def main() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        owner, arc = network.join("mission_control/watch", clock), network.join("resource_pool/drive", clock)
        ear = network.join("ui_console/ear", clock)
        refusals, beats = [refusal], list[Beat]()

        async def answer(_asked: Envelope[AskBeat]) -> Noted:
            if refusals:
                raise refusals.pop()
            return Noted()

        owner.serve(owner.source, AskBeat, answer)
        ear.subscribe(arc.source, Conversation.BEAT, Beat, lambda heard: beats.append(heard.body))
        watch = OwnerWatch(arc, clock, owner.source, note=lambda *_: None)
        state = ArcState("drive", "drive", owner.source, {}, False, {}, "", "", -1.0)
        why = await watch.beat(state)
        assert (bool(why), not refusals, beats) == (ends, True, [])
        await watch.wait_turn()
        assert not await watch.beat(state)
        await clock.sleep_s(1.0)
        assert beats == [Beat("drive")]

    run_virtual(main())
