"""Unanswered stops: emergency stops that a console sends until the robot answers, because a link was cut."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractContextManager

from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError
from resource_pool.arc_client import StopState, stop_robot

AGAIN_EACH_S = 0.5  # chosen: once a link is back, its robot stops as soon as a person sees the robot again


class UnansweredStops:
    """The emergency stops of one console that no robot answered.

    Law: each is sent again until the robot's RC answers it or ``run`` is cancelled. A late stop is safe, because a stop
    moves nothing.

    Args:
        heard: Called with each answer.
        showing_refusal: Makes a block that shows a refusal instead of raising it.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        heard: Callable[[StopState], None],
        showing_refusal: Callable[[], AbstractContextManager[object]],
    ) -> None:
        self._bus, self._clock, self._heard, self._showing_refusal = bus, clock, heard, showing_refusal
        self._stops: dict[str, tuple[str, str]] = {}
        self._pending: set[str] = set()
        self._news = asyncio.Event()

    def __contains__(self, robot: str) -> bool:
        """Return whether this console stopped the robot and has no answer yet."""
        return robot in self._pending

    def begin(self, robot: str) -> None:
        """Count the robot as stopped without an answer from now on."""
        self._pending.add(robot)

    def add(self, robot: str, reason: str, user: str) -> None:
        """Send this stop again until it is answered."""
        self._stops[robot] = reason, user
        self._news.set()

    def answered(self, robot: str) -> None:
        """Send the robot no further stop: its RC answered one."""
        self._stops.pop(robot, None)
        self._pending.discard(robot)

    def gave_up(self, robot: str) -> None:
        """Count the robot as stopped no longer, unless an earlier stop is being repeated."""
        if robot not in self._stops:
            self._pending.discard(robot)

    async def run(self) -> None:
        """Send what is not answered; until cancelled."""
        while True:
            await self._news.wait()
            await self._clock.sleep_s(AGAIN_EACH_S * self._clock.rate)
            await asyncio.gather(*(self._again(robot, *stop) for robot, stop in self._stops.items()))
            if not self._stops:
                self._news.clear()

    async def _again(self, robot: str, reason: str, user: str) -> None:
        with self._showing_refusal():
            try:
                stop = await stop_robot(self._bus, robot, reason, user)
            except LinkError:
                return
            self._heard(stop)
        self.answered(robot)
