"""The order for the next start of an exchanged part, while the placer hangs and is replaced."""

from __future__ import annotations

import asyncio

import pytest

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.placer.messages import ReviseStart, StartRevised
from backbone.placer.revising import revise_start
from backbone.wire import Envelope, Message


@pytest.mark.parametrize(("replaced_after_s", "remark"), [(4.0, ""), (60.0, "may use the old class again")])
def test_the_order_reaches_the_next_placer_or_the_operator_learns_that_the_old_class_may_return(
    replaced_after_s: float, remark: str
) -> None:
    async def never(_asked: Envelope[ReviseStart]) -> Message:
        await asyncio.Event().wait()
        raise AssertionError("waits for ever")

    async def revise(asked: Envelope[ReviseStart]) -> Message:
        revised.append(asked.body.name)
        return StartRevised()

    revised: list[str] = []

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("m")
        unit, hung, successor = (network.join(at, clock) for at in ("mission_control/unit", PLACER, PLACER))
        hung.serve(PLACER, ReviseStart, never)
        asking = asyncio.create_task(revise_start(unit, clock, ReviseStart("unit", {})))
        await asyncio.wait({asking}, timeout=replaced_after_s)
        await hung.close()
        successor.serve(PLACER, ReviseStart, revise)
        assert remark in await asking
        assert revised == ([] if remark else ["unit"])
        for bus in (unit, successor):
            await bus.close()

    run_virtual(scene())
