"""A machine is offered under a name that the mission has no creator for, or has none for any more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import NameTaken
from backbone.creator.messages import creator_name, offer_name
from backbone.errors import LinkError
from backbone.launcher.kept_creator import PREDECESSOR_ENDS_S, KeptCreator, LeftFiles, Offered, run_of
from backbone.naming import Subsystem

BASE = "base"


def launch(name: str) -> Launch:
    return Launch("local", Subsystem.BACKBONE, name, "any", "", BASE, "", 0.0, 1.0)


@pytest.fixture
def offered(local_mission: Callable[..., Any], beside: Callable[..., Any]) -> Callable[[float], None]:
    """Return a function that offers the machine ``BASE`` while the mission's own creator of it lives for seconds."""

    def run(lives_s: float) -> None:
        async def main() -> None:
            async with local_mission() as network:
                clock, own = VirtualClock(), launch(creator_name(BASE))
                creator = Component[NoParameters](own, network.join(own.address, clock), clock)
                async with beside(creator):
                    offer = launch(offer_name(BASE))
                    bus = network.join(offer.address, clock)
                    creator.start_task(end_after(creator, lives_s), "end")
                    await KeptCreator(offer, Offered("local", "", BASE), LeftFiles()).start(bus, clock)

        async def end_after(creator: Component[NoParameters], lives_s: float) -> None:
            await creator.clock.sleep_s(lives_s)
            creator.end("the test")

        run_virtual(main())

    return run


def test_a_name_whose_creator_lives_on_is_refused(offered: Callable[[float], None]) -> None:
    with pytest.raises(NameTaken, match="creator-base is on base"):
        offered(10 * PREDECESSOR_ENDS_S)


def test_the_creator_of_a_killed_offer_may_end_first(offered: Callable[[float], None]) -> None:
    with pytest.raises(LinkError, match="component_database"):  # the next one that it asks, and that is not here
        offered(PREDECESSOR_ENDS_S / 2)


@pytest.mark.parametrize("is_there", [True, False])
def test_a_launcher_that_does_not_answer_keeps_no_machine_out(
    local_mission: Callable[..., Any], beside: Callable[..., Any], *, is_there: bool
) -> None:
    """It may be paused; the mission goes on without it."""

    async def main() -> None:
        async with local_mission() as network:
            clock, own = VirtualClock(), launch("launcher")
            launcher = Component[NoParameters](own, network.join(own.address, clock), clock)
            bus = network.join("backbone/offer-far", clock)
            if not is_there:
                assert await run_of(bus) is None
                await launcher.leave_bus()
                return
            async with beside(launcher):
                assert await run_of(bus) == launcher.component_state().incarnation

    run_virtual(main())
