"""Consent over the bus: consoles ask each other for a robot; the rules are in ``consent``.

This file has both sides, because each console may wait for a robot or hold one.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from backbone.addresses import RC_MANAGER
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, NoResponder, Refusal
from backbone.mission_log.operators import OperatorAction
from backbone.mission_log.people import is_console
from backbone.naming import component_of
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from ui_console.model.consent import (
    CONSENT_WITHIN_S,
    MAX_WHY,
    AskConsent,
    Consent,
    NoOperatorToAsk,
    Settled,
    Topic,
    WithdrawConsent,
    require_console,
)
from ui_console.model.events import ConsentAsked, ConsentHeard, failed
from ui_console.model.order_facts import operator_of
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.observer import AnyObserver

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Claim:
    """The claim of a console that waits.

    Attributes:
        arc: Name of its ARC.
        robot: The requested robot; empty: any.
        called: Name of the robot, for people.
        since_s: Time of the request.
    """

    arc: str
    robot: str
    called: str
    since_s: float


class ConsentTalk:
    """The questions that a console asks, and the questions that it answers.

    Args:
        give_back: Releases this robot for the given reason; returns when that is done.
    """

    def __init__(self, console: AnyObserver, give_back: Callable[[str, str], Awaitable[None]]) -> None:
        self._console, self._give_back = console, give_back
        console.answers.yield_robot = lambda settled: console.start_task(self._yield_to(settled), "consent")
        self._unanswered = 0
        self._open: dict[str, AskConsent] = {}

    def begin_ask(self, claim: Claim | None, why: str = "") -> None:
        """Ask the consoles that hold the robot, and show their answers; if such a question is open, do nothing.

        Args:
            claim: The waiting claim; None: no claim waits.
            why: The reason, for people; empty: how long the console has waited.
        """
        if self._unanswered == 0:
            self._unanswered = 1
            self._console.start_task(self._ask(claim, why), "consent")

    def withdraw(self, got: str = "") -> None:
        """Close the open questions, because this console waits no longer.

        Args:
            got: The robot that it has; the console that had it answers questions for it. Empty: none.
        """
        over = [holder for holder, question in self._open.items() if question.robot != got]
        for holder in over:
            del self._open[holder]
            self._console.start_task(self._withdraw_from(holder), "withdraw consent")

    async def _withdraw_from(self, holder: str) -> None:
        question = WithdrawConsent(self._console.user)
        try:
            await self._console.bus.ask(holder, question, Consent, within_s=REPLY_TIME_S)
        except (Refusal, LinkError) as error:  # the question times out there
            log.info("%s did not close the question: %s", holder, error)

    async def _ask(self, claim: Claim | None, why: str) -> None:
        console = self._console
        now_s = console.clock.now_s
        try:
            holders = await self._who_holds(claim)
        except (Refusal, LinkError) as error:
            self._unanswered = 0
            console.show(failed(now_s(), error))
            return
        assert claim is not None  # noqa: S101  without a claim the question was refused
        self._unanswered = len(holders)
        names = [component_of(holder) for holder in holders]
        why = (why or f"waits since {now_s() - claim.since_s:.0f} s")[:MAX_WHY]
        console.acted(OperatorAction.ASK_CONSENT, claim.called, f"of {', '.join(names)}, {why}")
        console.show(ConsentAsked(now_s(), claim.called, names, now_s() + CONSENT_WITHIN_S * console.clock.rate))
        question = AskConsent(claim.called, console.user, why)
        await asyncio.gather(*(self._ask_one(holder, question) for holder in holders))

    async def _who_holds(self, claim: Claim | None) -> list[str]:
        """Return the addresses of the consoles that hold the robot or directly block the claim, by stick or by order.

        Raises:
            NoOperatorToAsk: No console blocks the claim, or there is no claim.
            LinkError: The RC manager did not answer.
        """
        console = self._console
        if claim is None:
            raise NoOperatorToAsk(f"{console.user} does not wait for a robot", remedy="Take the robot first.")
        schedule = await console.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
        owners = {request.arc: operator_of(request) for request in schedule.requests}
        arcs = {arc for one in schedule.requests if one.arc == claim.arc for arc in one.blockers}
        arcs |= {holder.arc for rc in schedule.rcs if rc.rc == claim.robot for holder in rc.holders}
        blockers = {owners[arc] for arc in arcs - {claim.arc} if arc in owners}
        consoles = sorted(at for at in blockers if is_console(at) and at != console.address)
        if not consoles:
            names = ", ".join(sorted(map(component_of, blockers))) or "no component"
            raise NoOperatorToAsk(f"no operator blocks the claim of {console.user}, but {names}")
        return consoles

    async def _ask_one(self, holder: str, question: AskConsent) -> None:
        console = self._console
        self._open[holder] = question
        try:
            consent = await console.bus.ask(holder, question, Consent, within_s=CONSENT_WITHIN_S + REPLY_TIME_S)
        except NoResponder:  # a console that is gone holds no robot, because its ARC ends with it
            consent = Consent(True, component_of(holder), "is gone")
        except LinkError:
            consent = Consent(False, component_of(holder), "does not answer")
        except Refusal as refusal:
            consent = Consent(False, component_of(holder), refusal.detail)
        self._unanswered -= 1
        is_withdrawn = self._open.pop(holder, None) is None
        if is_withdrawn and not consent.is_given:
            return
        if not consent.is_given:
            because = consent.reason or "no reason given"
            console.publish_event(
                question.robot, f"{consent.user} keeps it from {console.user}: {because}", LogLevel.NOTICE
            )
        now_s = console.clock.now_s()
        console.show(ConsentHeard(now_s, question.robot, consent.user, consent.is_given, consent.reason))

    async def seek(self, asker: str, asked: AskConsent, at_once: Consent | None) -> Consent:
        """Ask the operator of this console for a decision; without an answer in time it is no.

        Args:
            asker: Address of the console that asks.
            at_once: The answer if no decision of the operator is needed.

        Raises:
            NotAnOperator: The asker is not a console.
            Refusal: See ``ConsentDesk.open_question``.
        """
        require_console(self._console.name, asker)
        if at_once is not None:
            return at_once
        return await self._console.answers.seek(asker, asked.user, asked.robot, asked.why, Topic.TAKE)

    async def _yield_to(self, settled: list[Settled]) -> None:
        """Release the robot, then answer, so that the asker finds the robot free."""
        sought = settled[0].sought
        await self._give_back(sought.robot, f"{sought.user} may have it")
        self._console.answers.settle(settled)
