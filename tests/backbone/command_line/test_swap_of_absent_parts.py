"""``swap`` of a module or behavior whose component is placed, and is being started again just now."""

from __future__ import annotations

import pytest

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.swapping import addressed
from backbone.errors import Refusal
from backbone.exchange import Silent, SwapModule, UnknownModule
from backbone.mission.model import EXECUTION_UNIT
from backbone.nameserver.messages import Components, ListComponents
from backbone.placer.messages import ListPlacements, Placement, Placements
from backbone.wire import Envelope, Message


@pytest.mark.parametrize(
    ("placed", "refused", "told"),
    [
        ({"waves": EXECUTION_UNIT}, Silent, "smoothing is not known: waves is not up and may run it"),
        ({"smoothing": "patrol"}, Silent, "smoothing is not up"),
        ({"radio": "command_radio"}, UnknownModule, "'smoothing' runs"),
    ],
)
def test_what_is_being_started_again_is_not_called_unknown(
    placed: dict[str, str], refused: type[Refusal], told: str
) -> None:
    async def listed(_asked: Envelope[Message]) -> Message:
        return Components([], complete=True, hub_since_s=0.0)

    async def placements(_asked: Envelope[Message]) -> Message:
        return Placements([Placement(name, kind, "base", "", 0.0, []) for name, kind in placed.items()])

    async def scene() -> None:
        bus = LocalNetwork("m").join(NAMESERVER, VirtualClock())
        bus.serve(NAMESERVER, ListComponents, listed)
        bus.serve(PLACER, ListPlacements, placements)
        with pytest.raises(refused, match=told):
            await addressed(bus, SwapModule("smoothing", "pair:Smoothing"))
        await bus.close()

    run_virtual(scene())
