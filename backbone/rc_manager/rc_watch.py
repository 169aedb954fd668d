"""Watch over the RCs: the schedule may use an RC if it runs, is credible, and has no earlier holds.

If an RC is missing, does not answer or contradicts itself, only this RC is down for the schedule manager. The watch
asks it again until its answer is credible and it has confirmed the end of all holds.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Iterable
from typing import Protocol

from backbone.addresses import PLACER
from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.messages import Absence, LogLevel, NameTaken
from backbone.dependency_database.messages import Resource
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import Start, Started
from backbone.rc_manager.context_switch import RC_REPLY_S, ContextSwitch, Hold, in_pool
from backbone.rc_manager.credibility import contradiction
from backbone.rc_manager.failures import Failures
from backbone.rc_manager.messages import AskRc, RcState
from backbone.rc_manager.recovery import Found, Recovery
from backbone.rc_manager.silent_hosts import SilentHosts
from backbone.scheduling.events import CapacityChanged, Event, RcCameBack, RcWentDown
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.shares import Shares
from backbone.wire import Envelope, MalformedMessage

log = logging.getLogger(__name__)

START_TIME_S = 30.0  # chosen: a framegrabber opens a renderer before it is ready
MEET_AGAIN_S = 0.5  # chosen: a quarter of a lease, because mostly an old hold keeps an RC from connecting
REMEDY = "examine its hardware; 'scout-backbone story {name}' shows its failures"
MEET_LATEST_S = 16.0  # chosen: meanwhile an ARC preempted for a vain connection gets some of the papers' 5 s slices


class Service(ComponentOfParts, Protocol):
    """The interface of the RC manager for its parts."""

    manager: ScheduleManager
    shares: Shares

    def happened(self, event: Event) -> None:
        """Pass the event to the schedule manager, and carry out its instructions."""

    def heard_rc(self, envelope: Envelope[RcState]) -> None:
        """Apply the published state of an RC."""

    def is_choosing(self) -> bool:
        """Return whether RCs were chosen for a request that the schedule manager does not have yet."""


class RcWatch:
    """Checks RCs that appear, and repeats the check of those that failed.

    Attributes:
        resources: RC → its resource; set before any other use.
        up: RCs that count as up.
    """

    def __init__(self, service: Service, failures: Failures, context_switch: ContextSwitch, recovery: Recovery) -> None:
        """Count no RC as up.

        Args:
            service: The RC manager.
            failures: Gets the RCs that cannot be used.
            context_switch: Ends an RC's remaining holds.
            recovery: Finds the present components.
        """
        self._service, self._failures = service, failures
        self._hosts = SilentHosts(service.bus, service.clock, service.launch.host)
        self._context_switch = context_switch
        self._recovery = recovery
        self.resources: dict[str, Resource] = {}
        self.up: set[str] = set()
        self._failing: set[str] = set()
        self._pauses_s: dict[str, float] = {}
        self._meeting: Counter[str] = Counter()
        self._doubted: set[str] = set()
        self._starts: dict[str, asyncio.Task[None]] = {}

    @property
    def starts(self) -> list[asyncio.Task[None]]:
        """The running starts through the placer."""
        return [*self._starts.values()]

    def absences(self) -> list[Absence]:
        """Return the RCs that run and cannot be used: put aside, unsafe, silent, or connected in vain."""
        used = {lease.rc for lease in self._service.manager.leases()}
        needed = used | (self.resources.keys() - self.up) | (self.resources.keys() & self._failures.repeated())
        return self._failures.absences(needed, "the RC manager tries it again", self._remedy)

    def _remedy(self, rc: str) -> str:
        host = self._hosts.remedy(rc) if self._failures.is_silent(rc) else ""
        return host or REMEDY.format(name=rc)

    def remedy_of_hosts(self, names: Iterable[str]) -> str:
        """Return the remedy for the first of these components on a full host or behind a slow link; empty: none is."""
        return next(filter(None, map(self._hosts.remedy, names)), "")

    def measure_hosts(self, names: Iterable[str]) -> None:
        """Measure the round trips to the hosts of these components."""
        for name in names:
            self._service.start_task(self._measure_host(name), f"measure the host of {name}")

    def forget_hosts(self, names: Iterable[str]) -> None:
        """Forget what was measured for these components."""
        for name in names:
            self._hosts.forget(name)

    def missing(self) -> list[str]:
        """Return the RCs that do not run, sorted."""
        return sorted(self.resources.keys() - self.up - self._failing)

    async def have_running(self, rcs: Iterable[str]) -> None:
        """Start stopped RCs through the placer; return when all answer, or the placer works on them.

        Raises:
            Refusal: An RC cannot be started.
        """
        missing = [rc for rc in rcs if rc not in self.up and rc not in self._failures.put_aside]
        for rc in missing:
            if rc not in self._starts:
                self._starts[rc] = asyncio.create_task(self._start(self.resources[rc]), name=f"start {rc}")
        await asyncio.gather(*(asyncio.shield(self._starts[rc]) for rc in missing))

    async def meet(self, rc: str) -> bool:
        """Ask the RC for its state and pass that to the schedule manager; return whether it is up.

        The RC counted as down, so its remaining holds are from earlier grants. They are ended first.
        """
        if rc in self.up:
            return True
        state = await self._ask(rc)
        if state is None:
            return False
        holds = [(rc, holder.arc, holder.epoch) for holder in state.holders]
        if rc not in self.up and not await self._context_switch.clear(rc, holds):
            return False
        if rc not in self.resources:  # removed meanwhile
            return False
        if rc not in self.up:
            if self._failures.put_aside.pop(rc, ""):
                self._service.story.note(rc, "is credible again")
            self.up.add(rc)
            if rc not in self._pauses_s:
                self._failures.end(rc)
            self._service.happened(RcCameBack(rc, state.last_epoch))
            if state.capacity != self.resources[rc].capacity:
                self._service.happened(CapacityChanged(rc, state.capacity))
        return True

    def meet_again(self, rc: str) -> None:
        """Check an RC that appeared or published; if it is not up afterwards, check it again later."""

        async def again() -> None:
            self._meeting[rc] += 1
            try:
                await self.meet(rc)
            finally:
                self._meeting[rc] -= 1
            if rc not in self.up:  # another check at the same time may have found it up
                self.meet_in_a_while(rc)

        self._service.start_task(again(), f"meet {rc}")

    def meet_in_a_while(self, rc: str) -> None:
        """Check a failed RC until it is up; not at once, because RC and schedule could retry each other for ever.

        Each retry may preempt holders of other RCs, so the wait doubles with each further connection in vain.
        """
        self._failures.begin(rc)
        self._service.changed()
        if rc not in self._failing:
            self._failing.add(rc)
            self._service.start_task(self._meet_later(rc, self._pauses_s.get(rc, MEET_AGAIN_S)), f"meet {rc}")
            if self._failures.is_silent(rc):
                self._service.start_task(self._measure_host(rc), f"measure the host of {rc}")

    def connected(self, rcs: Iterable[str]) -> None:
        """Note that these RCs were connected."""
        for rc in rcs:
            self._pauses_s.pop(rc, None)
            self._failures.end(rc)

    def failed(self, rc: str) -> None:
        """Count the RC as down after a connection in vain; the caller informs the schedule manager."""
        self.up.discard(rc)
        self._pauses_s[rc] = min(MEET_LATEST_S, 2 * self._pauses_s.get(rc, MEET_AGAIN_S / 2))

    def forget(self, rc: str) -> bool:
        """Count an RC whose component is gone as down; return whether it was up or put aside."""
        was_known = rc in self.up or bool(self._failures.put_aside.pop(rc, ""))
        self.up.discard(rc)
        self._pauses_s.pop(rc, None)  # its next process may be sound
        self._failures.forget(rc)
        return was_known

    def does_not_answer(self, rc: str) -> None:
        """Count the RC as down from now on, until it answers and is cleared."""
        if rc in self.up:
            self.up.discard(rc)
            self._service.happened(RcWentDown(rc))
            self.meet_again(rc)

    def believes(self, state: RcState) -> bool:
        """Return whether a published state of an RC is credible; if not, ask the RC itself."""
        rc, service = state.name, self._service
        if rc not in self.resources:
            return False
        if rc not in self.up:
            if rc not in self._failing and not self._meeting[rc]:  # a check makes a disobedient RC publish again
                self.meet_again(rc)
            return False
        if contradiction(state, self.resources[rc], service.clock.now_s(), service.manager.epoch_of(rc)):
            if rc not in self._doubted:
                service.start_task(self._ask_doubted(rc), f"ask {rc}")
            return False
        return True

    async def cleared(self, found: Found) -> Found:
        """End the holds that no ARC has rightly, and close those ARCs' gates; return what can be taken over.

        RCs that are not credible, or do not confirm the end, are left out and checked once this manager serves. Nobody
        waits for them, because no lease is renewed until then.
        """
        now_s = self._service.clock.now_s()
        found = found.without([rc for rc, s in found.rcs.items() if contradiction(s, self.resources[rc], now_s)])
        ended: set[Hold] = set()
        closed: set[str] = set()
        while True:
            holds = [hold for hold in found.orphans() if hold not in ended]
            gates = [arc for arc in found.strays() if arc not in closed]
            if not (holds or gates):
                return found
            ended.update(holds)
            closed.update(gates)
            found = found.without(await self._context_switch.end_orphans(holds, gates))

    async def _start(self, resource: Resource) -> None:
        service, rc = self._service, resource.name
        service.story.note(rc, "is claimed but does not run: asks the placer to start it")
        order = Start(resource.type, rc, resource.rc_parameters(), resource.host, process=resource.process)
        try:
            await service.bus.ask(PLACER, order, Started, within_s=START_TIME_S)
        except NameTaken:  # it was started before and is missing now: a request waits until it is back
            service.story.note(rc, "is being started by the placer")
        except Refusal:
            if not await self.meet(rc):
                raise
        finally:
            del self._starts[rc]
        await self.meet(rc)

    async def _meet_later(self, rc: str, after_s: float) -> None:
        clock = self._service.clock
        try:
            await clock.sleep_s(after_s * clock.rate)
            while not await self.meet(rc) and await self._recovery.is_present(rc):
                await clock.sleep_s(MEET_AGAIN_S * clock.rate)
        finally:
            self._failing.discard(rc)
            if rc not in self.up:
                self._failures.end(rc)

    async def _measure_host(self, rc: str) -> None:
        await self._hosts.measure(rc)
        self._service.changed()

    async def _ask(self, rc: str, given: int | None = None) -> RcState | None:
        """Return the RC's own report of its state; None if it does not answer, or is not credible and put aside."""
        bus, clock, resource = self._service.bus, self._service.clock, self.resources.get(rc)
        if resource is None:  # removed meanwhile
            return None
        try:
            state = await bus.ask(in_pool(rc), AskRc(), RcState, within_s=RC_REPLY_S)
        except MalformedMessage as nonsense:
            self._put_aside(rc, f"its answer cannot be read: {nonsense.detail}")
            return None
        except (Refusal, LinkError) as error:
            log.warning("%s did not answer with its state: %s", rc, error)
            self._failures.complain(rc, "did not answer with its state", error)
            return None
        fault = contradiction(state, resource, clock.now_s(), given)
        if fault:
            self._put_aside(rc, fault)
            return None
        return state

    async def _ask_doubted(self, rc: str) -> None:
        """Ask the RC itself after a publication that is not credible: any component may publish in its name."""
        self._doubted.add(rc)
        try:
            await self._ask(rc, self._service.manager.epoch_of(rc))
        finally:
            self._doubted.discard(rc)

    def _put_aside(self, rc: str, fault: str) -> None:
        """Plan nothing on this RC until it is credible, and continue with the others."""
        self.up.discard(rc)
        before = self._failures.put_aside.get(rc)
        if before != fault:
            self._failures.put_aside[rc] = fault
            self._service.happened(RcWentDown(rc, fault))
        if before is None:  # each answer may have another number in it
            log.warning("%s is put aside: %s", rc, fault)
            self._service.publish_event(rc, f"is put aside: {fault}", LogLevel.WARNING)
        self.meet_in_a_while(rc)
