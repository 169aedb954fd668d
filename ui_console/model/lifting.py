"""Lifting a stop: its authors are asked first.

Rules of this file: no bus, no clock, no screen. The reasons: docs/decisions/0018.

* Stop and lift are separate actions. A lift names the stop on the screen by its number, so a newer stop is never
  lifted.
* An operator's own stop is lifted at once. Each other author of the stop is asked first.
* A single no keeps the stop, and so does a missing answer. An author who has left is not asked; their stop does not
  prevent the lift.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import msgspec

from backbone.naming import component_of
from backbone.ranges import Mention
from backbone.wire import Message
from resource_pool.arc_client import Stopper, StopState
from ui_console.model.consent import MAX_WHY, Consent


class AskLift(Message, frozen=True):
    """Asks a stop's author whether the robot may move again, at the author's console or at all consoles.

    Attributes:
        robot: The robot.
        author: The person who stopped it and who decides.
        console: The console by which the author stopped it.
        user: The person who asks.
        why: The reason, for people.
    """

    robot: Mention
    author: Mention
    console: Mention
    user: Mention
    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)] = ""


@dataclass(frozen=True, slots=True)
class LiftNow:
    """No other person must be asked."""


@dataclass(frozen=True, slots=True)
class AskFirst:
    """These authors decide; the stop is lifted if each of them says yes or has left."""

    authors: tuple[Stopper, ...]


@dataclass(frozen=True, slots=True)
class NotThatStop:
    """The stop on the screen is not the one in force; no stop is lifted."""

    line: str


LiftDecision = LiftNow | AskFirst | NotThatStop


def decide_lift(stop: StopState, number: int, user: str, console: str) -> LiftDecision:
    """Return how this stop is lifted.

    Args:
        stop: State of the robot's stop, as its RC reports.
        number: Number of the stop on the screen.
        user: The person who wants to lift it.
        console: Address of the console they sit at.
    """
    if not stop.is_stopped:
        return NotThatStop(f"{stop.rc} is not stopped any more")
    if number != stop.number:
        who = ", ".join(author_name(author) for author in authors(stop))
        return NotThatStop(f"{stop.rc} was stopped again since, by {who}: look at that stop first")
    others = tuple(author for author in authors(stop) if not _is(author, user, console) and author.console)
    return AskFirst(others) if others else LiftNow()


def answer_of(author: Stopper, answers: Iterable[Consent]) -> Consent:
    """Return an author's answer from several consoles: one yes is a yes; an author at no console has left."""
    here = [answer for answer in answers if answer.is_here]
    left = Consent(True, author_name(author), "is not here any more", False)
    return next((answer for answer in here if answer.is_given), here[0] if here else left)


def is_agreed(answers: Iterable[Consent]) -> bool:
    """Return whether the stop is lifted after these answers of all asked authors."""
    return all(answer.is_given for answer in answers)


def authors(stop: StopState) -> tuple[Stopper, ...]:
    """Return all authors of stops since the robot last moved, the first of them first."""
    return Stopper(stop.by, stop.console), *stop.also


def author_name(author: Stopper) -> str:
    """Return the author's name, for people; for a console without a person, the console's name."""
    return component_of(author.by) if "/" in author.by else author.by


def is_own(stop: StopState, user: str, console: str) -> bool:
    """Return whether this operator alone stopped the robot."""
    return all(_is(author, user, console) for author in authors(stop))


def lift_line(stop: StopState, user: str, console: str, is_there: Callable[[Stopper], bool]) -> str:
    """Return in one line for people how the stop is lifted.

    Args:
        stop: The stop in force.
        user: The person who may want to lift it.
        console: Address of the console they sit at.
        is_there: Returns whether this author is present, as far as known.
    """
    match decide_lift(stop, stop.number, user, console):
        case AskFirst(others) if names := _names(author for author in others if is_there(author)):
            return f"asks {_joined(names)} first"
        case AskFirst(others):
            names = _names(others)
            return f"{_joined(names)} {'is' if len(names) == 1 else 'are'} not here any more"
        case _:
            return "hold to lift"


def question_line(user: str, robot: str, why: str) -> str:
    """Return the question to an author, in one sentence.

    Example:
        >>> question_line("ben", "scout1", "")
        'ben asks whether scout1, which you stopped, may move again'
    """
    return f"{user} asks whether {robot}, which you stopped, may move again{f': {why}' if why else ''}"


def _is(author: Stopper, user: str, console: str) -> bool:
    return author.by in (user, console)


def _names(of: Iterable[Stopper]) -> list[str]:
    return list(dict.fromkeys(author_name(author) for author in of))


def _joined(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
