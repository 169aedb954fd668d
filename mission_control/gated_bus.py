"""GatedBus: the bus of one implementation of a behavior; it sends only while the implementation is in charge.

Rules of this file:

* All messages are received. So an implementation that is not in charge gets its inputs, too.
* Only questions that change nothing pass the shut gate; their classes begin with ``Ask`` or ``List``. Commands to the
resource pool are refused, as without a grant. All other questions wait until the gate opens; publications are dropped.
* Name, tokens and address belong to the component; all implementations share them.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TypeVar, cast

from backbone.bus.interface import (
    Answer,
    Bus,
    BusStatistics,
    LifeListener,
    LinkListener,
    Listener,
    Overhearer,
    Overhearing,
    Reply,
    Subscription,
)
from backbone.component.messages import Register, Registered
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.quality import Quality
from backbone.waiting import as_bug
from backbone.wire import Accepts, Envelope, Message, UnknownMessage
from resource_pool.arc_client import SwappedOut

T = TypeVar("T")
EXITS = (SystemExit, KeyboardInterrupt)
"""Of a class that has replaced another one they are a bug; a ``KeyboardInterrupt`` of the first one is none."""
READS = ("Ask", "List")
POOL = f"{Subsystem.RESOURCE_POOL}/"


async def _unready(asked: Envelope[Message]) -> Message:
    raise UnknownMessage(f"{type(asked.body).__name__} comes before its start is over")


async def without_exit(work: Awaitable[T]) -> T:
    """Return the result of the work; an exit becomes a bug."""
    try:
        return await work
    except EXITS as left:
        raise as_bug(left) from left


async def _answer_without_exit(answer: Answer, asked: Envelope[Message]) -> Message:
    return await without_exit(answer(asked))


class GatedBus:
    """The bus of one implementation.

    Args:
        bus: The component's.
        is_first: True: the component began with this implementation.

    Attributes:
        is_open: True: the implementation is in charge.
        answer: Answers questions to the component.
        commands: Number of answered commands to the resource pool.
        under_way: Commands to the resource pool that have no answer yet.
        on_command: Called with each command that was applied, or may have been: its answer is missing.
    """

    def __init__(self, bus: Bus, *, is_first: bool = True) -> None:
        self.bus, self.is_first = bus, is_first
        self.answer: Answer = _unready
        self.route: Answer | None = None
        """Gets the component's questions; None: ``answer`` gets them."""
        self.on_bug: Callable[[BaseException], None] = bus.on_bug
        self.is_kept = True
        self.commands = 0
        self._opened, self._quiet = asyncio.Event(), asyncio.Event()
        self._quiet.set()
        self.under_way: list[Message] = []
        self.on_command: Callable[[Message], None] | None = None
        self._heard: dict[HeardThrough, None] = {}
        if is_first:
            self._opened.set()

    @property
    def on_unreadable(self) -> Callable[[str, Refusal], None]:
        """Callback for a publication that cannot be read, as of the bus behind the gate."""
        return self.bus.on_unreadable

    @on_unreadable.setter
    def on_unreadable(self, tell: Callable[[str, Refusal], None]) -> None:
        self.bus.on_unreadable = tell

    @property
    def is_open(self) -> bool:
        """True: the implementation is in charge."""
        return self._opened.is_set()

    def open(self) -> None:
        """Open the gate: everything passes."""
        self._opened.set()

    def shut(self) -> None:
        """Shut the gate: nothing passes that affects other components."""
        self._opened.clear()

    async def wait_quiet(self) -> None:
        """Wait until no command is in progress."""
        await self._quiet.wait()

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask, if the gate lets the question pass; see ``Bus.ask``."""
        if isinstance(question, Register) and not self.is_first:
            return cast(Reply, Registered())
        if type(question).__name__.startswith(READS):
            return await self.bus.ask(address, question, reply, within_s=within_s)
        if not address.startswith(POOL):
            await self._opened.wait()
            return await self.bus.ask(address, question, reply, within_s=within_s)
        if not self.is_open:
            raise SwappedOut(
                f"{self.source}: another class is in charge", reason="exchange", by="", expected_start_s=-1
            )
        self.under_way.append(question)
        self._quiet.clear()
        try:
            answered = await self.bus.ask(address, question, reply, within_s=within_s)
            self.commands += 1
            self._note(question)
            return answered
        except LinkError:
            self._note(question)
            raise
        finally:
            self.under_way.remove(question)
            if not self.under_way:
                self._quiet.set()

    def _note(self, command: Message) -> None:
        if self.on_command is not None:
            self.on_command(command)

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Publish through the open gate; see ``Bus.publish``."""
        if self.is_open:
            self.bus.publish(address, conversation, message)

    def is_unheard(self, conversation: Conversation) -> bool:
        """Return whether no component hears this conversation; see ``Bus.is_unheard``."""
        return self.bus.is_unheard(conversation)

    def declare_publisher(self, address: str, conversation: Conversation) -> None:
        """Declare the publisher of a key; see ``Bus.declare_publisher``."""
        self.bus.declare_publisher(address, conversation)

    def declare_quality(self, address: str, conversation: Conversation, quality: Quality) -> None:
        """Send the messages of a key with another quality; see ``Bus.declare_quality``."""
        self.bus.declare_quality(address, conversation, quality)

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Pass on through the open gate; see ``Bus.pass_on``."""
        if self.is_open:
            self.bus.pass_on(address, conversation, envelope)

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Subscription:
        """Answer questions to the component while in charge; see ``Bus.serve``."""
        self.answer = answer if self.is_first else partial(_answer_without_exit, answer)
        if self.is_first:
            return self.bus.serve(address, accepts, self.route or answer)
        return NoDeclaration()

    def declare_alive(self, address: str) -> Subscription:
        """Declare a token of the component; the first implementation has done it for all. See ``Bus``."""
        return self.bus.declare_alive(address) if self.is_first else NoDeclaration()

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
        """Subscribe to publications; see ``Bus.subscribe``."""
        heard = self._mine(listener)
        return self._keep(self.bus.subscribe(address, conversation, accepts, heard, latest=latest, lossless=lossless))

    def overhear(
        self,
        conversation: Conversation,
        listener: Overhearer,
        most_waiting_bytes: int,
        of: str = "",
        *,
        lossless: bool = False,
    ) -> Overhearing:
        """Overhear; see ``Bus.overhear``."""
        heard = self._mine(listener)
        return self._keep(self.bus.overhear(conversation, heard, most_waiting_bytes, of, lossless=lossless))

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Watch tokens; see ``Bus.watch_alive``."""
        return self._keep(self.bus.watch_alive(address, self._mine(listener)))

    def watch_link(self, listener: LinkListener) -> Subscription:
        """Watch the component's link; see ``Bus.watch_link``."""
        return self._keep(self.bus.watch_link(self._mine(listener)))

    @property
    def mission(self) -> str:
        """Name of the mission."""
        return self.bus.mission

    @property
    def source(self) -> str:
        """Address of the component."""
        return self.bus.source

    def statistics(self) -> BusStatistics:
        """Return the counts of the component."""
        return self.bus.statistics()

    def dropped(self) -> dict[str, int]:
        """Return the counts of messages that the component did not get; see ``Bus.dropped``."""
        return self.bus.dropped()

    async def close(self) -> None:
        """Refuse: a behavior without its declarations would stay ready and receive nothing.

        Raises:
            RuntimeError: Always.
        """
        raise RuntimeError(
            "only the end of a behavior closes its bus; write self.end(reason), or close what subscribe returned"
        )

    async def withdraw(self) -> None:
        """Withdraw all declarations of this implementation; the component's bus stays open."""
        for heard in list(self._heard):
            heard.close()

    def _keep(self, declared: Subscription) -> HeardThrough:
        heard = HeardThrough(declared, self._heard)
        self._heard[heard] = None
        return heard

    def _mine(self, listener: Callable[..., None]) -> Callable[..., None]:
        """Return a wrapped listener; its bugs count as bugs of this implementation."""

        def heard(*what: object) -> None:
            try:
                listener(*what)
            except asyncio.CancelledError:
                raise
            except BaseException as left:
                if self.is_first and isinstance(left, KeyboardInterrupt):
                    raise
                self.on_bug(as_bug(left))

        return heard


class HeardThrough:
    """A declaration of one implementation; it ends with the implementation."""

    def __init__(self, declared: Subscription, among: dict[HeardThrough, None]) -> None:
        self._declared, self._among = declared, among

    @property
    def dropped(self) -> int:
        """Number of messages that were dropped; see ``Overhearing``."""
        return int(getattr(self._declared, "dropped", 0))

    def close(self) -> None:
        """Withdraw the declaration."""
        self._among.pop(self, None)
        self._declared.close()


class NoDeclaration:
    """Placeholder for a declaration that belongs to the component."""

    def close(self) -> None:
        """Change nothing."""
