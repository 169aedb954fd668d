"""Lifting a stop over the bus: if the rules in ``lifting`` require it, its authors are asked first."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol, assert_never

from backbone.component.component_of_parts import ComponentOfParts
from backbone.errors import LinkError, NoResponder, Refusal
from backbone.mission_log.operators import OperatorAction
from resource_pool.arc_client import OtherStop, Stopper, StopState
from ui_console.model.consent import CONSENT_WITHIN_S, Consent, Topic
from ui_console.model.events import CommandRefused, ConsentAsked, ConsentHeard, ConsoleEvent
from ui_console.model.lifting import (
    AskFirst,
    AskLift,
    LiftNow,
    NotThatStop,
    answer_of,
    author_name,
    decide_lift,
    is_agreed,
)
from ui_console.session.feed import ConsoleFeed

ANSWER_TIME_S = CONSENT_WITHIN_S + 1.0  # chosen: longer than the time-out at the asked console
LOOK_AGAIN = "Look who stopped the robot and why, then lift that stop if it may move."


class Speaks(ComponentOfParts, Protocol):
    """The interface of the console through which a stop is lifted.

    Attributes:
        feed: Knows robots and consoles.
    """

    feed: ConsoleFeed

    def acted(self, action: OperatorAction, subject: str, detail: str = "", user: str = "") -> None:
        """Publish the operator's action."""


class LiftTalk:
    """Lifts stops for one person, and shows that person the other authors' answers.

    Args:
        console: The person's console.
        show: Called with each event for that person's screens.
    """

    def __init__(self, console: Speaks, user: str, show: Callable[[ConsoleEvent], None]) -> None:
        self._console, self._user, self._show = console, user, show

    async def lift(self, robot: str, number: int) -> bool:
        """Lift the stop if every other author agrees; return whether the robot may move.

        Args:
            number: Number of the stop on the screen.
        """
        stop = await self._console.feed.ask_stop(robot)
        if stop is None:
            return False
        match decide_lift(stop, number, self._user, self._console.address):
            case NotThatStop(line):
                self._show(CommandRefused(self._console.clock.now_s(), OtherStop.code, line, LOOK_AGAIN))
                return False
            case AskFirst(others) if not await self._ask(stop, others):
                return False
            case AskFirst() | LiftNow():
                detail = f"stop {stop.number} by {stop.by}"
                self._console.acted(OperatorAction.LIFT_STOP, robot, detail, self._user)
                return await self._console.feed.lift(stop, self._user)
            case decision:
                assert_never(decision)

    async def _ask(self, stop: StopState, others: tuple[Stopper, ...]) -> bool:
        console, robot = self._console, stop.rc
        names, now_s = [author_name(one) for one in others], console.clock.now_s()
        console.acted(OperatorAction.ASK_LIFT, robot, f"of {', '.join(names)}", self._user)
        self._show(ConsentAsked(now_s, robot, names, now_s + CONSENT_WITHIN_S * console.clock.rate, Topic.LIFT))
        answers = await asyncio.gather(*(self._ask_one(robot, author) for author in others))
        return is_agreed(answers)

    async def _ask_one(self, robot: str, author: Stopper) -> Consent:
        """Ask an author at the console that stopped the robot, or else at the author's present consoles."""
        question = AskLift(robot, author.by, author.console, self._user)
        answers = [await self._ask_at(author.console, question)]
        if not answers[0].is_here:
            consoles = await self._console.feed.consoles()
            if consoles is None:
                answers.append(Consent(False, author.by, "may be at another console; the nameserver does not answer"))
            others = [at for at in consoles or [] if at != author.console]
            answers += await asyncio.gather(*(self._ask_at(at, question) for at in others))
        consent, now_s = answer_of(author, answers), self._console.clock.now_s()
        self._show(ConsentHeard(now_s, robot, author_name(author), consent.is_given, consent.reason, Topic.LIFT))
        return consent

    async def _ask_at(self, console: str, question: AskLift) -> Consent:
        try:
            return await self._console.bus.ask(console, question, Consent, within_s=ANSWER_TIME_S)
        except NoResponder:
            return Consent(False, question.author, "is not here", is_here=False)
        except LinkError:  # the author may use this console
            return Consent(False, question.author, "does not answer", is_here=console == question.console)
        except Refusal as refusal:
            return Consent(False, question.author, refusal.detail, is_here=console == question.console)
