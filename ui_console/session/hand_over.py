"""One person at two screens: a robot follows them to the screen at which they asked for it last.

Two claims of one person would otherwise take the robot from each other turn by turn. A console that waits for a robot
that the same person holds at another console settles it with that console; others are asked for their consent, see
``consent``. Who a person is is what consoles say; a script keeps what it drives.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from enum import StrEnum
from typing import Any

from backbone.addresses import RC_MANAGER
from backbone.errors import LinkError, Refusal
from backbone.mission_log.people import is_console
from backbone.ranges import Instant, Mention
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import Message
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.observer import Observer


class AskHandOver(Message, frozen=True):
    """I want the robot here now. Asked by a console of the console that holds it.

    Attributes:
        robot: Which.
        user: Who sits at the asker.
        since_s: When they asked for it there.
    """

    robot: Mention
    user: Mention
    since_s: Instant


class Outcome(StrEnum):
    """What becomes of two claims."""

    GIVEN = "given"  # it is free for the asker
    NEWER = "newer"  # the same person asked for it here later: the asker's claim is over
    NOT_YOURS = "not_yours"  # somebody else holds it, or nobody, or a script


class HandedOver(Message, frozen=True):
    """Answer to ``AskHandOver``."""

    outcome: Outcome


def decide(asked: AskHandOver, user: str, robot: str, since_s: float, *, by_script: bool) -> Outcome:
    """Return what becomes of the asker's claim.

    Args:
        asked: What the other console wants.
        user: Who sits here; empty: nobody in person.
        robot: What is held here; empty: nothing.
        since_s: When it was asked for here.
        by_script: A script drives it.

    Example:
        >>> asked = AskHandOver("scout1", "anna", 5.0)
        >>> decide(asked, "anna", "scout1", 2.0, by_script=False), decide(asked, "ben", "scout1", 2.0, by_script=False)
        (<Outcome.GIVEN: 'given'>, <Outcome.NOT_YOURS: 'not_yours'>)
    """
    if not user or asked.user != user or asked.robot != robot or by_script:
        return Outcome.NOT_YOURS
    return Outcome.GIVEN if asked.since_s > since_s else Outcome.NEWER


class HandOver:
    """The talk between the screens of one person.

    Args:
        console: One of them.
        give_back: Gives its robot back, or its claim up, for the reason it is called with.
    """

    def __init__(self, console: Observer[Any], give_back: Callable[[str], Awaitable[None]]) -> None:
        self._console, self._give_back = console, give_back
        self._reason = f"{console.user} goes on at another screen"

    async def settle(self, robot: str, since_s: float) -> None:
        """Have this person's other screen give up the robot, or give the claim for it up if that one is newer.

        Args:
            robot: What is waited for here.
            since_s: When it was asked for.

        Raises:
            LinkError: The RC manager did not answer.
        """
        console = self._console
        if not console.person() or not robot:
            return
        schedule = await console.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
        arcs = {holder.arc for rc in schedule.rcs if rc.rc == robot for holder in rc.holders}
        owners = {request.owner for request in schedule.requests if request.arc in arcs}
        for screen in sorted(owner for owner in owners if is_console(owner) and owner != console.address):
            if await self._ask(screen, AskHandOver(robot, console.user, since_s)) is Outcome.NEWER:
                await self._give_back(self._reason)
                return

    async def answer(self, asked: AskHandOver, robot: str, since_s: float, *, by_script: bool) -> HandedOver:
        """Give the robot back if the person who sits here goes on elsewhere; see ``decide``."""
        outcome = decide(asked, self._console.person(), robot, since_s, by_script=by_script)
        if outcome is Outcome.GIVEN:
            await self._give_back(self._reason)
        return HandedOver(outcome)

    async def _ask(self, holder: str, question: AskHandOver) -> Outcome:
        try:
            answer = await self._console.bus.ask(holder, question, HandedOver, within_s=REPLY_TIME_S)
        except (Refusal, LinkError):  # a console of another make, or one that is gone: the scheduler's rule decides
            return Outcome.NOT_YOURS
        return answer.outcome
