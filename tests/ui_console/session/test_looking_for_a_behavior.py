"""A behavior that does not run now is no unknown name: the refusal says so, and where the reason is."""

from __future__ import annotations

from typing import Any

import pytest

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.nameserver.messages import Resolve, UnknownName
from backbone.placer.messages import AskPlacement, NotPlaced, Placement
from ui_console.session.looking import find_behavior

WATCH = Placement("watch", "watch_for_motion", "base", "backbone/launcher", 1.0, [])


@pytest.mark.parametrize(
    ("placed", "told"),
    [
        (WATCH, "^watch does not run now .*scout-backbone why watch"),
        (NotPlaced("watch is not placed"), "^no component is registered as 'watch'"),
        (None, "^no component is registered as 'watch'"),
    ],
    ids=["it is started again", "the placer does not know it", "no placer"],
)
def test_a_name_that_the_placer_wants_is_not_called_unknown(placed: Placement | NotPlaced | None, told: str) -> None:
    network, clock = LocalNetwork("night"), VirtualClock()

    async def not_registered(_asked: Any) -> Placement:
        raise UnknownName("no component is registered as 'watch'", name="watch")

    async def answer(_asked: Any) -> Placement:
        if isinstance(placed, Placement):
            return placed
        assert placed is not None
        raise placed

    async def play() -> None:
        LocalBus(network, NAMESERVER, clock).serve(NAMESERVER, Resolve, not_registered)
        if placed is not None:
            LocalBus(network, PLACER, clock).serve(PLACER, AskPlacement, answer)
        await find_behavior(LocalBus(network, "ui_console/cli-1", clock), "watch")

    with pytest.raises(UnknownName, match=told):
        run_virtual(play())
