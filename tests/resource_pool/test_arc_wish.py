"""What an owner reports of its ARC: missing from the moment at which it cannot be reached."""

from __future__ import annotations

import asyncio
from typing import Any

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import AskState, ComponentState, LifeState, NameTaken
from backbone.component.peer_monitor import GONE_AFTER_S
from backbone.placer.messages import Ended, Start, Started, StopComponent
from backbone.wire import Envelope, Message
from resource_pool.arc_client import ArcClient, Resumed, Suspended, Suspending

CLOCK = VirtualClock()
ARC = "resource_pool/owner-drive"


class Owner:
    """Takes note of nothing."""

    async def arc_resumed(self, notice: Resumed) -> None: ...

    async def arc_suspending(self, notice: Suspending) -> None: ...

    async def arc_suspended(self, notice: Suspended) -> None: ...


class PlayedPlacer:
    """Starts the ARC, which is a token, unless one from before has its name; that one takes long to end."""

    def __init__(self, network: LocalNetwork, *, leftover: bool = False, takes_s: float = 0.0) -> None:
        self.starts = 0
        self.bus, self.arc, self.leftover = network.join(PLACER, CLOCK), network.join(ARC, CLOCK), leftover
        self.takes_s = takes_s
        self.bus.serve(PLACER, Start | StopComponent, self.answer)

    async def answer(self, asked: Envelope[Any]) -> Message:
        if isinstance(asked.body, StopComponent):
            await CLOCK.sleep_s(20.0)
            self.leftover = False
            return Ended(asked.body.name, "asking")  # type: ignore[arg-type]
        self.starts += 1
        if self.leftover:
            raise NameTaken("it is starting")
        await CLOCK.sleep_s(self.takes_s)
        self.token = self.arc.declare_alive(ARC)
        return Started(ARC, "h1", 1, [])


def test_an_arc_is_missed_while_it_cannot_be_reached() -> None:
    async def main() -> None:
        network = LocalNetwork()
        placer, bus = PlayedPlacer(network), network.join("mission_control/owner", CLOCK)
        arc = ArcClient(bus, "owner-drive", Owner())
        keeping = asyncio.create_task(arc.keep(CLOCK, "drive", {}))
        await CLOCK.sleep_s(1.0)
        assert arc.wish.absence() is None
        placer.token.close()
        await CLOCK.sleep_s(0.1)
        assert arc.wish.absence() is not None
        placer.token = placer.arc.declare_alive(ARC)
        await CLOCK.sleep_s(0.1)
        assert arc.wish.absence() is None
        await _end(keeping, bus, placer.bus, placer.arc)

    run_virtual(main())


def test_an_arc_that_answers_is_there_though_its_token_is_lost_for_good() -> None:
    """The placer had it, so the owner ended it as one from before, in the middle of its grant."""

    async def main() -> None:
        network = LocalNetwork()
        placer, bus = PlayedPlacer(network), network.join("mission_control/owner", CLOCK)
        arc = ArcClient(bus, "owner-drive", Owner())

        async def answer(_asked: Envelope[AskState]) -> Message:
            return ComponentState(ARC, "drive", "h1", 1, LifeState.READY, 0.0)

        serving = placer.arc.serve(ARC, AskState, answer)
        keeping = asyncio.create_task(arc.keep(CLOCK, "drive", {}))
        await CLOCK.sleep_s(1.0)
        placer.token.close()
        await CLOCK.sleep_s(GONE_AFTER_S)
        for _ in range(10):
            await CLOCK.sleep_s(1.0)
            assert (arc.wish.absence(), placer.starts) == (None, 1)
        serving.close()
        await CLOCK.sleep_s(3.0)
        assert placer.starts == 2
        await _end(keeping, bus, placer.bus, placer.arc)

    run_virtual(main())


def test_an_arc_whose_start_takes_long_is_missed_meanwhile() -> None:
    """The question, or its answer, may be lost on a cut link: for 30 s a behavior had no ARC, and health was ok."""

    async def main() -> None:
        network = LocalNetwork()
        placer, bus = PlayedPlacer(network, takes_s=10.0), network.join("mission_control/owner", CLOCK)
        arc, changed = ArcClient(bus, "owner-drive", Owner()), 0

        def count() -> None:
            nonlocal changed
            changed += 1

        keeping = asyncio.create_task(arc.keep(CLOCK, "drive", {}, on_changed=count))
        await CLOCK.sleep_s(1.0)
        assert arc.wish.absence() is None
        await CLOCK.sleep_s(1.0)
        assert (arc.wish.absence() is not None, changed) == (True, 1)
        await CLOCK.sleep_s(9.0)
        assert arc.wish.absence() is None
        await _end(keeping, bus, placer.bus, placer.arc)

    run_virtual(main())


def test_an_arc_whose_name_is_taken_is_missed_while_its_predecessor_is_being_ended() -> None:
    async def main() -> None:
        network = LocalNetwork()
        placer, bus = PlayedPlacer(network, leftover=True), network.join("mission_control/owner", CLOCK)
        arc = ArcClient(bus, "owner-drive", Owner())
        keeping = asyncio.create_task(arc.keep(CLOCK, "drive", {}))
        await CLOCK.sleep_s(1.0)
        assert arc.wish.absence() is not None
        await CLOCK.sleep_s(30.0)
        assert arc.wish.absence() is None
        await _end(keeping, bus, placer.bus, placer.arc)

    run_virtual(main())


async def _end(keeping: asyncio.Task[None], *buses: Any) -> None:
    keeping.cancel()
    await asyncio.gather(keeping, return_exceptions=True)
    for bus in buses:
        await bus.close()
