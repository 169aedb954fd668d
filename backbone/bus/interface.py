"""Bus and Clock: a component's interfaces to other components and to the mission's time.

Three implementations of ``Bus`` pass one conformance suite: ``zenoh_bus`` between processes,
``local_bus`` inside one, and ``shared_bus`` for the members of a shared process. A component cannot see which of them
it uses.

Words: a *question* goes to one address and gets exactly one reply or refusal; a *publication* goes to all subscribers;
a *liveliness token* exists while its component lives.
"""

from __future__ import annotations

import types
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from typing import Annotated, Any, Protocol, TypeVar, overload

from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.quality import Quality
from backbone.ranges import FEW, Count, Mention, Quoted
from backbone.wire import Accepts, Envelope, Message

Reply = TypeVar("Reply", bound=Message)
Answer = Callable[[Envelope[Message]], Awaitable[Message]]
Kind = TypeVar("Kind", bound=Message)
Listener = Callable[[Envelope[Any]], None]
"""A subscriber's callback. ``Bus.subscribe`` checks that it accepts the subscribed kinds of messages."""
Overhearer = Callable[[str, bytes], None]
LifeListener = Callable[[str, bool], None]
LinkListener = Callable[[bool], None]

current_cause: ContextVar[str] = ContextVar("current_cause", default="")
"""Id of the message being handled, which is the cause of all messages from this handler and its tasks."""


class Subscription(Protocol):
    """A declaration on the bus that can be withdrawn."""

    def close(self) -> None:
        """Withdraw the declaration; messages that have already arrived may still be delivered. Idempotent."""


class Overhearing(Subscription, Protocol):
    """A subscription to whole conversations."""

    @property
    def dropped(self) -> int:
        """Number of messages that were dropped because too many waited."""


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
        """Return at this mission time, at once if it has passed.

        On a real machine this may be a millisecond too early, because uvloop counts whole milliseconds. So a caller
        that compares the time afterwards must be ready to wait again.
        """


class Bus(Protocol):
    """Questions, publications and liveliness tokens between components.

    Addresses and missions that cannot be part of a key are refused with ``IllegalName``. On a closed bus a question
    ends with ``NoResponder``, a publication does nothing, and a declaration is a bug.

    Attributes:
        on_bug: Callback for an exception that is no refusal; settable.
        on_unreadable: Callback, with key and reason, for a publication that a listener did not get; settable.
        is_kept: True while a component lives on this bus, so that only its end may close it; settable.
    """

    on_bug: Callable[[BaseException], None]
    on_unreadable: Callable[[str, Refusal], None]
    is_kept: bool

    @property
    def mission(self) -> str:
        """Name of the mission of all keys of this bus."""

    @property
    def source(self) -> str:
        """Address of the component that uses this bus."""

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer.

        Args:
            address: ``<subsystem>/<component>``.
            within_s: Seconds of the machine (not mission time: a link does not speed up with the clock).

        Raises:
            Refusal: The component refused; the class is the one it raised.
            NoResponder: No component serves the address, or it died before its answer. The outcome is unknown.
            ReplyTimeout: No answer arrived in time. The outcome is unknown.
            MalformedMessage: The answer has another class than ``reply``. The outcome is unknown.
        """

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Subscription:
        """Answer questions to this address until closed.

        ``answer`` runs as a task of its own for each question; its ``Refusal`` is raised again at the requester.
        Unreadable questions are refused without a call. Any other exception is a bug: ``on_bug`` gets it, and the
        requester gets ``NoResponder``.
        """

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all present subscribers. Never waits, and needs no subscriber."""

    def is_unheard(self, conversation: Conversation) -> bool:
        """Return whether certainly no component gets what this bus publishes in this conversation at its own address.

        For messages that are costly to make and soon followed by the next one.
        """

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender, unchanged, to all present subscribers: for replays."""

    def declare_quality(self, address: str, conversation: Conversation, quality: Quality) -> None:
        """Send the messages of this key in another quality than its conversation's. Call it before the first one."""

    def declare_publisher(self, address: str, conversation: Conversation) -> None:
        """Declare the publisher of this key now, so that its first message is quick. For a few dozen keys."""

    def dropped(self) -> dict[str, int]:
        """Return the number of messages that came for listeners of this bus and were not handed to them.

        Not counted: messages that a sender's queue dropped, and those sent while the link was down, see ``watch_link``.
        Their number is unknown: a sender numbers all its messages, and a listener gets only those of its keys.

        The keys are the subscribed keys, without ``scout/<mission>/``; keys without a loss are left out.
        """

    @overload
    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: type[Kind],
        listener: Callable[[Envelope[Kind]], None],
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Subscription: ...

    @overload
    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: types.UnionType,
        listener: Callable[[Envelope[Message]], None],
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Subscription: ...

    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Subscription:
        """Call the listener, in the event loop, with each publication under this address (``*`` matches a segment).

        Args:
            latest: Keep only the newest undelivered publication of each address (pictures, states); else all, in
                the order of each source, as long as no more than ``MOST_WAITING_BYTES`` wait.
            lossless: Get each message that is sent while its sender knows this subscription, also one that a full queue
                would drop; ``latest`` has no effect then. Senders keep the unacknowledged messages, and never wait for
                this listener. Messages beyond ``MOST_KEPT_BYTES`` are lost, and ``dropped`` counts them.
        """

    def overhear(
        self,
        conversation: Conversation,
        listener: Overhearer,
        most_waiting_bytes: int,
        of: str = "",
        *,
        lossless: bool = False,
    ) -> Overhearing:
        """Call ``listener(key, bytes)``, in the event loop, with each publication of a conversation, by any sender.

        The bytes are not decoded, so messages of unknown classes and malformed ones come too. For questions, and for
        conversations that are ``NEVER_DROPPED``, overhear the copies in ``Conversation.TOLD``: then no sender waits for
        this process, even if it hangs.

        Args:
            most_waiting_bytes: Messages that arrive while so many bytes wait for the listener are dropped and counted.
            of: Address of the publications; empty: any. If it is given, other senders make no copies.
            lossless: Get each message, see ``subscribe``; waiting messages then wait at their senders.
        """

    def declare_alive(self, address: str) -> Subscription:
        """Declare this component's liveliness token. Declared last, it means ready."""

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Call ``listener(address, alive)`` for each present token and for every later change.

        A token ends when its process dies or withdraws it, or when a link is cut; ``watch_link`` reports this process's
        own link.
        """

    def watch_link(self, listener: LinkListener) -> Subscription:
        """Call ``listener(up)`` when this process loses or regains its own link to the hub."""

    def statistics(self) -> BusStatistics:
        """Return the counts of messages since the bus was opened."""

    async def close(self) -> None:
        """Withdraw all declarations and leave the network. Idempotent.

        Open questions of this bus, and questions that it is still answering, end with ``NoResponder`` at their
        requesters.

        Raises:
            RuntimeError: A component lives on this bus; without its declarations it would stay ready, and hear nothing.
        """


class Copies(Message, frozen=True):
    """Copies of messages of one key.

    The bus of an answerer copies each question with its answer or refusal. The bus of an asker copies each question
    that got no answer. The bus of a sender copies its publications that are never dropped.

    Attributes:
        address: Address in the key of the messages.
        conversation: Conversation in this key.
        messages: Envelopes of the messages, as bytes.
    """

    address: Mention
    conversation: Mention
    messages: Annotated[list[Quoted], FEW]


class Told(Message, frozen=True):
    """Copies that a bus publishes while a component overhears them; zenoh drops them rather than block the sender.

    Attributes:
        copies: In the order in which their messages were sent.
    """

    copies: Annotated[list[Copies], FEW]


class BusStatistics(Message, frozen=True):
    """Counters of one bus since it was opened.

    Attributes:
        asked: Questions sent.
        answered: Questions answered, refusals included.
        published: Publications sent.
        heard: Publications delivered to listeners.
        refused: Answers that were refusals.
        unreadable: Messages that could not be read, in either direction.
        told: Messages with copies for recorders; ``published`` does not count them.
    """

    asked: Count
    answered: Count
    published: Count
    heard: Count
    refused: Count
    unreadable: Count
    told: Count = 0
