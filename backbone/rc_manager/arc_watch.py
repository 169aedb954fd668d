"""Watch over the ARCs: their requests, their uses of RCs, and their heartbeats."""

from __future__ import annotations

import contextlib
import logging
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import msgspec

from backbone.component.messages import Absence
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.arc_switches import ArcSwitches
from backbone.rc_manager.beats import Beats
from backbone.rc_manager.context_switch import in_pool
from backbone.rc_manager.failures import Failures
from backbone.rc_manager.messages import (
    AskRequest,
    Beat,
    ChangeRuntime,
    CurrentRequest,
    Extend,
    NotThatArc,
    SetIdle,
    Withdraw,
)
from backbone.rc_manager.rc_watch import Service
from backbone.rc_manager.recovery import Recovery
from backbone.scheduling.events import Departed
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.requests import Scheduled, SchedulingRequest
from backbone.scheduling.run_times import can_be_planned
from backbone.wire import Envelope, Message

log = logging.getLogger(__name__)

OF_AN_ARC = (SchedulingRequest, Withdraw, SetIdle, ChangeRuntime, Extend)


@dataclass(slots=True, eq=False)
class Choosing:
    """A request for which RCs are being chosen.

    Attributes:
        request: The request, with the changes that its ARC has sent meanwhile; None: the ARC withdrew it, or ended.
    """

    request: SchedulingRequest | None


class ArcService(Service, Protocol):
    """The interface of the RC manager for this watch."""

    async def request(self, request: SchedulingRequest) -> Scheduled:
        """Choose RCs for the request, and admit it."""

    def admit_again(self, current: CurrentRequest) -> bool:
        """Admit a request with the RCs chosen for it earlier, unless an RC of them is gone."""


class ArcWatch:
    """The ARCs that request RCs.

    Args:
        service: The RC manager.
        failures: Holds the ARCs that did not open their gates.
        switches: The running context switches.
        recovery: Asks an ARC for its request.
    """

    def __init__(self, service: ArcService, failures: Failures, switches: ArcSwitches, recovery: Recovery) -> None:
        self._service, self._failures, self._switches, self._recovery = service, failures, switches, recovery
        self._beats = Beats(service.clock.rate)
        self._requesting: defaultdict[str, list[Choosing]] = defaultdict(list)
        self._meeting: set[str] = set()

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
    def choosing(self, request: SchedulingRequest) -> Iterator[Choosing]:
        """Keep the request up to date while RCs are being chosen for it: this may include the start of an RC."""
        choosing = Choosing(request)
        self._requesting[request.arc].append(choosing)
        try:
            yield choosing
        finally:
            self._requesting[request.arc].remove(choosing)
            if not self._requesting[request.arc]:
                del self._requesting[request.arc]

    def is_choosing(self) -> bool:
        """Return whether RCs were chosen for a request that the schedule manager does not have yet."""
        return bool(self._requesting)

    def keep_change(self, change: Message) -> None:
        """Apply the change of an ARC's request also to those for which RCs are being chosen."""
        match change:
            case SetIdle(arc=arc, idle=idle):
                self._change(arc, idle=idle)
            case ChangeRuntime(arc=arc, minimum_runtime_s=least_s, maximum_runtime_s=most_s):
                if can_be_planned(least_s, max(least_s, most_s)):
                    self._change(arc, minimum_runtime_s=least_s, maximum_runtime_s=most_s)

    def _change(self, arc: str, **changes: bool | float) -> None:
        for choosing in self._requesting.get(arc, ()):
            if choosing.request is not None:
                choosing.request = msgspec.structs.replace(choosing.request, **changes)

    @property
    def known(self) -> list[str]:
        """The ARCs that ask for RCs."""
        return [*dict.fromkeys([*self._beats.heard_s, *self._requesting])]

    def absences(self, answers: Answers) -> list[Absence]:
        """Return the ARCs that want time, and cannot be served or did not open their gates when last connected.

        An ARC that waits for others is among them only if it failed repeatedly: after one failure it lacks only time,
        and the cause may be over long before its next connection.
        """
        never = [
            Absence(arc, since_s, why, f"waits until {until}", is_running=True)
            for arc, since_s, why, until in answers.unservable()
        ]
        named = answers.wanting() - (answers.waiting() - self._switches.failed_again - self._failures.repeated())
        return never + self._failures.absences(named, "the RC manager connects it again", self._switches.remedy)

    def remember(self, arc: str) -> None:
        """Know the ARC from now on: it asks for RCs."""
        self._beats.heard(arc, self._service.clock.now_s())

    def forget(self, arc: str) -> bool:
        """Know the ARC and its requests no longer, and expect no beats; return whether a request was admitted."""
        for choosing in self._requesting.get(arc, ()):
            choosing.request = None
        self._failures.forget(arc)
        self._switches.forget(arc)
        return self._beats.forget(arc)

    def end_silent(self) -> None:
        """End the requests of ARCs that hang. Call it every ``RENEW_EVERY_S``."""
        for arc, silent_s in self._beats.look(self._service.clock.now_s()).items():
            log.warning("%s has not beaten for %.1f s", arc, silent_s)
            self._failures.end(arc)
            self._service.happened(Departed(arc, "silent"))

    def heard_beat(self, envelope: Envelope[Beat]) -> None:
        """Record a beat of the ARC itself; ask an unknown ARC for its request."""
        arc = envelope.body.arc
        if envelope.source != in_pool(arc):
            return
        if arc in self._beats.heard_s:
            self._beats.heard(arc, self._service.clock.now_s())
        elif arc not in self._switches and arc not in self._requesting and arc not in self._meeting:
            self._meeting.add(arc)
            self._service.start_task(self._meet(arc), f"meet {arc}")

    async def _meet(self, arc: str) -> None:
        """Readmit an ARC that beats but is unknown: it hung, or its request was lost with an earlier manager.

        This is no switch: a connection that waits for it could be overtaken by one with a later epoch.
        """
        try:
            await self._ask_for_its_request(arc)
        finally:
            self._meeting.discard(arc)

    async def _ask_for_its_request(self, arc: str) -> None:
        current = (await self._recovery.ask_all([in_pool(arc)], AskRequest(), CurrentRequest)).get(arc)
        is_known = arc in self._beats.heard_s or arc in self._requesting
        if current is None or is_known or self._service.admit_again(current):
            return
        try:
            await self._service.request(current.request)  # its own request was lost, or is still on its way
        except (Refusal, LinkError) as error:
            self._service.story.note(arc, f"got no place in the schedule: {error}")
