"""An owner's wish on the local bus: what it says of a component that is away and comes back."""

from __future__ import annotations

import asyncio

import pytest

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.peer_monitor import GONE_AFTER_S
from backbone.placer.messages import AskPlacement, Placement, Start, Started
from backbone.placer.wishes import PAUSE_MOST_S, Wish, keep_placed
from backbone.wire import Envelope, Message

ADDRESS = "resource_pool/grabber"
SETTLED_S = 0.3  # chosen: some events of the bus later


def serve_placer(bus: Bus) -> None:
    """Let it believe that its creator restarts all missing components."""

    async def answer(asked: Envelope[Start | AskPlacement]) -> Message:
        if isinstance(asked.body, Start):
            return Started("grabber", "here", 1, [])
        return Placement("grabber", "framegrabber", "here", "backbone/launcher", 0.0, [])

    bus.serve(PLACER, Start | AskPlacement, answer)
    bus.declare_alive(PLACER)


@pytest.mark.parametrize("away_s", [0.5, GONE_AFTER_S + 0.5, GONE_AFTER_S + PAUSE_MOST_S + 0.5, 30.0])
def test_what_is_back_is_no_longer_missed_however_long_it_was_away(away_s: float) -> None:
    async def main() -> None:
        clock = VirtualClock()
        network = LocalNetwork()
        placer, owner, component = (network.join(at, clock) for at in (PLACER, "backbone/launcher", ADDRESS))
        serve_placer(placer)
        life = component.declare_alive(ADDRESS)
        wish = Wish("grabber")
        keeping = asyncio.create_task(
            keep_placed(owner, clock, wish, lambda: Start("framegrabber", "grabber"), ADDRESS)
        )
        await clock.sleep_s(2.0)
        assert wish.absence() is None
        life.close()
        await clock.sleep_s(away_s)
        assert (wish.absence() is not None) is (away_s > GONE_AFTER_S)
        component.declare_alive(ADDRESS)
        await clock.sleep_s(SETTLED_S)
        assert wish.absence() is None
        keeping.cancel()
        await asyncio.wait({keeping})
        for bus in (placer, owner, component):
            await bus.close()

    run_virtual(main())
