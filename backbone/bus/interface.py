"""Bus and Clock: all that a component knows of the world between components.

Three implementations of ``Bus`` pass one conformance suite: ``zenoh_bus`` between processes,
``local_bus`` inside one, and ``shared_bus`` where several components share a process among others.
Which of them a component got is never visible to it.

Words: a *question* is asked of one address and answered by exactly one reply or refusal; a
*publication* goes to whoever subscribed; a *liveliness token* stands as long as its component lives.
"""

from __future__ import annotations

import types
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

from backbone.keys import Conversation
from backbone.ranges import Count
from backbone.wire import Envelope, Message

Reply = TypeVar("Reply", bound=Message)
Accepted = type[Any] | types.UnionType
Answer = Callable[[Envelope[Any]], Awaitable[Message]]
Listener = Callable[[Envelope[Any]], None]
LifeListener = Callable[[str, bool], None]
LinkListener = Callable[[bool], None]

current_cause: ContextVar[str] = ContextVar("current_cause", default="")
"""Id of the message being handled; what is said meanwhile, also by tasks begun meanwhile, names it as its cause."""


class Subscription(Protocol):
    """Something declared on the bus that can be taken back."""

    def close(self) -> None:
        """Take it back; what already arrived may still be handed over. Closing twice is allowed."""


class Clock(Protocol):
    """The mission's time. ``rate`` mission seconds pass in one second of the machine."""

    @property
    def rate(self) -> float:
        """Mission seconds per second of the machine; 1 on real robots."""

    def now_s(self) -> float:
        """Return the mission time in seconds since the mission's start."""

    async def sleep_s(self, duration_s: float) -> None:
        """Return after this many mission seconds; at least yields once."""

    async def sleep_until_s(self, at_s: float) -> None:
        """Return at this mission time, at once if it has passed."""


class Bus(Protocol):
    """How components talk.

    Addresses and missions that cannot be part of a key are refused with ``IllegalName``. On a closed bus
    asking ends with ``NoResponder``, publishing does nothing, and declaring anything is a bug.
    """

    @property
    def mission(self) -> str:
        """Name of the mission all keys of this bus belong to."""

    @property
    def source(self) -> str:
        """Address of the component that speaks on this bus."""

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer.

        Args:
            address: ``<subsystem>/<component>``.
            question: The message.
            reply: Class the answer must have.
            within_s: Seconds of the machine (not mission time: a link does not speed up with the clock).

        Raises:
            Refusal: It understood and said no, as the class it raised there.
            NoResponder: Nobody is there, or it died before it answered. The outcome is unknown.
            ReplyTimeout: No answer in time. The outcome is unknown.
            MalformedMessage: The answer is none of class ``reply``. The outcome is unknown.
        """

    def serve(self, address: str, accepts: Accepted, answer: Answer) -> Subscription:
        """Answer questions asked of this address until closed.

        ``answer`` runs as a task of its own for each question; a ``Refusal`` it raises travels back.
        Unreadable questions are refused without calling it. Any other exception is a bug: it is
        handed to ``on_bug`` and the asker sees ``NoResponder``.
        """

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Hand the message to whoever subscribed now. Never waits, never fails for lack of listeners."""

    def subscribe(
        self, address: str, conversation: Conversation, accepts: Accepted, listener: Listener, *, latest: bool = False
    ) -> Subscription:
        """Call the listener, in the event loop, with each publication under this address (``*`` matches a segment).

        Args:
            latest: Keep only the newest undelivered publication of each address (pictures, states); else all, in
                the order in which each source said them.
        """

    def declare_alive(self, address: str) -> Subscription:
        """Raise this component's liveliness token. Declared last, it means ready."""

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Call ``listener(address, alive)`` for each token that stands now and for every change later.

        A token falls when its process dies, closes it, or when the link to it is cut; ``watch_link``
        tells the last case from the others.
        """

    def watch_link(self, listener: LinkListener) -> Subscription:
        """Call ``listener(up)`` when this process loses or regains its own link to the hub."""

    @property
    def on_bug(self) -> Callable[[BaseException], None]:
        """Who is told of an exception that is no refusal; settable."""

    @on_bug.setter
    def on_bug(self, tell: Callable[[BaseException], None]) -> None: ...

    def statistics(self) -> BusStatistics:
        """Return what passed since the bus was opened."""

    async def close(self) -> None:
        """Take back everything declared and leave; return when that is done, however often called.

        Questions still open, asked here or being answered here, end with ``NoResponder`` for their askers.
        """


class BusStatistics(Message, frozen=True):
    """Counters of one bus since it was opened.

    Attributes:
        asked: Questions sent.
        answered: Questions answered, refusals included.
        published: Publications sent.
        heard: Publications handed to listeners.
        refused: Answers that were refusals.
        unreadable: Messages that could not be read, in either direction.
    """

    asked: Count
    answered: Count
    published: Count
    heard: Count
    refused: Count
    unreadable: Count
