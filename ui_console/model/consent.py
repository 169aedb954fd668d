"""Consent: one operator asks another for the robot they hold, or to lift the stop they set.

Rules of this file: no bus, no clock, no screen; times are mission seconds and arguments.

* An asker has at most one question of a topic open here; questions are answered in the order in which they came.
* Each question gets exactly one answer. A question that times out is answered no: everything goes on as before.
* A yes that gives the robot back answers only the first question for it; the other askers get the name of its user.
* If the operator releases the robot, every question for it is answered yes; if another ARC gets it, no.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from backbone.mission_log.people import is_console
from backbone.ranges import Line, Mention
from backbone.wire import Message

CONSENT_WITHIN_S = 8.0  # chosen: to look up from driving, read a line and press a key; a turn is shorter or as long
MOST_OPEN = 8  # chosen: more people than share one robot
MAX_WHY = 200  # chosen: a line a driver reads at a glance


class Topic(StrEnum):
    """Subject of a question to another operator."""

    TAKE = "take"  # to have the robot
    LIFT = "lift"  # to let it move again


class AskConsent(Message, frozen=True):
    """A console asks the console that holds the robot it waits for; answered within ``CONSENT_WITHIN_S``.

    Attributes:
        robot: The robot asked for, for people.
        user: The person who asks.
        why: The reason, for people.
    """

    robot: Mention
    user: Mention
    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)]


class Consent(Message, frozen=True):
    """Answer to ``AskConsent``.

    Attributes:
        is_given: True: the robot is being given back, or may move.
        user: The person who decided.
        reason: For people; empty: none was given.
        is_here: False: the person asked is not there, so no person decided.
    """

    is_given: bool
    user: Mention
    reason: Line
    is_here: bool = True


class AskedAlready(Refusal):
    """This asker's question is still open; fact: ``asker``."""

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
    """A component that is no console asked a person."""

    code = "consent.not_an_operator"
    remedy = "Claim the robot; the RC manager decides between programs."


def require_console(asked: str, asker: str) -> None:
    """Return if an operator asks.

    Raises:
        NotAnOperator: The asker is no console.
    """
    if not is_console(asker):
        raise NotAnOperator(f"{asked} is asked by operators only, not by {asker}")


@dataclass(frozen=True, slots=True)
class Sought:
    """A question that is open.

    Attributes:
        asker: Address of the console that asks.
        user: The person at that console.
        robot: The robot asked for.
        why: The reason, for people.
        until_s: The question times out then, which is a no.
        topic: To have the robot, or to lift its stop.
    """

    asker: str
    user: str
    robot: str
    why: str
    until_s: float
    topic: Topic = Topic.TAKE


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

    @property
    def open(self) -> Sequence[Sought]:
        """The questions that wait for an answer, the next one first."""
        return tuple(self._open)

    def seek(self, asker: str, asked: AskConsent, now_s: float, within_s: float = CONSENT_WITHIN_S) -> Sought:
        """Open a question for the robot that is held here; see ``open_question``."""
        return self.open_question(Sought(asker, asked.user, asked.robot, asked.why, now_s + within_s))

    def open_question(self, sought: Sought) -> Sought:
        """Open a question.

        Raises:
            AskedAlready: One of this asker on this topic is open.
            TooManyAsk: ``MOST_OPEN`` are.
        """
        if any((one.asker, one.topic) == (sought.asker, sought.topic) for one in self._open):
            raise AskedAlready(f"{sought.asker} has asked already", asker=sought.asker)
        if len(self._open) >= MOST_OPEN:
            raise TooManyAsk(f"{self._user} is being asked by {MOST_OPEN} already")
        self._open.append(sought)
        return sought

    def decide(self, is_given: bool, reason: str = "") -> list[Settled]:
        """Answer the first question; a yes for the robot also settles all others for it; return the settled ones."""
        if not self._open:
            return []
        first, others = self._open[0], self._open[1:]
        settled = [Settled(first, Consent(is_given, self._user, reason))]
        self._open = others
        if is_given and first.topic is Topic.TAKE:
            settled += self._close_takes(Consent(False, self._user, f"{first.user} may have it"))
        return settled

    def expire(self, now_s: float) -> list[Settled]:
        """Settle as a no every question that timed out."""
        late = [one for one in self._open if one.until_s <= now_s]
        self._open = [one for one in self._open if one.until_s > now_s]
        return [Settled(one, Consent(False, self._user, "no answer")) for one in late]

    def ended(self, is_given: bool, reason: str) -> list[Settled]:
        """Settle all questions for the robot: this console holds none any more."""
        return self._close_takes(Consent(is_given, self._user, reason))

    def _close_takes(self, consent: Consent) -> list[Settled]:
        settled = [Settled(one, consent) for one in self._open if one.topic is Topic.TAKE]
        self._open = [one for one in self._open if one.topic is not Topic.TAKE]
        return settled
