"""Hand-over between two screens of one person: the robot goes to the screen of the newest claim.

Otherwise two claims of one person would get the robot in turns. If a console waits for a robot that the same person
holds at another console, the two consoles settle that; other persons are asked for their consent, see ``consent``.
Consoles state the name of their person. A script keeps its robot.
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
from ui_console.model.order_facts import operator_of
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.observer import AnyObserver


class AskHandOver(Message, frozen=True):
    """Asks the console that holds a robot to release it for the same person at another console.

    Attributes:
        robot: The robot.
        user: The person at the asking console.
        since_s: Time of that person's claim there.
    """

    robot: Mention
    user: Mention
    since_s: Instant


class ClaimOutcome(StrEnum):
    """Outcome of two claims."""

    GIVEN = "given"  # the robot is free for the asker
    NEWER = "newer"  # the same person claimed it here later, so the asker's claim ends
    NOT_YOURS = "not_yours"  # another person, no person, or a script holds it


class HandedOver(Message, frozen=True):
    """Answer to ``AskHandOver``."""

    outcome: ClaimOutcome


def decide(asked: AskHandOver, user: str, robot: str, since_s: float, *, by_script: bool) -> ClaimOutcome:
    """Return the outcome for the asker's claim.

    Args:
        asked: The other console's question.
        user: The person at this console; empty: none.
        robot: The robot held here; empty: none.
        since_s: Time of the claim here.

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
        console: One of the screens.
        give_back: Releases this robot, or the claim for it, for the given reason.
    """

    def __init__(self, console: AnyObserver, give_back: Callable[[str, str], Awaitable[None]]) -> None:
        self._console, self._give_back = console, give_back
        self._reason = f"{console.user} goes on at another screen"

    async def settle(self, robot: str, since_s: float) -> None:
        """Ask this person's other screen to release the robot; if its claim is newer, give up this claim.

        Args:
            robot: The robot this console waits for.
            since_s: Time of the claim.

        Raises:
            LinkError: The RC manager did not answer.
        """
        console = self._console
        if not console.person() or not robot:
            return
        schedule = await console.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
        arcs = {holder.arc for rc in schedule.rcs if rc.rc == robot for holder in rc.holders}
        owners = {operator_of(request) for request in schedule.requests if request.arc in arcs}
        for screen in sorted(owner for owner in owners if is_console(owner) and owner != console.address):
            if await self._ask(screen, AskHandOver(robot, console.user, since_s)) is ClaimOutcome.NEWER:
                await self._give_back(robot, self._reason)
                return

    async def answer(self, asked: AskHandOver, robot: str, since_s: float, by_script: bool) -> HandedOver:
        """Release the robot held here if its person continues at another console; see ``decide``."""
        outcome = decide(asked, self._console.person(), robot, since_s, by_script=by_script)
        if outcome is ClaimOutcome.GIVEN:
            await self._give_back(robot, self._reason)
        return HandedOver(outcome)

    async def _ask(self, holder: str, question: AskHandOver) -> ClaimOutcome:
        try:
            answer = await self._console.bus.ask(holder, question, HandedOver, within_s=REPLY_TIME_S)
        except (Refusal, LinkError):  # a console of another make, or a console that left: the scheduler's rule decides
            return ClaimOutcome.NOT_YOURS
        return answer.outcome
