"""The questions that one person is asked by others, until each is answered; the rules are in ``consent``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol

from backbone.bus.interface import Clock
from backbone.mission_log.operators import OperatorAction
from ui_console.model.consent import CONSENT_WITHIN_S, Consent, ConsentDesk, Settled, Sought, Topic
from ui_console.model.events import ConsoleEvent

_ACTIONS = {
    (Topic.TAKE, True): OperatorAction.CONSENT,
    (Topic.TAKE, False): OperatorAction.DECLINE,
    (Topic.LIFT, True): OperatorAction.LET_LIFT,
    (Topic.LIFT, False): OperatorAction.KEEP_STOPPED,
}


class Acted(Protocol):
    """Keeps that a person did something."""

    def __call__(self, action: OperatorAction, subject: str, detail: str = "", user: str = "") -> None:
        """Let the mission know."""


class ConsentAnswers:
    """Shows one person what others ask, and hands their answers back.

    Args:
        user: Who is asked.
        clock: The mission's time.
        show: Called with what that person's screens are to show.
        acted: Keeps what they decided.
    """

    def __init__(self, user: str, clock: Clock, show: Callable[[ConsoleEvent], None], acted: Acted) -> None:
        self._user, self._clock, self._show, self._acted = user, clock, show, acted
        self._desk = ConsentDesk(user)
        self._answers: dict[tuple[str, Topic], asyncio.Future[Consent]] = {}
        self.yield_robot: Callable[[list[Settled]], None] = self.settle
        """Called with what was settled when the robot that is held here is let go; calls ``settle`` when it is."""

    async def seek(self, asker: str, user: str, robot: str, why: str, topic: Topic) -> Consent:
        """Have the person decide; silence is a no.

        Args:
            asker: Address of the console that asks.
            user: Who sits there.
            robot: What it is about.
            why: For people.
            topic: What is asked for.

        Raises:
            Refusal: See ``ConsentDesk.open_question``.
        """
        now_s = self._clock.now_s()
        until_s = now_s + CONSENT_WITHIN_S * self._clock.rate
        sought = self._desk.open_question(Sought(asker, user, robot, why, until_s, topic))
        answer: asyncio.Future[Consent] = asyncio.get_running_loop().create_future()
        self._answers[asker, topic] = answer
        self._show(sought)
        try:
            async with asyncio.timeout(CONSENT_WITHIN_S):
                return await answer
        except TimeoutError:
            self.settle(self._desk.expire(max(self._clock.now_s(), sought.until_s)))
            return Consent(False, self._user, "no answer")

    def decide(self, is_given: bool, reason: str = "") -> None:
        """Answer the first question; with a yes for the robot it is given back."""
        settled = self._desk.decide(is_given, reason)
        if not settled:
            return
        sought = settled[0].sought
        detail = f"asked by {sought.user}{f', {reason}' if reason else ''}"
        self._acted(_ACTIONS[sought.topic, is_given], sought.robot, detail, self._user)
        if is_given and sought.topic is Topic.TAKE:
            self.yield_robot(settled)
        else:
            self.settle(settled)

    def ended(self, is_given: bool, reason: str) -> None:
        """Answer all who want the robot: nothing is held any more.

        Args:
            is_given: True: it was given back; False: somebody else has it now.
            reason: For people.
        """
        self.settle(self._desk.ended(is_given, reason))

    def settle(self, settled: list[Settled]) -> None:
        """Hand the answers back, and take the questions from the screens."""
        for one in settled:
            answer = self._answers.pop((one.sought.asker, one.sought.topic), None)
            if answer is not None and not answer.done():
                answer.set_result(one.consent)
            self._show(one)
