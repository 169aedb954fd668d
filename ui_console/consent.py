"""May I? Who waits for a robot asks the operator who holds it; nobody has to wait for a turn that is not needed.

Rules of this file: no bus, no clock, no screen; times are mission seconds and arguments.

* An asker has at most one question open here; questions are answered in the order in which they came.
* Each question gets exactly one answer. Without one in time it is a no: the scheduler's rule goes on as before.
* A yes gives the robot back, so it answers only the first question; the others hear who was let have it.
* A robot that is given back anyway is a yes to everybody; one that is lost to somebody else is a no.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from backbone.ranges import Line, Mention
from backbone.wire import Message

CONSENT_WITHIN_S = 8.0  # chosen: to look up from driving, read a line and press a key; a turn is shorter or as long
MOST_OPEN = 8  # chosen: more people than share one robot
MAX_WHY = 200  # chosen: a line a driver reads at a glance


class AskConsent(Message, frozen=True):
    """May I have it? Asked by a console of one that holds what it waits for; answered within ``CONSENT_WITHIN_S``.

    Attributes:
        robot: What it is about, for people.
        user: Who asks.
        why: For people.
    """

    robot: Mention
    user: Mention
    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)]


class Consent(Message, frozen=True):
    """Answer to ``AskConsent``.

    Attributes:
        is_given: True: it is being given back.
        user: Who decided.
        reason: For people; empty: none was said.
    """

    is_given: bool
    user: Mention
    reason: Line


class AskedAlready(Refusal):
    """This asker's question is still open; fact: ``asker``."""

    code = "consent.asked"
    remedy = "Wait for the answer; there is one within seconds."


class TooManyAsk(Refusal):
    """More questions are open than a person can answer."""

    code = "consent.too_many"
    remedy = "Wait for your turn by the scheduler's rule."


class NobodyToAsk(Refusal):
    """No operator stands in the way."""

    code = "consent.nobody"
    remedy = "Ask 'why' for what you wait for; behaviors yield by priority and turns, nobody can be asked for them."


class NotAnOperator(Refusal):
    """Something else than a console asked for a robot."""

    code = "consent.not_an_operator"
    remedy = "Claim the robot; the RC manager decides between programs."


@dataclass(frozen=True, slots=True)
class Sought:
    """A question that is open.

    Attributes:
        asker: Address of the console that asks.
        user: Who sits at it.
        robot: What it is about.
        why: For people.
        until_s: It is a no from then on.
    """

    asker: str
    user: str
    robot: str
    why: str
    until_s: float


@dataclass(frozen=True, slots=True)
class Settled:
    """What became of one question."""

    sought: Sought
    consent: Consent


class ConsentDesk:
    """The questions open at one console.

    Args:
        user: Who sits at it and decides.
    """

    def __init__(self, user: str) -> None:
        self._user = user
        self._open: list[Sought] = []

    @property
    def open(self) -> Sequence[Sought]:
        """All that wait for an answer, the first to be answered first."""
        return tuple(self._open)

    def seek(self, asker: str, asked: AskConsent, now_s: float, within_s: float = CONSENT_WITHIN_S) -> Sought:
        """Open a question.

        Raises:
            AskedAlready: One of this asker is open.
            TooManyAsk: ``MOST_OPEN`` are.
        """
        if any(one.asker == asker for one in self._open):
            raise AskedAlready(f"{asker} has asked already", asker=asker)
        if len(self._open) >= MOST_OPEN:
            raise TooManyAsk(f"{self._user} is being asked by {MOST_OPEN} already")
        sought = Sought(asker, asked.user, asked.robot, asked.why, now_s + within_s)
        self._open.append(sought)
        return sought

    def decide(self, is_given: bool, reason: str = "") -> list[Settled]:
        """Answer the first question, and with a yes all others; return what was settled, none if none was open."""
        if not self._open:
            return []
        first, others = self._open[0], self._open[1:]
        settled = [Settled(first, Consent(is_given, self._user, reason))]
        self._open = [] if is_given else others
        if is_given:
            settled += [Settled(one, Consent(False, self._user, f"{first.user} may have it")) for one in others]
        return settled

    def expire(self, now_s: float) -> list[Settled]:
        """Settle as a no what was open for too long."""
        late = [one for one in self._open if one.until_s <= now_s]
        self._open = [one for one in self._open if one.until_s > now_s]
        return [Settled(one, Consent(False, self._user, "no answer")) for one in late]

    def ended(self, is_given: bool, reason: str) -> list[Settled]:
        """Settle all: nothing is held here any more."""
        settled = [Settled(one, Consent(is_given, self._user, reason)) for one in self._open]
        self._open = []
        return settled
