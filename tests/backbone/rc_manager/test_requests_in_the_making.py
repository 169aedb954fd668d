"""A request may wait for the start of an RC before it is admitted: what its ARC sends meanwhile counts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from rc_manager_at_work import HARDWARE, PlainArc, Pool, request

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.naming import Subsystem
from backbone.placer.messages import Start, Started
from backbone.rc_manager.messages import AskSchedule, ChangeRuntime, Done, SetIdle, Withdraw
from backbone.scheduling.requests import RequestState, Scheduled
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope, Message

START_S = 5.0


@asynccontextmanager
async def slow_start(here: Pool) -> AsyncIterator[PlainArc]:
    """A pool in which the robot ``left`` does not run, and a placer that needs ``START_S`` to start it.

    Yields:
        An ARC that runs with the frequency ``video``.
    """
    placer = here.network.join(PLACER, here.clock)

    async def start(asked: Envelope[Any]) -> Message:
        await here.clock.sleep_s(START_S)
        await here.rc(HARDWARE[0])
        return Started(f"resource_pool/{asked.body.name}", "here", 1, [])

    placer.serve(PLACER, Start, start)
    here.rcs["left"].end("it was stopped")
    await here.clock.sleep_s(0.5)
    running = await here.arc("running")
    await running.ask_for(request("running", "right", "video", minimum_runtime_s=60.0))
    await here.clock.sleep_s(1.0)
    assert running.is_open
    yield running
    await placer.close()


def test_an_arc_that_ends_before_its_request_is_admitted_cuts_no_slice(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()), slow_start(here) as running:
            launch = here.launch(Subsystem.RESOURCE_POOL, "console", "plain_arc")
            console = PlainArc(launch, here.network.join(launch.address, here.clock), here.clock)
            async with here.beside(console):
                asked = asyncio.create_task(console.ask_for(request("console", "left", "video", priority=100)))
                await here.clock.sleep_s(1.0)
                asked.cancel()
            await here.clock.sleep_s(2 * START_S)
            assert [what for what, *_ in running.log] == ["open"]

    run_virtual(main())


def test_an_arc_that_withdraws_before_its_request_is_admitted_gets_no_rcs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()), slow_start(here) as running:
            console = await here.arc("console")
            asked = asyncio.create_task(console.ask_for(request("console", "left", "video", priority=100)))
            await here.clock.sleep_s(1.0)
            await console.bus.ask(RC_MANAGER, Withdraw("console", "self"), Done, within_s=1)
            console.request = None
            assert (await asked).state is RequestState.IDLE
            await here.clock.sleep_s(2.0)
            assert [what for what, *_ in running.log] == ["open"]

    run_virtual(main())


def test_a_request_counts_as_changed_before_it_was_admitted(pool: Any) -> None:
    async def main() -> tuple[Scheduled, Schedule]:
        async with pool() as here, here.beside(here.manager()), slow_start(here) as running:
            console = await here.arc("console")
            asked = asyncio.create_task(console.ask_for(request("console", "left", "video", priority=100)))
            await here.clock.sleep_s(1.0)
            await console.bus.ask(RC_MANAGER, SetIdle("console", True), Done, within_s=1)
            await console.bus.ask(RC_MANAGER, ChangeRuntime("console", 3.0, 4.0), Done, within_s=1)
            scheduled = await asked
            assert running.is_open
            return scheduled, await console.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)

    scheduled, schedule = run_virtual(main())
    assert scheduled.state is RequestState.IDLE
    [view] = [one for one in schedule.requests if one.arc == "console"]
    assert (view.state, view.minimum_runtime_s) == (RequestState.IDLE, 3.0)
