"""Reads the outcome of a question over zenoh: a reply, a refusal that is raised again, or no answer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar, cast

from backbone.bus.inbox import reply_reader_of
from backbone.errors import NoResponder, Refusal, ReplyTimeout
from backbone.wire import MalformedMessage, Message, Refused, WrongVersion

Reply = TypeVar("Reply", bound=Message)


class TooLate:
    """No answer came in time."""


class NoInbox:
    """No component got the question, because no component has this inbox any more."""


Came = bytes | type[TooLate] | type[NoInbox] | None
"""The bytes of an answer; None: there is none, because the component is gone or a bug ended its answer."""


class AnsweredByMessage(ABC):
    """A question whose answer is a message, as are its refusal and the news that there is no answer."""

    _is_answered = False

    def answer(self, payload: bytes) -> None:
        """Send the answer."""
        self._is_answered = True
        self.send(payload, is_answer=True)

    def refuse(self, payload: bytes) -> None:
        """Send the refusal of a question that cannot be read."""
        self.answer(payload)

    def drop(self) -> None:
        """Report that there is no answer, unless one was sent."""
        if not self._is_answered:
            self.send(b"", is_answer=False)

    @abstractmethod
    def send(self, payload: bytes, *, is_answer: bool) -> None:
        """Send a message to the asker."""


def read_answer(came: Came, address: str, question: Message, reply: type[Reply], within_s: float) -> Reply:
    """Return the reply to a question.

    Raises:
        Refusal: The component refused.
        NoResponder: The component is gone.
        ReplyTimeout: No answer came in time.
        MalformedMessage: The answer has another class than ``reply``, or comes from another release.
    """
    what = type(question).__name__
    if came is None:
        raise NoResponder(f"no component answered {what} at {address}")
    if not isinstance(came, bytes):
        raise ReplyTimeout(f"{address} did not answer {what} within {within_s:g} s")
    try:
        body = reply_reader_of(reply).read(came).body
    except Refusal as unreadable:
        detail = f"{address} answered {what} with another message: {unreadable.detail}"
        remedy = unreadable.remedy if isinstance(unreadable, WrongVersion) else None
        raise MalformedMessage(detail, remedy=remedy) from unreadable
    if isinstance(body, Refused):
        raise body.revive()
    return cast("Reply", body)
