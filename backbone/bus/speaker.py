"""What both buses do alike: number and stamp what is said, count what passes, guard what is called."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from backbone.bus.interface import Answer, BusStatistics, Clock, Listener, current_cause
from backbone.errors import LinkError, NoResponder, OutcomeUnknown, Refusal
from backbone.wire import WIRE_VERSION, Envelope, Message, Refused

T = TypeVar("T")


class Speaker(ABC):
    """One source of messages. Buses derive from it.

    Args:
        mission: Mission the keys belong to.
        source: Address that stands in every envelope.
        clock: Stamps every envelope.
    """

    def __init__(self, mission: str, source: str, clock: Clock) -> None:
        self._mission, self._source, self._clock = mission, source, clock
        self._sequence = 0
        # In the order in which they began, not a set's: what ends together ends in the same order in every run.
        self._tasks: dict[asyncio.Task[Any], None] = {}
        self._open_questions: dict[asyncio.Future[Any], None] = {}
        self._closing: asyncio.Task[None] | None = None
        self._on_bug: Callable[[BaseException], None] = _report_to_loop
        self.closed = False
        self.asked = self.answered = self.published = self.heard = self.refused = self.unreadable = 0

    @property
    def mission(self) -> str:
        """Name of the mission."""
        return self._mission

    @property
    def source(self) -> str:
        """Address of the component that speaks here."""
        return self._source

    @property
    def on_bug(self) -> Callable[[BaseException], None]:
        """Who is told of an exception that is no refusal."""
        return self._on_bug

    @on_bug.setter
    def on_bug(self, tell: Callable[[BaseException], None]) -> None:
        self._on_bug = tell

    def statistics(self) -> BusStatistics:
        """Return what passed since the bus was opened."""
        return BusStatistics(self.asked, self.answered, self.published, self.heard, self.refused, self.unreadable)

    def envelope(self, body: Message) -> Envelope[Any]:
        """Return the body in an envelope with the next sequence number, now, and the current cause."""
        self._sequence += 1
        return Envelope(WIRE_VERSION, self._source, self._sequence, self._clock.now_s(), current_cause.get(), body)

    def hear(self, listener: Listener, envelope: Envelope[Any]) -> None:
        """Call a listener with the envelope as the current cause; its bugs go to ``on_bug``."""
        self.heard += 1
        self.call(envelope.id, listener, envelope)

    def call(self, cause: str, act: Callable[..., None], *arguments: Any) -> None:
        """Call somebody else's code because of the message with this id; its bugs go to ``on_bug``."""
        token = current_cause.set(cause)
        try:
            act(*arguments)
        except Exception as bug:
            self._on_bug(bug)
        finally:
            current_cause.reset(token)

    def start(self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Run a coroutine as a task this bus owns until it is closed."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks[task] = None
        task.add_done_callback(self._forget)
        return task

    async def reply_to(self, question: Envelope[Any], answer: Answer) -> Envelope[Any] | None:
        """Return the reply or refusal in an envelope, or None after a bug, which went to ``on_bug``."""
        self.answered += 1
        current_cause.set(question.id)
        try:
            body = await answer(question)
        except LinkError as error:
            self.refused += 1
            body = Refused.of(OutcomeUnknown(f"{self._source} got no answer itself: {error}"))
        except Refusal as refusal:
            self.refused += 1
            body = Refused.of(refusal)
        except Exception as bug:
            self._on_bug(bug)
            return None
        return self.envelope(body)

    def open_question(self) -> asyncio.Future[Any]:
        """Return the future of an answer; it gets None if this bus is closed first.

        Raises:
            NoResponder: The bus is closed already.
        """
        if self.closed:
            raise NoResponder(f"the bus of {self._source} is closed")
        answered: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._open_questions[answered] = None
        return answered

    def end_question(self, answered: asyncio.Future[Any]) -> None:
        """Forget a question: it was answered or given up."""
        self._open_questions.pop(answered, None)

    def require_open(self) -> None:
        """Raise RuntimeError if the bus is closed: declaring anything then is a bug."""
        if self.closed:
            raise RuntimeError(f"the bus of {self._source} is closed")

    async def close(self) -> None:
        """Take back everything declared and leave; return when that is done, however often called.

        Questions asked here and still open end with ``NoResponder``, and so do, on their side, those
        that were asked of this bus and are still being answered.
        """
        if self._closing is None:
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
            return  # an answer that closes its own bus is waited for by the first close: it must not wait for that
        await asyncio.shield(self._closing)

    @abstractmethod
    def take_back(self) -> None:
        """Take back everything declared."""

    @abstractmethod
    async def leave(self) -> None:
        """Leave the network; nothing is declared any more and no task of this bus runs."""

    def _forget(self, task: asyncio.Task[Any]) -> None:
        self._tasks.pop(task, None)

    async def _finish(self, answering: list[asyncio.Task[Any]]) -> None:
        await asyncio.gather(*answering, return_exceptions=True)
        await self.leave()


def settle(answered: asyncio.Future[Any], answer: Any) -> None:
    """Give the future its result unless it already has one or was given up."""
    if not answered.done():
        answered.set_result(answer)


def _report_to_loop(bug: BaseException) -> None:
    asyncio.get_running_loop().call_exception_handler({"message": "bug in a bus handler", "exception": bug})
