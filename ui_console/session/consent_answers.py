"""The open questions of other operators to one person; the rules are in ``consent``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol

from backbone.bus.interface import Bus, Clock
from backbone.component.peer_monitor import PeerMonitor
from backbone.mission_log.operators import OperatorAction
from backbone.waiting import end_tasks
from ui_console.model.consent import CONSENT_WITHIN_S, Consent, ConsentDesk, Settled, Sought, Topic
from ui_console.model.events import ConsoleEvent

_ACTIONS = {
    (Topic.TAKE, True): OperatorAction.CONSENT,
    (Topic.TAKE, False): OperatorAction.DECLINE,
    (Topic.LIFT, True): OperatorAction.LET_LIFT,
    (Topic.LIFT, False): OperatorAction.KEEP_STOPPED,
}


class Acted(Protocol):
    """Records an action of a person."""

    def __call__(self, action: OperatorAction, subject: str, detail: str = "", user: str = "") -> None:
        """Publish the action to the mission."""


class ConsentAnswers:
    """Shows one person the questions of others, and returns that person's answers.

    Args:
        bus: For the tokens of the consoles that ask.
        user: The person asked.
        show: Called with each event for that person's screens.
        acted: Records the person's decisions.
    """

    def __init__(self, bus: Bus, user: str, clock: Clock, show: Callable[[ConsoleEvent], None], acted: Acted) -> None:
        self._bus, self._user, self._clock, self._show, self._acted = bus, user, clock, show, acted
        self._desk = ConsentDesk(user)
        self._answers: dict[tuple[str, str, Topic], asyncio.Future[Consent]] = {}
        self.yield_robot: Callable[[list[Settled]], object] = self.settle
        """Called with the settled questions if the robot must be released; it calls ``settle`` afterwards."""

    async def seek(self, asker: str, user: str, robot: str, why: str, topic: Topic) -> Consent:
        """Ask the person for a decision; without an answer in time, or if the asker's console is gone, it is no.

        Args:
            asker: Address of the console that asks.
            user: The person at that console.
            why: The reason, for people.
            topic: To get the robot, or to lift its stop.

        Raises:
            Refusal: See ``ConsentDesk.open_question``.
        """
        now_s = self._clock.now_s()
        until_s = now_s + CONSENT_WITHIN_S * self._clock.rate
        sought = self._desk.open_question(Sought(asker, user, robot, why, until_s, topic))
        answer: asyncio.Future[Consent] = asyncio.get_running_loop().create_future()
        self._answers[sought.key] = answer
        self._show(sought)
        watching = asyncio.create_task(self._withdraw_when_gone(sought), name=f"{asker}:watch")
        try:
            async with asyncio.timeout(CONSENT_WITHIN_S):
                return await answer
        except TimeoutError:
            self.settle(self._desk.expire(max(self._clock.now_s(), sought.until_s)))
            return Consent(False, self._user, "no answer")
        finally:
            await end_tasks(watching)

    def decide(self, is_given: bool, reason: str = "", number: int | None = None) -> bool:
        """Answer the first question; a yes for the robot releases it. Return whether there was such a question.

        Args:
            reason: For people.
            number: See ``ConsentDesk.decide``.
        """
        settled = self._desk.decide(is_given, reason, number)
        if not settled:
            return False
        sought = settled[0].sought
        detail = f"asked by {sought.user}{f', {reason}' if reason else ''}"
        self._acted(_ACTIONS[sought.topic, is_given], sought.robot, detail, self._user)
        if is_given and sought.topic is Topic.TAKE:
            self.yield_robot(settled)
        else:
            self.settle(settled)
        return True

    def withdrawn(self, asker: str, user: str, topic: Topic = Topic.TAKE) -> None:
        """Close the question of this person at this console, because no one waits for its answer."""
        self.settle(self._desk.withdrawn(asker, user, topic))

    async def _withdraw_when_gone(self, sought: Sought) -> None:
        monitor = PeerMonitor(self._bus, sought.asker)
        try:
            await monitor.wait_there()
            await monitor.wait_gone()
        finally:
            monitor.close()
        self.withdrawn(*sought.key)

    def ended(self, is_given: bool, reason: str) -> None:
        """Answer all questions for the robot, because this console no longer holds it.

        Args:
            is_given: True: the robot was released; False: another ARC has it now.
            reason: For people.
        """
        self.settle(self._desk.ended(is_given, reason))

    def settle(self, settled: list[Settled]) -> None:
        """Return the answers, and remove the questions from the screens."""
        for one in settled:
            answer = self._answers.pop(one.sought.key, None)
            if answer is not None and not answer.done():
                answer.set_result(one.consent)
            self._show(one)
