"""Unanswered stops: emergency stops that a console sends until the robot answers, because a link was cut."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from backbone.bus.interface import Clock

AGAIN_EACH_S = 0.5  # chosen: once a link is back, its robot stops as soon as a person sees the robot again


class UnansweredStops:
    """The emergency stops of one console that no robot answered.

    Law: each is sent again until it is answered or ``run`` is cancelled; never in vain, because a stop moves nothing.

    Args:
        clock: The mission's clock.
        send: Sends a stop with robot, reason and user; returns whether the robot's RC answered.
    """

    def __init__(self, clock: Clock, send: Callable[[str, str, str], Awaitable[bool]]) -> None:
        self._clock, self._send = clock, send
        self._stops: dict[str, tuple[str, str]] = {}
        self._news = asyncio.Event()

    def add(self, robot: str, reason: str, user: str) -> None:
        """Send this stop again until it is answered."""
        self._stops[robot] = reason, user
        self._news.set()

    def answered(self, robot: str) -> None:
        """Send the robot no further stop: its RC answered one."""
        self._stops.pop(robot, None)

    async def run(self) -> None:
        """Send what is not answered; until cancelled."""
        while True:
            await self._news.wait()
            await self._clock.sleep_s(AGAIN_EACH_S * self._clock.rate)
            await asyncio.gather(*(self._again(robot) for robot in self._stops))
            if not self._stops:
                self._news.clear()

    async def _again(self, robot: str) -> None:
        if await self._send(robot, *self._stops[robot]):
            self.answered(robot)
