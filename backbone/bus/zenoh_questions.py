"""Direct questions: a component that is asked repeatedly is asked by publication, which is quicker than a query.

A query costs a third message and an entry in the hub's table of open queries. So the answer to a query names the inbox
of the component that answered. From the third question on, the asker publishes its questions there, and the answers are
published to the inbox of the asker. On one host all questions and answers go over a line between the two processes
instead, see ``host_lines``.

* An inbox belongs to one life of one component. A restarted component has another inbox, and a query finds it.
* The hub reports whether the owner of an inbox is there. If the owner is gone, open questions end without an answer, as
  queries do, but ``STILL_COME_S`` later, because such a report may overtake the owner's last answer.
* While a query to a component is open, the next question is a query, too. So no question overtakes an earlier one.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import struct
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, cast

import zenoh

from backbone.bus.answers import AnsweredByMessage, Came, TooLate
from backbone.bus.declared import FirstReply
from backbone.bus.host_lines import HostLines, HostQuestion, LineWay
from backbone.bus.inbox import InboxBus
from backbone.bus.zenoh_outlets import on_the_wire
from backbone.keys import ROOT, Conversation
from backbone.quality import QUALITY
from backbone.waiting import settle

MOST_WAYS = 64  # chosen: each way is a declaration at the hub; components beyond them are asked by queries
STILL_COME_S = 0.1  # measured: one report of an owner's end in a hundred overtakes its last answer by milliseconds
_NUMBER = struct.Struct("<Q")
_ANSWERED, _UNANSWERED = b"\1", b"\0"
_EXPRESS = on_the_wire(QUALITY[Conversation.ASK])

log = logging.getLogger(__name__)


class OpenQuestions:
    """The questions of one bus whose answers come by publication.

    Args:
        answers: Key of the inbox for answers.
    """

    def __init__(self, answers: str) -> None:
        self.answers = answers
        self._waiting: dict[int, asyncio.Future[Came]] = {}
        self._number = 0

    def add(self, answered: asyncio.Future[Came]) -> int:
        """Return the number of a further question."""
        self._number += 1
        self._waiting[self._number] = answered
        return self._number

    def remove(self, number: int) -> None:
        """Stop waiting for this answer."""
        del self._waiting[number]

    def arrived(self, sample: zenoh.Sample) -> None:
        """Settle the question to which this answer belongs."""
        attached = b"" if sample.attachment is None else sample.attachment.to_bytes()
        if len(attached) != _NUMBER.size + 1:
            return
        if (answered := self._waiting.get(_NUMBER.unpack_from(attached)[0])) is not None:
            settle(answered, sample.payload.to_bytes() if attached.endswith(_ANSWERED) else None)


class DirectWay:
    """The way to the inbox of one life of a component, through the hub.

    Args:
        open_questions: Open questions of the bus, by number.
        lost: Called when the owner of the inbox is gone.
    """

    def __init__(
        self,
        bus: InboxBus,
        publisher: zenoh.Publisher,
        inbox: str,
        open_questions: OpenQuestions,
        lost: Callable[[Way], None],
    ) -> None:
        self.inbox, self._publisher, self._open, self._lost = inbox, publisher, open_questions, lost
        self.waiting: list[asyncio.Future[Came]] = []
        """Open questions to this inbox."""
        self.is_open = False
        """Whether the hub knows the owner of the inbox."""

        def changed(status: zenoh.MatchingStatus) -> None:
            bus.push(self._changed, bool(cast("Any", status).matching))

        self._listener = publisher.declare_matching_listener(zenoh.handlers.Callback(changed, indirect=False))

    async def ask(self, payload: bytes, answered: asyncio.Future[Came]) -> Came:
        """Return the outcome of a question."""
        number = self._open.add(answered)
        self.waiting.append(answered)
        try:
            self._publisher.put(payload, attachment=_NUMBER.pack(number) + self._open.answers.encode())
            return await answered
        finally:
            self._open.remove(number)
            self.waiting.remove(answered)

    def close(self) -> None:
        """Withdraw the way. Open questions wait ``STILL_COME_S`` longer, because their answers may be under way."""
        self.is_open = False
        self._listener.undeclare()  # type: ignore[no-untyped-call]
        self._publisher.undeclare()  # type: ignore[no-untyped-call]
        for answered in self.waiting:
            asyncio.get_running_loop().call_later(STILL_COME_S, settle, answered, None)

    def _changed(self, has_owner: bool) -> None:
        was_open, self.is_open = self.is_open, has_owner
        if was_open and not has_owner:
            self._lost(self)


Way = DirectWay | LineWay


class Ways:
    """The ways of one bus to the components that it asks repeatedly.

    Args:
        own: Address of the bus's component.
        only_elsewhere: True: questions do not reach inboxes of the same session.
    """

    def __init__(self, bus: InboxBus, session: zenoh.Session, mission: str, own: str, *, only_elsewhere: bool) -> None:
        self._bus, self._session, self._mission = bus, session, mission
        self._destination = zenoh.Locality.REMOTE if only_elsewhere else zenoh.Locality.ANY
        self.questions = OpenQuestions(new_inbox_key(mission, own, "answers"))
        self.lines: HostLines | None = None
        """Lines to other processes of this host; settable."""
        self._subscriber: zenoh.Subscriber[None] | None = None
        self._querying = Counter[str]()
        self._answered_by: OrderedDict[str, bytes] = OrderedDict()  # address → inbox in the answer to the last query
        self._ways: dict[str, Way] = {}

    def way_to(self, address: str) -> Way | None:
        """Return the way to this component, if there is one now; on this host it is found at once."""
        if self._querying[address]:
            return None
        way = self._ways.get(address) or self._near_way(address)
        return way if way is not None and way.is_open else None

    async def ask(self, way: Way, payload: bytes, answered: asyncio.Future[Came], within_s: float) -> Came:
        """Return the outcome of a question; None, too, if the bus is closed meanwhile."""
        late = asyncio.get_running_loop().call_later(max(0.0, within_s), settle, answered, TooLate)
        try:
            return await way.ask(payload, answered)
        finally:
            late.cancel()

    @contextmanager
    def querying(self, address: str) -> Iterator[None]:
        """Count a query as open."""
        self._querying[address] += 1
        try:
            yield
        finally:
            self._querying[address] -= 1
            if not self._querying[address]:
                del self._querying[address]

    def answered(self, address: str, attached: zenoh.ZBytes | None) -> None:
        """Record the inbox in an answer to a query; the second answer with one inbox makes a way to it."""
        called = b"" if attached is None or len(attached) > LONGEST_KEY else attached.to_bytes()
        inbox = called.decode(errors="replace")
        if not is_inbox(inbox, self._mission, "asked", address):
            return
        way = self._ways.get(address)
        if way is not None and way.inbox == inbox:
            return
        if self._answered_by.pop(address, b"") == called:
            self._make_way(address, inbox)
            return
        self._answered_by[address] = called
        while len(self._answered_by) > MOST_WAYS:
            self._answered_by.popitem(last=False)

    def close(self) -> None:
        """Withdraw all."""
        while self._ways:
            self._ways.popitem()[1].close()
        if self._subscriber is not None:
            self._subscriber.undeclare()  # type: ignore[no-untyped-call]
            self._subscriber = None

    def _make_way(self, address: str, inbox: str) -> None:
        if (former := self._ways.pop(address, None)) is not None:
            former.close()
        if len(self._ways) < MOST_WAYS:
            self._ways[address] = self._far_way(inbox, partial(self._lost, address))

    def _near_way(self, address: str) -> Way | None:
        if self.lines is None or len(self._ways) >= MOST_WAYS:
            return None
        near = self.lines.way(address, partial(self._lost, address))
        if near is not None:
            self._ways[address] = near
        return near

    def _far_way(self, inbox: str, lost: Callable[[Way], None]) -> DirectWay:
        if self._subscriber is None:
            self._subscriber = self._session.declare_subscriber(
                self.questions.answers, lambda sample: self._bus.push(self.questions.arrived, sample)
            )
        publisher = self._session.declare_publisher(inbox, allowed_destination=self._destination, **_EXPRESS)
        return DirectWay(self._bus, publisher, inbox, self.questions, lost)

    def _lost(self, address: str, way: Way) -> None:
        if self._ways.get(address) is way:
            self._ways.pop(address).close()


class DirectQuestion(AnsweredByMessage):
    """A question that came to an inbox, with what its answer needs."""

    def __init__(self, session: zenoh.Session, payload: zenoh.ZBytes, number: bytes, answers: str) -> None:
        self._session, self._number, self._answers = session, number, answers
        self.payload = payload

    @classmethod
    def of(cls, session: zenoh.Session, mission: str, sample: zenoh.Sample) -> DirectQuestion | None:
        """Return the question in a sample; None: it names no inbox of this mission for its answer."""
        attached = sample.attachment
        raw = b"" if attached is None or len(attached) > LONGEST_KEY else attached.to_bytes()
        answers = raw[_NUMBER.size :].decode(errors="replace")
        if not is_inbox(answers, mission, "answers"):
            log.warning("a question on %s without an inbox for its answer", sample.key_expr)
            return None
        return cls(session, sample.payload, raw[: _NUMBER.size], answers)

    def send(self, payload: bytes, *, is_answer: bool) -> None:
        """Publish a message to the inbox of the asker."""
        attachment = self._number + (_ANSWERED if is_answer else _UNANSWERED)
        self._session.put(self._answers, payload, attachment=attachment, **_EXPRESS)

    def drop(self) -> None:
        """Report that there is no answer, unless one was sent."""
        with suppress(zenoh.ZError):  # the session is closed: the asker learns from the hub that the inbox is gone
            super().drop()


class Query:
    """A question that came by a query."""

    def __init__(self, query: zenoh.Query, own: str, inbox: str) -> None:
        self._query, self._own, self._inbox = query, own, inbox
        self.payload = query.payload

    def answer(self, payload: bytes) -> None:
        """Send the answer, and the name of the inbox for further questions."""
        self._query.reply(self._own, payload, express=True, attachment=self._inbox)

    def refuse(self, payload: bytes) -> None:
        """Send the refusal of a question that cannot be read."""
        self._query.reply_err(payload)

    def drop(self) -> None:
        """End the query; without an answer the asker gets ``NoResponder``."""
        self._query.drop()  # type: ignore[no-untyped-call]


Asked = Query | DirectQuestion | HostQuestion
"""A question that came by one of the three ways."""


def new_inbox(mission: str, address: str) -> str:
    """Return the key of an inbox for one life of the component at this address."""
    return new_inbox_key(mission, address, "asked")


LONGEST_KEY = 1024  # chosen: bytes of a key
_OWN = re.compile(r"(.+)/(\w+)/[0-9a-f]{12}")


def new_inbox_key(mission: str, address: str, kind: str) -> str:
    """Return the key of a new inbox of this kind."""
    return f"{ROOT}/{mission}/{address}/{kind}/{os.urandom(6).hex()}"


def is_inbox(name: str, mission: str, kind: str, address: str = "") -> bool:
    """Return whether a name is that of an inbox in this mission, of any component if no address is given."""
    found = _OWN.fullmatch(name)
    if found is None or found[2] != kind or set(name) & set("*$#?"):
        return False
    root = f"{ROOT}/{mission}/"
    return found[1] == root + address if address else found[1].startswith(root)


async def query(
    bus: InboxBus, session: zenoh.Session, key: str, payload: bytes, answered: asyncio.Future[Any], within_s: float
) -> zenoh.Reply | None:
    """Send a query, and return its first reply when it settles ``answered``; None: there was none."""
    arrived, cancel = FirstReply(bus, answered), zenoh.CancellationToken()
    try:
        session.get(
            key,
            zenoh.handlers.Callback(arrived.reply, arrived.end, indirect=False),
            payload=payload,
            timeout=max(0.0, within_s),
            express=True,
            cancellation_token=cancel,
        )
        return cast("zenoh.Reply | None", await answered)
    except asyncio.CancelledError:
        cancel.cancel()  # type: ignore[no-untyped-call]
        raise
