"""Consent: one operator asks another to release a robot, or to lift a stop.

Rules of this file: no bus, no clock, no screen; times are mission seconds and arguments.

* A person at a console has at most one open question of each topic here; questions are answered in order of arrival.
  Several people ask by one console if that console serves their pages.
* A person answers the question on the screen, by its number: an answer that comes late never answers the next question.
* Each question gets exactly one answer. If a question times out, the answer is no, and nothing changes.
* A yes that releases the robot answers only the first question for it; the other askers get the name of the first
  asker.
* If the operator releases the robot, every question for it is answered yes; if another ARC gets it, no.
* If the asker no longer waits, or its console is gone, the question is closed: a yes would release the robot in vain.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from backbone.mission_log.people import is_console
from backbone.ranges import Line, Mention
from backbone.wire import Message

CONSENT_WITHIN_S = 8.0  # chosen: time to look up from driving, read a line and press a key; a turn takes no longer
MOST_OPEN = 8  # chosen: more people than share one robot
MAX_WHY = 200  # chosen: a line that a driver reads at a glance


class Topic(StrEnum):
    """Subject of a question to another operator."""

    TAKE = "take"  # to get the robot
    LIFT = "lift"  # to let the robot move again


class AskConsent(Message, frozen=True):
    """Question to the console that holds the robot for which the sender waits; answered within ``CONSENT_WITHIN_S``.

    Attributes:
        robot: The robot asked for, for people.
        user: The person who asks.
        why: The reason, for people.
    """

    robot: Mention
    user: Mention
    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)]


class WithdrawConsent(Message, frozen=True):
    """Close the question of the sender for a robot, because its operator no longer waits; answered by a ``Consent``.

    Attributes:
        user: The person who asked.
    """

    user: Mention


class Consent(Message, frozen=True):
    """Answer to ``AskConsent``.

    Attributes:
        is_given: True: the robot is being released, or may move.
        user: The person who decided.
        reason: For people; empty: none was given.
        is_here: False: the operator is absent, so no person decided.
    """

    is_given: bool
    user: Mention
    reason: Line
    is_here: bool = True


class AskedAlready(Refusal):
    """This person's question is still open; fact: ``asker``."""

    code = "consent.asked"
    remedy = "Wait for the answer; there is one within seconds."


class TooManyAsk(Refusal):
    """More questions are open than a person can answer."""

    code = "consent.too_many"
    remedy = "Wait for your turn by the scheduler's rule."


class NoOperatorToAsk(Refusal):
    """No operator holds the robot that this console waits for."""

    code = "consent.nobody"
    remedy = "Ask 'why' for the robot you wait for; behaviors yield by priority and turns, not on request."


class NotAnOperator(Refusal):
    """A component that is not a console asked an operator."""

    code = "consent.not_an_operator"
    remedy = "Claim the robot; the RC manager decides between programs."


def require_console(asked: str, asker: str) -> None:
    """Check that the question comes from a console.

    Raises:
        NotAnOperator: The asker is not a console.
    """
    if not is_console(asker):
        raise NotAnOperator(f"{asked} is asked by operators only, not by {asker}")


@dataclass(frozen=True, slots=True)
class Sought:
    """An open question.

    Attributes:
        asker: Address of the console that asks.
        user: The person at that console.
        why: The reason, for people.
        until_s: Mission time at which the question times out; the answer is then no.
        topic: To have the robot, or to lift its stop.
        number: Number of the question at the desk, from 1; 0: it is not open yet.
    """

    asker: str
    user: str
    robot: str
    why: str
    until_s: float
    topic: Topic = Topic.TAKE
    number: int = 0

    @property
    def key(self) -> tuple[str, str, Topic]:
        """Console, person and topic, which no other open question has."""
        return self.asker, self.user, self.topic


@dataclass(frozen=True, slots=True)
class Settled:
    """A question with its answer."""

    sought: Sought
    consent: Consent


class ConsentDesk:
    """The questions open at one console.

    Args:
        user: The person at this console, who decides.
    """

    def __init__(self, user: str) -> None:
        self._user = user
        self._open: list[Sought] = []
        self._numbers = itertools.count(1)

    @property
    def open(self) -> Sequence[Sought]:
        """The open questions, the next one first."""
        return tuple(self._open)

    def open_question(self, sought: Sought) -> Sought:
        """Open a question, and return it with its number.

        Raises:
            AskedAlready: A question of this person at this console on this topic is open.
            TooManyAsk: ``MOST_OPEN`` questions are open.
        """
        if any(one.key == sought.key for one in self._open):
            raise AskedAlready(f"{sought.user} has asked already", asker=sought.asker)
        if len(self._open) >= MOST_OPEN:
            raise TooManyAsk(f"{self._user} is being asked by {MOST_OPEN} already")
        opened = replace(sought, number=next(self._numbers))
        self._open.append(opened)
        return opened

    def decide(self, is_given: bool, reason: str = "", number: int | None = None) -> list[Settled]:
        """Answer the first question; a yes for the robot settles all others for it, too. Return all settled ones.

        Args:
            reason: For people.
            number: The question on the person's screen; if it is not the first one, none is answered. None: the first.
        """
        if not self._open or number not in (None, self._open[0].number):
            return []
        first, others = self._open[0], self._open[1:]
        settled = [Settled(first, Consent(is_given, self._user, reason))]
        self._open = others
        if is_given and first.topic is Topic.TAKE:
            settled += self._close_takes(Consent(False, self._user, f"{first.user} may have it"))
        return settled

    def expire(self, now_s: float) -> list[Settled]:
        """Settle every timed-out question with no."""
        late = [one for one in self._open if one.until_s <= now_s]
        self._open = [one for one in self._open if one.until_s > now_s]
        return [Settled(one, Consent(False, self._user, "no answer")) for one in late]

    def ended(self, is_given: bool, reason: str) -> list[Settled]:
        """Settle all questions for the robot, because this console no longer holds it."""
        return self._close_takes(Consent(is_given, self._user, reason))

    def withdrawn(self, asker: str, user: str, topic: Topic) -> list[Settled]:
        """Settle the question of this person at this console with no, because no one waits for the answer."""
        over = [one for one in self._open if one.key == (asker, user, topic)]
        self._open = [one for one in self._open if one not in over]
        return [Settled(one, Consent(False, self._user, "withdrawn")) for one in over]

    def _close_takes(self, consent: Consent) -> list[Settled]:
        settled = [Settled(one, consent) for one in self._open if one.topic is Topic.TAKE]
        self._open = [one for one in self._open if one.topic is not Topic.TAKE]
        return settled
