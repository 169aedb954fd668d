"""Orders to RCs as the RC manager and ARCs give them, for tests of the pool."""

from __future__ import annotations

import contextlib
from typing import Any

from pool_on_local_network import Pool

from backbone.errors import LinkError, Refusal
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRc, Connect, Connected, Disconnect, Disconnected, RcState
from backbone.scheduling.requests import RcUse, Usage
from resource_pool.messages import Applied

ROBOTS = ["scout1", "scout2", "radio"]
EVERYTHING = [*ROBOTS, "video", "grabber"]


def at(name: str) -> str:
    return address(Subsystem.RESOURCE_POOL, name)


async def state_of(pool: Pool, rc: str) -> RcState:
    return await pool.ear.ask(at(rc), AskRc(), RcState, within_s=1)


async def connect(pool: Pool, rc: str, arc: str, epoch: int, **more: Any) -> None:
    given = {"lease_s": 2.0, "use": RcUse(), "companions": {}} | more
    await pool.manager_voice.ask(at(rc), Connect(arc, epoch, **given), Connected, within_s=1)


async def disconnect(pool: Pool, rc: str, arc: str, epoch: int) -> None:
    await pool.manager_voice.ask(at(rc), Disconnect(arc, epoch), Disconnected, within_s=1)


async def connect_robot(pool: Pool, arc: str, epoch: int, scout: str = "scout1", period_s: float = 0.05) -> None:
    """Connect a scout and the radio to the ARC under one epoch, as the RC manager does."""
    companions = {scout: epoch, "radio": epoch}
    await connect(pool, "radio", arc, epoch, use=RcUse([Usage(period_s, 0.002)]), companions=companions)
    await connect(pool, scout, arc, epoch, companions=companions)


async def command(pool: Pool, arc: str, epoch: int, what: Any, scout: str = "scout1") -> Applied:
    return await pool.voice(arc).ask(at(scout), what.under(arc, epoch), Applied, within_s=1)


async def drive_always(pool: Pool, arc: Any, speed: int) -> None:
    while True:
        with contextlib.suppress(Refusal, LinkError):
            await arc.drive(float(speed), float(-speed))
        await pool.clock.sleep_s(0.03)
