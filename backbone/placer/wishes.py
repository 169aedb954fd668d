"""A wish: one component that its owner wants to run; the owner keeps it placed through the placer.

``Wish`` is pure: it turns events into pauses and into the absence that the owner reports. ``keep_placed`` is the loop
around it. The owner repeatedly compares its wish with the placer's record, so the reason of an absence (an exit code, a
signal, a lost host, a restarted placer) makes no difference. A wish ends in two ways: its owner cancels the loop, or an
order to the placer stops the component.

Prior art: level-triggered controllers of Kubernetes; permanent children of Erlang supervisors.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import Absence, AskState, ComponentState, LifeState, NameTaken
from backbone.component.peer_monitor import PeerMonitor
from backbone.creator.messages import START_MOST_S
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import AskPlacement, CreatorSilent, NotPlaced, Placement, Start, Started, StoppedMeanwhile
from backbone.waiting import first_of

log = logging.getLogger(__name__)

PAUSE_FIRST_S, PAUSE_MOST_S = 0.2, 5.0  # chosen: a restarted placer is back within the first few; machine seconds
COMPARE_EVERY_S = 20.0  # chosen: every known cause triggers a comparison at once; this covers unknown causes
REPLY_TIME_S = 1.0  # chosen: the placer answers in milliseconds
START_WITHIN_S = START_MOST_S + 10.0  # chosen: the placer's own limit and a moment
SLOW_START_S = 1.5  # chosen: most starts take less than one; health names an absent component within 2 s
ASK_ITSELF_S = 0.5  # chosen: a component answers in milliseconds; with the token's second, health is right within 2 s


@dataclass
class Wish:
    """One wanted component; times are mission seconds.

    Attributes:
        missing_since_s: Mission time at which it was found missing; negative: it is placed, or is being started.
        cause: Why it is missing, in one line.
        started: True if it was ever placed.
        order_id: Id of all its orders, the same also if placer and creator die together; empty: the placer chooses it.
    """

    name: str
    missing_since_s: float = -1.0
    cause: str = ""
    started: bool = False
    order_id: str = ""
    _pause_s: float = PAUSE_FIRST_S

    def placed(self) -> None:
        """Record that the placer has the component."""
        self.missing_since_s, self.cause, self.started, self._pause_s = -1.0, "", True, PAUSE_FIRST_S

    def ready(self) -> None:
        """Record that the component answered that it is ready; placer and hub may not know it yet."""
        self.missing_since_s, self.cause = -1.0, ""

    def missing(self, cause: str, now_s: float) -> None:
        """Record that the placer does not have the component.

        Args:
            cause: Its first line names the fault; further lines, the end of a log, are dropped.
            now_s: Mission time.
        """
        self.cause = cause.partition("\n")[0]
        if self.missing_since_s < 0:
            self.missing_since_s = now_s

    def not_started(self, cause: str, now_s: float) -> float:
        """Record a failed start; return the pause before the next start, seconds of the machine."""
        self.missing(cause, now_s)
        pause_s, self._pause_s = self._pause_s, min(2 * self._pause_s, PAUSE_MOST_S)
        return pause_s

    def absence(self) -> Absence | None:
        """Return the absence that its owner reports; None while it is placed."""
        if self.missing_since_s < 0:
            return None
        return Absence(self.name, self.missing_since_s, self.cause, "its owner asks the placer to start it")


async def ask_to_start(
    bus: Bus, clock: Clock, wish: Wish, order: Start, address: str, within_s: float, on_changed: Callable[[], None]
) -> Started:
    """Return the placer's answer; after ``SLOW_START_S`` the component is absent until it is ready or the answer comes.

    Raises:
        Refusal: The placer did not start it.
        LinkError: It is unknown whether the placer did.
    """

    async def report_slow_start() -> None:
        while True:
            await clock.sleep_s(SLOW_START_S * clock.rate)
            if await says_ready(bus, address):
                wish.ready()
            else:
                wish.missing("its start is not confirmed yet", clock.now_s())
            on_changed()

    slow = asyncio.create_task(report_slow_start(), name=f"{wish.name}: slow start")
    try:
        return await bus.ask(PLACER, order, Started, within_s=within_s)
    finally:
        slow.cancel()


async def says_ready(bus: Bus, address: str) -> bool:
    """Return whether the component itself answers that it is ready.

    After a restart of the hub, its token or the placer's answer may be missing although the component works.
    """
    try:
        state = await bus.ask(address, AskState(), ComponentState, within_s=ASK_ITSELF_S)
    except (LinkError, Refusal):
        return False
    return state.state is LifeState.READY


async def keep_placed(
    bus: Bus,
    clock: Clock,
    wish: Wish,
    order: Callable[[], Start],
    address: str,
    on_placed: Callable[[Placement, bool], None] = lambda _placement, _was_there: None,
    on_changed: Callable[[], None] = lambda: None,
    patience_s: float = 0.0,
) -> str:
    """Place the component, and place it again whenever it is missing; return the reason of the order that stops it.

    Args:
        wish: The owner's wish for this component.
        order: Returns the order that starts it, as it is now.
        on_placed: Called after each start, with True if the component ran already.
        on_changed: Called when ``wish.absence()`` may have changed.
        patience_s: Time in which a refused first start is repeated, seconds of the machine, because a host may be
            returning.

    Raises:
        Refusal: The first start was refused, and the owner decides what follows.
    """
    give_up_s = clock.now_s() + patience_s * clock.rate
    component, placer = PeerMonitor(bus, address), PeerMonitor(bus, PLACER)
    try:
        while True:
            try:
                placement, was_there = await _start(bus, clock, wish, order, address, on_changed, give_up_s)
            except StoppedMeanwhile as stopped:
                return stopped.detail
            wish.placed()
            on_placed(placement, was_there)
            on_changed()
            missing = await _wait_missing(bus, clock, wish, component, placer, on_changed)
            if missing.facts.get("stopped"):
                return missing.detail
            wish.missing("it was missing, and the placer did not have it", clock.now_s())
            on_changed()
    finally:
        component.close()
        placer.close()


async def _start(
    bus: Bus,
    clock: Clock,
    wish: Wish,
    ordered: Callable[[], Start],
    address: str,
    on_changed: Callable[[], None],
    give_up_s: float,
) -> tuple[Placement, bool]:
    """Return the placement, and whether the component ran already."""
    while True:
        order = msgspec.structs.replace(ordered(), order_id=wish.order_id)
        try:
            started = await ask_to_start(bus, clock, wish, order, address, START_WITHIN_S, on_changed)
        except NameTaken:
            try:
                return await bus.ask(PLACER, AskPlacement(wish.name), Placement, within_s=REPLY_TIME_S), True
            except NotPlaced as refusal:
                if wish.started and refusal.facts.get("stopped"):  # the order to stop is newer than this wish
                    raise StoppedMeanwhile(refusal.detail) from refusal
                cause = refusal.detail  # its old process is ending
            except (LinkError, Refusal) as error:
                cause = str(error)
        except StoppedMeanwhile:
            raise
        except (LinkError, CreatorSilent) as error:
            cause = str(error)
        except Refusal as refusal:
            if not wish.started and clock.now_s() >= give_up_s:
                raise
            cause = refusal.detail
        else:
            since_s, requester = clock.now_s(), bus.source
            return Placement(wish.name, order.type, started.host, requester, since_s, started.reasons), False
        log.info("%s is not started: %s", wish.name, cause)
        pause_s = wish.not_started(cause, clock.now_s())
        on_changed()
        await clock.sleep_s(pause_s * clock.rate)


async def _wait_missing(
    bus: Bus, clock: Clock, wish: Wish, component: PeerMonitor, placer: PeerMonitor, on_changed: Callable[[], None]
) -> NotPlaced:
    """Return the placer's answer that it lacks the component.

    Meanwhile a component is absent whose token is missing and that does not answer.
    """
    compared_with = placer.times_risen
    while True:
        if component.is_there and wish.absence() is not None:
            wish.ready()
            on_changed()
        away = [] if component.is_there else [component.wait_there()]
        await first_of(
            component.wait_gone(),
            *away,
            placer.wait_risen(max(compared_with, 1) + 1),
            clock.sleep_s(COMPARE_EVERY_S * clock.rate),
        )
        if not component.is_there:
            if await says_ready(bus, component.address):
                wish.ready()
            else:
                wish.missing("it cannot be reached: it is being restarted, or its link is cut", clock.now_s())
            on_changed()
        compared_with = placer.times_risen
        try:
            await bus.ask(PLACER, AskPlacement(wish.name), Placement, within_s=REPLY_TIME_S)
        except NotPlaced as refusal:
            return refusal
        except (LinkError, Refusal) as error:
            log.info("the placer does not answer about %s: %s", wish.name, error)
            away = [peer.wait_there() for peer in (component, placer) if not peer.is_there]
            pause_s = PAUSE_FIRST_S if placer.is_there else PAUSE_MOST_S
            await first_of(*away, clock.sleep_s(pause_s * clock.rate))
            continue
        if not component.is_there:  # its creator or the placer restarts it: compare again after a pause
            await first_of(component.wait_there(), clock.sleep_s(PAUSE_MOST_S * clock.rate))
