"""A placer for consoles that claim ARCs of a pool on the local bus."""

from __future__ import annotations

from typing import Any

from pool_on_local_network import ARC_CLASSES, Pool

from backbone.addresses import PLACER
from backbone.creator.messages import EndedBy
from backbone.naming import Subsystem, address
from backbone.placer.messages import Ended, NotPlaced, PlacerQuestion, Start, Started, StopComponent
from backbone.wire import Envelope, Message


class PoolPlacer:
    """Starts and ends ARCs in the pool."""

    def __init__(self, pool: Pool) -> None:
        self._pool = pool
        self.bus = pool.network.join(PLACER, pool.clock)
        self.bus.serve(PLACER, PlacerQuestion, self._answer)
        self.bus.declare_alive(PLACER)

    async def _answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case Start(type=kind, name=name, parameters=parameters):
                if name in self._pool.running:
                    await self._end(name)
                await self._pool.start(ARC_CLASSES[kind], name, parameters, kind=kind)
                return Started(address(Subsystem.RESOURCE_POOL, name), "local", 1, [])
            case StopComponent(name=name):
                if name not in self._pool.running:
                    raise NotPlaced(f"{name} does not run")
                await self._end(name)
                return Ended(name, EndedBy.ASKING)
            case _:
                raise NotPlaced("not here")

    async def _end(self, name: str) -> None:
        if self._pool.is_alive(name):
            await self._pool.end(name)
        else:
            await self._pool.outcome(name)
