"""Watch over the ARCs: their requests, their uses of RCs, and their heartbeats."""

from __future__ import annotations

import contextlib
import logging
from collections import Counter
from collections.abc import Coroutine, Iterable, Iterator
from typing import Protocol

from backbone.bus.interface import Bus, Clock
from backbone.component.story import StoryBook
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.arc_switches import ArcSwitches
from backbone.rc_manager.beats import Beats
from backbone.rc_manager.context_switch import in_pool
from backbone.rc_manager.messages import (
    AskRequest,
    Beat,
    ChangeRuntime,
    CurrentRequest,
    Done,
    Extend,
    NotThatArc,
    SetIdle,
    TakePath,
    Withdraw,
)
from backbone.rc_manager.recovery import Recovery
from backbone.scheduling.events import Departed, Event
from backbone.scheduling.requests import PathNode, Scheduled, SchedulingRequest
from backbone.scheduling.views import RequestAttributes
from backbone.wire import Envelope, Message

log = logging.getLogger(__name__)

OF_AN_ARC = (SchedulingRequest, Withdraw, SetIdle, ChangeRuntime, Extend)
ARC_REPLY_S = 1.0  # chosen: an ARC answers in milliseconds; without an answer it hangs or is gone


class ArcService(Protocol):
    """The interface of the RC manager for this watch."""

    bus: Bus
    clock: Clock
    story: StoryBook

    def happened(self, event: Event) -> None:
        """Pass the event to the schedule manager, and carry out its instructions."""

    async def request(self, request: SchedulingRequest) -> Scheduled:
        """Choose RCs for the request, and admit it."""

    def admit_again(self, current: CurrentRequest) -> bool:
        """Admit a request with the RCs chosen for it earlier, unless an RC of them is gone."""

    def start_task(self, work: Coroutine[object, None, None], name: str) -> object:
        """Run the coroutine until the component ends."""


class ArcWatch:
    """The ARCs that request RCs.

    Args:
        service: The RC manager.
        switches: The running context switches.
        recovery: Asks an ARC for its request.
    """

    def __init__(self, service: ArcService, switches: ArcSwitches, recovery: Recovery) -> None:
        self._service, self._switches, self._recovery = service, switches, recovery
        self._beats = Beats(service.clock.rate)
        self._requesting: Counter[str] = Counter()

    def require_sender(self, asked: Envelope[Message]) -> None:
        """Check that a request of an ARC, or a change of it, comes from this ARC.

        Raises:
            NotThatArc: Another component sent it.
        """
        if isinstance(asked.body, OF_AN_ARC) and asked.source != in_pool(asked.body.arc):
            what = f"{type(asked.body).__name__} for {asked.body.arc}"
            self._service.story.note(asked.body.arc, f"{asked.source} was refused: {what}")
            raise NotThatArc(f"the RC manager does not take {what} from {asked.source}", source=asked.source)

    @contextlib.contextmanager
    def choosing(self, arc: str) -> Iterator[None]:
        """Count a request of this ARC as one for which RCs are being chosen."""
        self._requesting[arc] += 1
        try:
            yield
        finally:
            self._requesting[arc] -= 1

    def is_choosing(self) -> bool:
        """Return whether RCs were chosen for a request that the schedule manager does not have yet."""
        return self._requesting.total() > 0

    @property
    def known(self) -> list[str]:
        """The ARCs that ask for RCs."""
        return [*self._beats.heard_s]

    def remember(self, arc: str) -> None:
        """Know the ARC from now on: it asks for RCs."""
        self._beats.heard(arc, self._service.clock.now_s())

    def forget(self, arc: str) -> bool:
        """Know the ARC no longer, and expect no beats; return whether it was known."""
        return self._beats.forget(arc)

    def end_silent(self) -> None:
        """End the requests of ARCs that hang. Call it every ``RENEW_EVERY_S``."""
        for arc, silent_s in self._beats.look(self._service.clock.now_s()).items():
            log.warning("%s has not beaten for %.1f s", arc, silent_s)
            self._service.happened(Departed(arc, "silent"))

    def heard_beat(self, envelope: Envelope[Beat]) -> None:
        """Record a beat of the ARC itself; ask an unknown ARC for its request."""
        arc = envelope.body.arc
        if envelope.source != in_pool(arc):
            return
        if arc in self._beats.heard_s:
            self._beats.heard(arc, self._service.clock.now_s())
        elif arc not in self._switches and not self._requesting[arc]:
            self._switches.begin(arc, lambda: self._meet(arc))

    async def _meet(self, arc: str) -> None:
        """Readmit an ARC that beats but is unknown: it hung, or its request was lost with an earlier manager."""
        current = (await self._recovery.ask_all([in_pool(arc)], AskRequest(), CurrentRequest)).get(arc)
        if current is None or arc in self._beats.heard_s or self._requesting[arc] or self._service.admit_again(current):
            return
        try:
            await self._service.request(current.request)  # its own request was lost, or is still on its way
        except (Refusal, LinkError) as error:
            self._service.story.note(arc, f"got no place in the schedule: {error}")

    def tell_paths(self, requests: Iterable[RequestAttributes]) -> None:
        """Send ARCs their present paths, because a later RC manager must receive these from them."""
        for one in requests:
            self._service.start_task(self._tell_path(one.arc, one.path), f"path of {one.arc}")

    async def _tell_path(self, arc: str, path: list[PathNode]) -> None:
        try:
            await self._service.bus.ask(in_pool(arc), TakePath(path), Done, within_s=ARC_REPLY_S)
        except (Refusal, LinkError) as error:
            self._service.story.note(arc, f"did not accept its new path; the next RC manager would not get it: {error}")
