"""Pools whose robots reply on their radio, and what they say."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
from pool_on_local_network import WORLD, Pool, WiretappedRadio, a_pool

from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from resource_pool.arc_client import ArcClient, Readings, ask_readings
from resource_pool.drivers.interface import DriverSite
from resource_pool.simulated_world import SimulatedWorld
from scout_model.description import AirDescription, RobotPlace, WorldDescription

RADIO, SCOUT1, AIR = (address(Subsystem.RESOURCE_POOL, name) for name in ("radio", "scout1", "world"))
BITS_PER_S = 115_200.0
RCS = ["scout1", "scout2", "radio"]
HEARING, DEAF = "pool_on_local_network:WiretappedRadio", "replying_pool:DeafRadio"


class DeafRadio:
    """A radio of before there were replies."""

    options_type = WiretappedRadio.options_type

    def __init__(self, site: DriverSite) -> None:
        self._radio = WiretappedRadio(site)

    async def open(self) -> None:
        await self._radio.open()

    async def transmit(self, network_id: int, payload: bytes, **audit: Any) -> float | None:
        return await self._radio.transmit(network_id, payload, **audit)

    async def close(self) -> None:
        await self._radio.close()


def world_with(battery_j: float | None = None, **air: Any) -> WorldDescription:
    scouts = [
        RobotPlace("scout1", 1, 2.0, 2.0, 0.0, battery_j=battery_j),
        RobotPlace("scout2", 2, 4.0, 4.0, 0.0),
    ]
    return msgspec.structs.replace(WORLD, robots=scouts, air=AirDescription(**air), seed=3)


async def other_world(pool: Pool, world: WorldDescription) -> None:
    """Replace the world by another one, whose robots begin anew."""
    await pool.kill("world")
    await pool.start(SimulatedWorld, "world", {"world": msgspec.to_builtins(world)})


@asynccontextmanager
async def pool_in(mission: Any, world: WorldDescription) -> AsyncIterator[Pool]:
    async with a_pool(mission, RCS) as pool:
        await other_world(pool, world)
        yield pool


async def granted(pool: Pool, robot: str = "scout1") -> ArcClient:
    arc = await pool.arc(await pool.owner(f"driver-of-{robot}"), "drive", robot)
    await arc.wait_granted()
    return arc


async def drive(pool: Pool, seconds: float, *arcs: ArcClient) -> None:
    """Drive in circles."""
    end_s = pool.clock.now_s() + seconds
    while pool.clock.now_s() < end_s:
        for arc in arcs:
            await arc.drive(6.0, 9.0)
        await pool.clock.sleep_s(0.25)


def overhear(pool: Pool, of: str, conversation: Conversation, kind: Any) -> list[Any]:
    """Return the publications from now on; grows."""
    heard: list[Any] = []
    pool.voice_of("ui_console/ear").subscribe(of, conversation, kind, lambda envelope: heard.append(envelope.body))
    return heard


def said(events: list[StoryEvent]) -> list[tuple[LogLevel, str, str]]:
    return [(event.level, event.subject, event.what) for event in events if event.level is not LogLevel.INFO]


async def asked(pool: Pool, rc: str = "scout1") -> Readings:
    return await ask_readings(pool.voice_of("ui_console/ear"), rc)


def counts(pool: Pool, rc: str) -> dict[str, float]:
    return pool.running[rc].statistics()
