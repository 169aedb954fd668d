"""A recorded mission at one instant: its present components, and their answers. Pure."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping

import msgspec

from backbone.addresses import LAUNCHER, NAMESERVER, RC_MANAGER
from backbone.component.messages import AskState, AskTime, ComponentState, MissionTime, Register, Registered, StoryEvent
from backbone.errors import Refusal
from backbone.keys import Conversation, address_of
from backbone.mission_log.log import AskLog, MissionLog
from backbone.mission_log.operators import OperatorActed
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.naming import component_of
from backbone.rc_manager.messages import AskSchedule, AskWhy, Decided, ScheduleSnapshot
from backbone.recording.decisions import RecordedSchedule
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded
from backbone.recording.revival import message_as_sent
from backbone.recording.translation import named
from backbone.scheduling.explain.answers import Answers
from backbone.wire import Message, schema_of

READS = ("Ask", "List", "Resolve")
"""First words of questions that change nothing."""
STATES = frozenset(
    {Conversation.STATUS, Conversation.SCHEDULE, Conversation.HEALTH, Conversation.POSES, Conversation.FRAMES}
)
"""Conversations whose newest message a new listener must get."""
HISTORY = frozenset(
    {Conversation.ALIVE, Conversation.ASK, Conversation.LOG, Conversation.OPERATORS, Conversation.DECISIONS}
)
"""Conversations of which all earlier messages determine the answers."""
_FOLLOWED = frozenset(
    kind.__name__ for kind in (Presence, ComponentState, StoryEvent, OperatorActed, Decided, ScheduleSnapshot)
)
MOST_OPEN = 1000  # chosen: questions under way at one time; older ones were never answered


class TakesNoCommands(Refusal):
    """A recording cannot be commanded."""

    code = "recording.only"
    remedy = "Bring the mission up to command it: scout-backbone recording mission FILE > mission.xml, then 'up'."


class NotAnswered(Refusal):
    """The component did not answer this question before the present time of the recording."""

    code = "recording.not_answered"
    remedy = "Go to a later time of the recording."


class RecordedMission:
    """The state of the mission, built from the messages of a recording in their order.

    Args:
        classes: Known message classes, by schema.

    Attributes:
        now_s: Mission time.
        rate: Mission seconds per second of the machine, for answers about the clock.
        present: Addresses of the components that are ready.
        there: Addresses that answer: all that occurred in messages and questions, except of components that are gone.
    """

    def __init__(self, classes: Mapping[str, type[Message]]) -> None:
        self.now_s, self.rate = 0.0, 1.0
        self.earlier: Callable[[str, Message], Message | None] = lambda _address, _question: None
        """Finds the answer to a question from before the messages that were taken; settable."""
        self.present: dict[str, None] = {}
        self.there = dict.fromkeys((NAMESERVER, LAUNCHER))
        self._classes = classes
        self._states: dict[str, ComponentState] = {}
        self._guests: dict[str, ComponentState] = {}  # live clients that inspect the recording
        self._newest: dict[tuple[str, str], Recorded] = {}
        self._open: OrderedDict[str, tuple[str, str, bytes]] = OrderedDict()
        self._answers: dict[tuple[str, str, bytes], Message] = {}
        self._log = MissionLog()
        self._schedule = RecordedSchedule()

    def take(self, message: Recorded) -> None:
        """Apply the message; restoring one as it was sent takes most of the time, so only some are restored."""
        is_read = message.schema.partition("/")[0] in _FOLLOWED or self._is_of_a_read(message)
        self.take_said(message, message_as_sent(self._classes, message) if is_read else None)

    def take_said(self, message: Recorded, said: Message | None) -> None:
        """Apply the message.

        Args:
            said: The message as it was sent, see ``message_as_sent``.
        """
        self.now_s = max(self.now_s, message.at_s)
        address, conversation = address_of(message.key), message.key.rpartition("/")[2]
        self.there[address] = None
        if conversation in STATES:
            self._newest[message.key, message.schema] = message
        match said:
            case Presence(alive=alive) if conversation == Conversation.ALIVE:
                self._presence_changed(address, alive)
            case ComponentState() if conversation != Conversation.ASK or message.source == said.address:
                self._states[said.address] = said
            case StoryEvent() if conversation == Conversation.LOG:
                self._log.add(said)
            case OperatorActed():
                self._log.add(said.event(message.source, message.cause))
            case Decided() | ScheduleSnapshot() if message.source == RC_MANAGER:
                self._schedule.take(said, message)
        if said is not None and self._is_of_a_read(message):
            self._asked_or_answered(address, message, said)

    def restore(
        self,
        *,
        at_s: float,
        present: Iterable[str],
        there: Iterable[str],
        states: Mapping[str, ComponentState],
        newest: Iterable[Recorded],
        events: Iterable[StoryEvent],
        decisions: Iterable[tuple[Recorded, Decided | ScheduleSnapshot]],
    ) -> None:
        """Take over a state in place of the own one, except for questions and answers.

        Args:
            newest: The newest message of each key that carries a state.
            events: The newest events, oldest first.
            decisions: The last snapshot of the schedule, and what was decided since.
        """
        self.now_s, self._states = at_s, dict(states)
        self.present, self.there = dict.fromkeys(present), dict.fromkeys(there)
        self._newest = {(one.key, one.schema): one for one in newest}
        self._log, self._schedule = MissionLog(), RecordedSchedule()
        for event in events:
            self._log.add(event)
        for message, said in decisions:
            self._schedule.take(said, message)

    def newest(self) -> Iterator[Recorded]:
        """Yield the newest message of each key that carries a state."""
        yield from self._newest.values()

    def answer(self, address: str, question: Message) -> Message:
        """Return the component's answer.

        Raises:
            TakesNoCommands: The question would change something.
            NotAnswered: The component is absent, or did not answer this question until now.
            UnknownName: No component has this name.
            UnknownRequest: The schedule has no entry of this name.
        """
        if address not in self.there:
            raise NotAnswered(f"{address} is absent at {self.now_s:.3f} s")
        match question:
            case AskTime():
                return MissionTime(self.now_s, self.rate)
            case Register(component=guest):
                self._guests[guest.address] = guest
                return Registered()
            case ListComponents(subsystem=subsystem, type=kind) if address == NAMESERVER:
                there = {at: one for at, one in self._states.items() if at in self.present} | self._guests
                states = [there[at] for at in sorted(there)]
                of = [one for one in states if one.address.startswith(subsystem) and kind in ("", one.type)]
                return Components(of, True, 0.0)
            case Resolve(name=name):
                those = (self._states | self._guests).values()
                found = [one for one in those if component_of(one.address) == name]
                if not found:
                    raise UnknownName(f"no component is named {name!r} at {self.now_s:.3f} s", name=name)
                return Resolved(found[-1])
            case AskState() if address in self._states:
                return self._states[address]
            case AskLog():
                return self._log.answer(question)
            case AskSchedule() if self._schedule.manager is not None:
                return Answers(self._schedule.manager).schedule(self.now_s)
            case AskWhy(name=name) if self._schedule.manager is not None:
                return Answers(self._schedule.manager).why(name, self.now_s)
        if not type(question).__name__.startswith(READS):
            raise TakesNoCommands(f"{type(question).__name__} is a command, and {address} is a recording")
        known = self._answers.get(asked_of(address, question)) or self.earlier(address, question)
        if known is None:
            raise NotAnswered(f"{address} did not answer {type(question).__name__} until {self.now_s:.3f} s")
        return known

    def gone(self, guest: str) -> None:
        """Forget the client with this address."""
        self._guests.pop(guest, None)

    def _presence_changed(self, address: str, alive: bool) -> None:
        if alive:
            self.present[address] = None
        else:
            self.present.pop(address, None)
            self._states.pop(address, None)
            self.there.pop(address, None)

    def _is_of_a_read(self, message: Recorded) -> bool:
        """Return whether it is a question that changes nothing, or may answer one; no answer to a command is used."""
        is_asked = message.key.endswith(f"/{Conversation.ASK}")
        return is_asked and (message.schema.startswith(READS) or message.cause in self._open)

    def _asked_or_answered(self, address: str, message: Recorded, said: Message) -> None:
        asked = self._open.get(message.cause)
        if asked is not None and asked[0] == address == message.source:  # else a question caused by this one
            self._answers[self._open.pop(message.cause)] = said
            return
        self._open[message.id] = asked_of(address, said)
        if len(self._open) > MOST_OPEN:
            self._open.popitem(last=False)


def asked_of(address: str, question: Message) -> tuple[str, str, bytes]:
    """Return what identifies a question to a component: equal questions have equal values."""
    return address, schema_of(type(question)), msgspec.json.encode(named(question))
