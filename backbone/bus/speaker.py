"""What both buses do alike: number and stamp what is said, count what passes, guard listeners."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from backbone.bus.interface import Answer, BusStatistics, Clock, Listener, current_cause
from backbone.errors import Refusal
from backbone.wire import WIRE_VERSION, Envelope, Message, Refused

log = logging.getLogger(__name__)


class Speaker:
    """One source of messages. Buses derive from it.

    Args:
        mission: Mission the keys belong to.
        source: Address that stands in every envelope.
        clock: Stamps every envelope.
    """

    def __init__(self, mission: str, source: str, clock: Clock) -> None:
        self._mission, self._source, self._clock = mission, source, clock
        self._sequence = 0
        self._tasks: set[asyncio.Task[None]] = set()
        self._on_bug: Callable[[BaseException], None] = _report_to_loop
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
        token = current_cause.set(envelope.id)
        try:
            listener(envelope)
        except Exception as bug:
            self._on_bug(bug)
        finally:
            current_cause.reset(token)

    def start(self, work: Any) -> asyncio.Task[None]:
        """Run a coroutine as a task this bus owns until it is closed."""
        task: asyncio.Task[None] = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def end_tasks(self) -> None:
        """Cancel what still runs, except the caller itself, and wait for it."""
        tasks = [task for task in self._tasks if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def reply_to(self, question: Envelope[Any], answer: Answer) -> Envelope[Any] | None:
        """Return the reply or refusal in an envelope, or None after a bug, which went to ``on_bug``."""
        self.answered += 1
        current_cause.set(question.id)
        try:
            body = await answer(question)
        except Refusal as refusal:
            self.refused += 1
            body = Refused.of(refusal)
        except Exception as bug:
            self._on_bug(bug)
            return None
        return self.envelope(body)


def _report_to_loop(bug: BaseException) -> None:
    asyncio.get_running_loop().call_exception_handler({"message": "bug in a bus handler", "exception": bug})
