"""Subscription to the stops and lifts of the robot that a console holds."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from backbone.bus.interface import Subscription
from backbone.errors import LinkError, Refusal
from resource_pool.arc_client import StopState, ask_stop, watch_stops

if TYPE_CHECKING:
    from ui_console.session.observer import AnyObserver

log = logging.getLogger(__name__)

LEARN_WITHIN_S = 0.3  # chosen: many times the time of an answer, less than an ARC waits for the reply to its notice


class StopEar:
    """Subscribes to one robot at a time.

    Args:
        console: The console that holds the robot.
        heard: Called with each state, beginning with the present one.
    """

    def __init__(self, console: AnyObserver, heard: Callable[[StopState], None]) -> None:
        self._console, self._heard = console, heard
        self._listening: Subscription | None = None
        self._robot, self._known = "", asyncio.Event()

    async def listen(self, robot: str) -> None:
        """Subscribe to this robot only; return when its state is known, or after a short time-out.

        When: as soon as the robot of the claim is known, so that the grant does not wait for the answer.
        """
        if self._listening is None or robot != self._robot:
            self.close()
            self._robot, self._known = robot, asyncio.Event()
            self._listening = watch_stops(self._console.bus, self._heard, robot)
            await self._ask(robot, self._known)
        await self._known.wait()

    def close(self) -> None:
        """Unsubscribe."""
        if self._listening is not None:
            self._listening.close()
            self._listening = None

    async def _ask(self, robot: str, known: asyncio.Event) -> None:
        try:
            async with asyncio.timeout(LEARN_WITHIN_S):
                self._heard(await ask_stop(self._console.bus, robot))
        except (Refusal, LinkError, TimeoutError) as error:  # other robots may not support stops
            log.info("%s did not answer with its stop: %s", robot, error)
        finally:
            known.set()
