"""Bus base: what both buses share. It numbers and stamps messages, counts them, and calls listeners safely."""

from __future__ import annotations

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeVar

from backbone.bus.interface import Answer, BusStatistics, Clock, Copies, Listener, Told, current_cause
from backbone.errors import LinkError, NoResponder, OutcomeUnknown, Refusal, complaint
from backbone.keys import Conversation
from backbone.quality import QUALITY, Quality
from backbone.ranges import MOST_FEW, MOST_QUOTED_BYTES
from backbone.waiting import PASSING, as_bug, is_cancelled, settle
from backbone.wire import WIRE_VERSION, Envelope, Message, OversizedMessage, Refused, UnwritableMessage, write

log = logging.getLogger(__name__)
T = TypeVar("T")


class BusBase(ABC):
    """Base class of both buses: the messages of one source.

    Args:
        source: Address of the component; every envelope carries it.
    """

    def __init__(self, mission: str, source: str, clock: Clock) -> None:
        self._mission, self._clock = mission, clock
        self.source = source
        """Address of the component that uses this bus."""
        self._sequence = 0
        # A dict, not a set: it keeps the order of starts, so tasks that end together end in one order in every run.
        self._tasks: dict[asyncio.Task[object], None] = {}
        self._open_questions: dict[asyncio.Future[Any], None] = {}
        self._untold: list[tuple[str, Conversation, Sequence[Envelope[Message] | bytes]]] = []
        self._closing: asyncio.Task[None] | None = None
        self._qualities: dict[tuple[str, Conversation], Quality] = {}
        self.on_bug: Callable[[BaseException], None] = _report_to_loop
        """Callback for an exception that is no refusal."""
        self.on_unreadable: Callable[[str, Refusal], None] = lambda _key, _refusal: None
        """Callback for a publication that cannot be read."""
        self.is_kept = False
        """True while a component lives on this bus."""
        self.closed = False
        self.asked = self.answered = self.published = self.heard = self.refused = self.unreadable = 0
        self.told = 0

    @property
    def mission(self) -> str:
        """Name of the mission."""
        return self._mission

    def statistics(self) -> BusStatistics:
        """Return the counts of messages since the bus was opened."""
        return BusStatistics(
            self.asked, self.answered, self.published, self.heard, self.refused, self.unreadable, self.told
        )

    def declare_quality(self, address: str, conversation: Conversation, quality: Quality) -> None:
        """Send the messages of this key in another quality; see ``Bus.declare_quality``."""
        self._qualities[address, conversation] = quality

    def quality(self, address: str, conversation: Conversation) -> Quality:
        """Return the quality in which this bus sends the messages of a key."""
        return self._qualities.get((address, conversation)) or QUALITY[conversation]

    def envelope(self, body: Message) -> Envelope[Message]:
        """Return the body in an envelope with the next sequence number, now, and the current cause."""
        self._sequence += 1
        return Envelope(WIRE_VERSION, self.source, self._sequence, self._clock.now_s(), current_cause.get(), body)

    def hear(self, listener: Listener, envelope: Envelope[Message]) -> None:
        """Call a listener with the envelope as the current cause; its bugs go to ``on_bug``."""
        self.heard += 1
        self.call(envelope.id, listener, envelope)

    def call(self, cause: str, act: Callable[..., None], *arguments: object) -> None:
        """Call a callback with the message of this id as the current cause; its bugs go to ``on_bug``."""
        token = current_cause.set(cause)
        try:
            act(*arguments)
        except asyncio.CancelledError:  # of a cancelled task, whose result it took; a callback cannot be cancelled
            self.on_bug(RuntimeError(f"a callback of {self.source} raised CancelledError"))
        except PASSING:
            raise
        except BaseException as bug:
            self.on_bug(as_bug(bug))
        finally:
            current_cause.reset(token)

    def start(self, work: Coroutine[object, None, T]) -> asyncio.Task[T]:
        """Run a coroutine as a task that this bus owns until the bus is closed."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks[task] = None
        task.add_done_callback(lambda ended: self._tasks.pop(ended, None))
        return task

    async def reply_to(self, question: Envelope[Message], answer: Answer) -> Envelope[Message] | None:
        """Return the reply or refusal in an envelope, or None after a bug, which went to ``on_bug``."""
        self.answered += 1
        current_cause.set(question.id)
        try:
            body = await answer(question)
        except LinkError as error:
            self.refused += 1
            body = Refused.of(OutcomeUnknown(f"{self.source} got no answer to a question of its own: {error}"))
        except Refusal as refusal:
            self.refused += 1
            body = Refused.of(refusal)
        except asyncio.CancelledError as cut:
            if is_cancelled():
                raise
            self.on_bug(RuntimeError(f"an answer of {self.source} raised {complaint(cut)}, and no caller cancelled it"))
            return None
        except PASSING:
            raise
        except BaseException as bug:
            self.on_bug(as_bug(bug))
            return None
        return self.envelope(body)

    def tell(self, address: str, conversation: Conversation, *messages: Envelope[Message] | bytes) -> None:
        """Publish copies of these messages, if a component overhears them; copies that are too long are left out."""
        if not self.closed and self.is_overheard(Conversation.TOLD):
            self._untold.append((address, conversation, messages))
            if len(self._untold) == 1:
                self.tell_later(self._tell_all)

    def tell_later(self, act: Callable[[], None]) -> None:
        """Call a function at once; a bus with costly publications calls it later, when more copies wait."""
        act()

    def _tell_all(self) -> None:
        """Publish the copies that wait, many in one message.

        The publication takes no number of its own and is not counted: a component that overhears all messages of a
        sender detects from their numbers whether one is missing.
        """
        untold, self._untold = self._untold, []
        copies, length = list[Copies](), 0
        for address, conversation, messages in untold:
            written = quoted(messages)
            size = sum(map(len, written))
            if copies and (length + size > 2 * MOST_QUOTED_BYTES or len(copies) == MOST_FEW):
                self._publish_told(copies)
                copies, length = [], 0
            if written:
                copies.append(Copies(address, conversation, written))
                length += size
        if copies:
            self._publish_told(copies)

    def _publish_told(self, copies: list[Copies]) -> None:
        self._sequence -= 1
        self.published -= 1
        self.told += 1
        self.publish(self.source, Conversation.TOLD, Told(copies))

    def open_question(self) -> asyncio.Future[Any]:
        """Return the future of an answer; it gets None if this bus is closed first.

        Raises:
            NoResponder: The bus is closed already.
        """
        if self.closed:
            raise NoResponder(f"the bus of {self.source} is closed")
        answered: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._open_questions[answered] = None
        return answered

    def end_question(self, answered: asyncio.Future[Any]) -> None:
        """Forget a question that was answered or given up."""
        self._open_questions.pop(answered, None)

    def require_open(self) -> None:
        """Raise RuntimeError if the bus is closed, because a declaration on a closed bus is a bug."""
        if self.closed:
            raise RuntimeError(f"the bus of {self.source} is closed")

    async def close(self) -> None:
        """Withdraw all declarations and leave the network. Idempotent.

        Open questions of this bus end with ``NoResponder``. Questions to this bus that are still being answered end
        with ``NoResponder`` at their askers.

        Raises:
            RuntimeError: A component lives on this bus.
        """
        if self.is_kept:
            raise RuntimeError(
                "only the end of a component closes its bus; write self.end(reason), or close what subscribe returned"
            )
        if self._closing is None:
            self._tell_all()
            self.closed = True
            self.take_back()
            for answered in tuple(self._open_questions):
                settle(answered, None)
            caller = asyncio.current_task()
            answering = [task for task in self._tasks if task is not caller]
            for task in answering:
                task.cancel()
            self._closing = asyncio.get_running_loop().create_task(self._finish(answering))
        elif asyncio.current_task() in self._tasks:
            return  # the first close waits for this answer, so this answer must not wait for the first close
        await asyncio.shield(self._closing)

    @abstractmethod
    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``."""

    @abstractmethod
    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether a component gets the publications of this bus in this conversation at its own address."""

    @abstractmethod
    def dropped(self) -> dict[str, int]:
        """Return the messages that listeners did not get, by key; see ``Bus.dropped``."""

    @abstractmethod
    def take_back(self) -> None:
        """Withdraw all declarations."""

    @abstractmethod
    async def leave(self) -> None:
        """Leave the network. Called when no declaration is left and no task of this bus runs."""

    async def _finish(self, answering: list[asyncio.Task[object]]) -> None:
        await asyncio.gather(*answering, return_exceptions=True)
        await self.leave()


def _report_to_loop(bug: BaseException) -> None:
    asyncio.get_running_loop().call_exception_handler({"message": "bug in a bus handler", "exception": bug})


def quoted(messages: Sequence[Envelope[Message] | bytes]) -> list[bytes]:
    """Return the bytes of these messages; none if one is too long to be quoted."""
    try:
        written = [message if isinstance(message, bytes) else write(message) for message in messages]
    except (OversizedMessage, UnwritableMessage) as refusal:
        log.info("no copies for recorders: %s", refusal)
        return []
    return written if max(map(len, written)) <= MOST_QUOTED_BYTES else []
