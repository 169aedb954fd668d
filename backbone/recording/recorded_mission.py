"""A mission as a recording has it at one instant: who is there, and what its components answer. Pure."""

from __future__ import annotations

import copy
from collections import OrderedDict
from collections.abc import Iterator, Mapping

import msgspec

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.component.messages import (
    AskState,
    AskTime,
    ComponentState,
    MissionTime,
    Register,
    Registered,
    StoryEvent,
)
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
"""Conversations whose newest message is what a newcomer must know."""
HISTORY = frozenset(
    {Conversation.ALIVE, Conversation.ASK, Conversation.LOG, Conversation.OPERATORS, Conversation.DECISIONS}
)
"""Conversations of which all messages until then decide what is answered."""
_TABLES = ("present", "there", "_states", "_guests", "_newest", "_open", "_answers")
MOST_OPEN = 1000  # chosen: questions under way at one time; the others were never answered


class TakesNoCommands(Refusal):
    """What happened cannot be commanded."""

    code = "recording.only"
    remedy = "Bring the mission up to command it: scout-backbone recording mission FILE > mission.xml, then 'up'."


class NotAnswered(Refusal):
    """The component did not answer this question until then."""

    code = "recording.not_answered"
    remedy = "Go to a later time of the recording."


class RecordedMission:
    """Takes the messages of a recording in their order.

    Args:
        classes: Known message classes, by schema.

    Attributes:
        now_s: Mission time.
        rate: Mission seconds per second of the machine, as its clock is to be told.
        present: Addresses of the components that are ready.
        there: Addresses that answer: those of messages and questions, unless their component is gone.
    """

    def __init__(self, classes: Mapping[str, type[Message]]) -> None:
        self.now_s, self.rate = 0.0, 1.0
        self.present: dict[str, None] = {}
        self.there = dict.fromkeys((NAMESERVER, LAUNCHER))
        self._classes = classes
        self._states: dict[str, ComponentState] = {}
        self._guests: dict[str, ComponentState] = {}  # who came to look
        self._newest: dict[tuple[str, str], Recorded] = {}
        self._open: OrderedDict[str, tuple[str, str, bytes]] = OrderedDict()
        self._answers: dict[tuple[str, str, bytes], Message] = {}
        self._log = MissionLog()
        self._schedule = RecordedSchedule()

    def take(self, message: Recorded) -> None:
        """Let it have been said."""
        self.take_said(message, message_as_sent(self._classes, message))

    def take_said(self, message: Recorded, said: Message | None) -> None:
        """Let it have been said.

        Args:
            said: The message as it was sent, see ``message_as_sent``.
        """
        self.now_s = max(self.now_s, message.at_s)
        address, conversation = address_of(message.key), message.key.rpartition("/")[2]
        self.there[address] = None
        if conversation in STATES:
            self._newest[message.key, message.schema] = message
        match said:
            case Presence(alive=alive):
                self._presence_changed(address, alive)
            case ComponentState() if conversation != Conversation.ASK or message.source == said.address:
                self._states[said.address] = said
            case StoryEvent() if conversation == Conversation.LOG:
                self._log.add(said)
            case OperatorActed():
                self._log.add(said.event(message.source, message.cause))
            case Decided() | ScheduleSnapshot():
                self._schedule.take(said)
        if conversation == Conversation.ASK and said is not None:
            self._asked_or_answered(address, message, said)

    def copied(self) -> RecordedMission:
        """Return a mission that goes on from here by itself; the messages, which never change, are in both."""
        twin = copy.copy(self)
        vars(twin).update({name: copy.copy(getattr(self, name)) for name in _TABLES})
        vars(twin).update(_log=self._log.copied(), _schedule=copy.deepcopy(self._schedule))
        return twin

    def newest(self) -> Iterator[Recorded]:
        """Yield the newest message of each key that tells a state."""
        yield from self._newest.values()

    def answer(self, address: str, question: Message) -> Message:
        """Return what the component answers.

        Raises:
            TakesNoCommands: The question would change something.
            NotAnswered: It is not there, or did not answer this until now.
            UnknownName: No component has this name.
            UnknownRequest: The schedule has nothing of this name.
        """
        if address not in self.there:
            raise NotAnswered(f"{address} is not there at {self.now_s:.3f} s")
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
        known = self._answers.get(asked_of(address, question))
        if known is None:
            raise NotAnswered(f"{address} did not answer {type(question).__name__} until {self.now_s:.3f} s")
        return known

    def gone(self, guest: str) -> None:
        """Forget who came to look, by address."""
        self._guests.pop(guest, None)

    def _presence_changed(self, address: str, alive: bool) -> None:
        if alive:
            self.present[address] = None
        else:
            self.present.pop(address, None)
            self._states.pop(address, None)
            self.there.pop(address, None)

    def _asked_or_answered(self, address: str, message: Recorded, said: Message) -> None:
        asked = self._open.get(message.cause)
        if asked is not None and asked[0] == address == message.source:  # else a question that this one led to
            self._answers[self._open.pop(message.cause)] = said
            return
        self._open[message.id] = asked_of(address, said)
        if len(self._open) > MOST_OPEN:
            self._open.popitem(last=False)


def asked_of(address: str, question: Message) -> tuple[str, str, bytes]:
    """Return what makes a question to a component the same question."""
    return address, schema_of(type(question)), msgspec.json.encode(named(question))
