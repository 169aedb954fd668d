"""ArcKeeper: claims an ARC through the placer, and claims it again whenever it is gone."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from typing import Protocol

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import NameTaken, Stop, Stopping
from backbone.component.peer_monitor import PeerMonitor
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import CreatorSilent, Ended, Start, StopComponent
from backbone.placer.wishes import Wish, ask_to_start, says_ready
from resource_pool.messages import ArcState

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: after a longer wait an operator has reason to press the emergency stop
START_TIME_S = 30.0  # chosen: an ARC may have to wait for RCs that are starting


class KeptArc(Protocol):
    """Interface of ``ArcClient`` for a keeper."""

    address: str

    async def state(self) -> ArcState:
        """Return the ARC's state, or raise a ``LinkError``."""

    async def idle(self, idle: bool = True) -> None:
        """Want no time, or want time again."""

    async def agree(self, state: ArcState) -> None:
        """Apply the ARC's state as if its notice had arrived."""

    async def lost(self) -> None:
        """End the grant, because its ARC is gone."""


class ArcKeeper:
    """Keeps one ARC for its owner."""

    def __init__(
        self, bus: Bus, arc: str, wish: Wish, client: KeptArc, clock: Clock, on_changed: Callable[[], None]
    ) -> None:
        """Create a keeper that claims no ARC yet.

        Args:
            bus: Bus of the decision process.
            wish: Records that the ARC is missing, and why.
            client: Sends questions to the ARC and applies its state.
            on_changed: Called when ``wish.absence()`` may have changed.
        """
        self._bus, self._arc, self._wish, self._client = bus, arc, wish, client
        self._clock, self._on_changed = clock, on_changed

    async def keep(
        self, kind: str, parameters: dict[str, object], *, rests: bool, patience_s: float, is_there: bool = False
    ) -> None:
        """Claim the ARC, and claim it again whenever it is gone, until cancelled; see ``ArcClient.keep``."""
        is_there = is_there or (rests and await self._wake())
        give_up_s = self._clock.now_s() + patience_s * self._clock.rate
        while True:
            if not is_there:
                await self._start_anew(kind, parameters, give_up_s)
            is_there = False
            self._wish.placed()
            self._on_changed()
            monitor = PeerMonitor(self._bus, self._client.address)
            watching = [
                asyncio.create_task(self._agree_after_absence(monitor), name=f"{self._arc}:agree"),
                asyncio.create_task(self._note_absence(monitor), name=f"{self._arc}:absence"),
            ]
            try:
                await self._wait_gone(monitor)
            finally:
                monitor.close()
                for task in watching:
                    task.cancel()
                await asyncio.gather(*watching, return_exceptions=True)
            self._wish.missing("it ended while it was wanted", self._clock.now_s())
            self._on_changed()
            await self._client.lost()

    async def _wake(self) -> bool:
        """Wake a resting ARC, which then sends its request; return False if the ARC did not confirm."""
        try:
            await self._client.idle(False)
        except (LinkError, Refusal) as error:
            log.info("%s does not wake up: %s", self._arc, error)
            return False
        return True

    async def _start_anew(self, kind: str, parameters: dict[str, object], give_up_s: float) -> None:
        """Start the ARC; first end an ARC that an earlier process of the owner left behind."""
        while True:
            try:
                order = Start(kind, self._arc, parameters)
                at = self._client.address
                await ask_to_start(self._bus, self._clock, self._wish, order, at, START_TIME_S, self._on_changed)
                return
            except NameTaken as refusal:
                cause = f"one from before has its name: {refusal.detail}"
                self._wish.missing(cause, self._clock.now_s())
                self._on_changed()
                await self._end_leftover()
            except (LinkError, CreatorSilent) as error:
                cause = f"claimed without an answer: {error}"
            except Refusal as refusal:
                if not self._wish.started and self._clock.now_s() >= give_up_s:
                    raise
                cause = f"it was refused: {refusal.detail}"
            log.info("%s: %s", self._arc, cause)
            pause_s = self._wish.not_started(cause, self._clock.now_s())
            self._on_changed()
            await self._clock.sleep_s(pause_s * self._clock.rate)

    async def _end_leftover(self) -> None:
        try:
            await self._bus.ask(PLACER, StopComponent(self._arc, "left from before"), Ended, within_s=START_TIME_S)
        except Refusal:  # the placer does not know the ARC, so stop it directly
            with contextlib.suppress(LinkError):
                await self._bus.ask(self._client.address, Stop("left from before"), Stopping, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s: ended without an answer: %s", self._arc, error)

    async def _wait_gone(self, monitor: PeerMonitor) -> None:
        """Return when the ARC's token is missing and the ARC does not answer: a token alone may be lost for good."""
        await monitor.wait_gone()
        while await says_ready(self._bus, self._client.address):
            self._wish.ready()
            self._on_changed()
            await monitor.wait_gone()

    async def _note_absence(self, monitor: PeerMonitor) -> None:
        """Report the ARC as absent while its token is missing, even if only this component's own link may be down."""
        await monitor.wait_risen(1)
        while True:
            await monitor.wait_hidden()
            self._wish.missing("it cannot be reached", self._clock.now_s())
            self._on_changed()
            await monitor.wait_there()
            self._wish.placed()
            self._on_changed()

    async def _agree_after_absence(self, monitor: PeerMonitor) -> None:
        """Ask the ARC for its state whenever its token reappears, because notices may have been lost meanwhile."""
        await monitor.wait_there()
        while True:
            await monitor.wait_risen(monitor.times_risen + 1)
            try:
                state = await self._client.state()
            except LinkError as error:
                log.info("%s is back and does not answer: %s", self._arc, error)
                continue
            await self._client.agree(state)
