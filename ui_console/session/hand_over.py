"""One person at two screens: a robot follows its operator to the screen of the newest claim.

Two claims of one person would otherwise take the robot from each other turn by turn. A console that waits for a robot
that the same person holds at another console settles it with that console; it asks other persons for their consent, see
``consent``. Consoles state the name of their person; a script keeps its robot.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from enum import StrEnum

from backbone.addresses import RC_MANAGER
from backbone.errors import LinkError, Refusal
from backbone.mission_log.people import is_console
from backbone.ranges import Instant, Mention
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import Message
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.observer import AnyObserver


class AskHandOver(Message, frozen=True):
    """A console asks the console that holds a robot to give it up to the same person.

    Attributes:
        robot: The robot.
        user: The person at the asking console.
        since_s: When that person claimed it there.
    """

    robot: Mention
    user: Mention
    since_s: Instant


class ClaimOutcome(StrEnum):
    """Outcome of two claims."""

    GIVEN = "given"  # the robot is free for the asker
    NEWER = "newer"  # the same person claimed it here later: the asker's claim is over
    NOT_YOURS = "not_yours"  # another person, no one, or a script holds it


class HandedOver(Message, frozen=True):
    """Answer to ``AskHandOver``."""

    outcome: ClaimOutcome


def decide(asked: AskHandOver, user: str, robot: str, since_s: float, *, by_script: bool) -> ClaimOutcome:
    """Return the outcome for the asker's claim.

    Args:
        asked: The other console's question.
        user: The person at this console; empty: none.
        robot: The robot held here; empty: none.
        since_s: When it was claimed here.
        by_script: A script drives it.

    Example:
        >>> asked = AskHandOver("scout1", "anna", 5.0)
        >>> decide(asked, "anna", "scout1", 2.0, by_script=False), decide(asked, "ben", "scout1", 2.0, by_script=False)
        (<ClaimOutcome.GIVEN: 'given'>, <ClaimOutcome.NOT_YOURS: 'not_yours'>)
    """
    if not user or asked.user != user or asked.robot != robot or by_script:
        return ClaimOutcome.NOT_YOURS
    return ClaimOutcome.GIVEN if asked.since_s > since_s else ClaimOutcome.NEWER


class HandOver:
    """Messages between the screens of one person.

    Args:
        console: One of them.
        give_back: Gives its robot back, or its claim up, for the reason it is called with.
    """

    def __init__(self, console: AnyObserver, give_back: Callable[[str], Awaitable[None]]) -> None:
        self._console, self._give_back = console, give_back
        self._reason = f"{console.user} goes on at another screen"

    async def settle(self, robot: str, since_s: float) -> None:
        """Ask this person's other screen to give up the robot; give up this claim if the other one is newer.

        Args:
            robot: The robot this console waits for.
            since_s: When it was claimed.

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
            if await self._ask(screen, AskHandOver(robot, console.user, since_s)) is ClaimOutcome.NEWER:
                await self._give_back(self._reason)
                return

    async def answer(self, asked: AskHandOver, robot: str, since_s: float, *, by_script: bool) -> HandedOver:
        """Give the robot back if this console's person goes on at another one; see ``decide``."""
        outcome = decide(asked, self._console.person(), robot, since_s, by_script=by_script)
        if outcome is ClaimOutcome.GIVEN:
            await self._give_back(self._reason)
        return HandedOver(outcome)

    async def _ask(self, holder: str, question: AskHandOver) -> ClaimOutcome:
        try:
            answer = await self._console.bus.ask(holder, question, HandedOver, within_s=REPLY_TIME_S)
        except (Refusal, LinkError):  # a console of another make, or a console that left: the scheduler's rule decides
            return ClaimOutcome.NOT_YOURS
        return answer.outcome
