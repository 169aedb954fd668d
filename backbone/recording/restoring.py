"""Restores the state of a recorded mission at an instant from the newest messages before it. Pure.

Most of the state is the newest message of each key, which the index of the file leads to. The rest is the newest
events, the schedule since its last snapshot, and questions that still wait for an answer. So a late instant takes no
longer than an early one. The answer to an earlier question is looked for when the question is asked again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.component.messages import ComponentState, StoryEvent
from backbone.keys import Conversation, address_of
from backbone.mission_log.log import EVENTS_KEPT
from backbone.mission_log.operators import OperatorActed
from backbone.recording.decisions import since_last_snapshot
from backbone.recording.file_index import MessagePlace
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorded_mission import HISTORY, STATES, RecordedMission, asked_of
from backbone.recording.revival import message_as_sent
from backbone.recording.writer import NS
from backbone.wire import Message, schema_of

ANSWERED_WITHIN_S = 30.0  # chosen: longer than any component waits for an answer
_QUESTIONS = (f"*/{Conversation.ASK}",)
_KNOWN = STATES | HISTORY
_FIRST = MessagePlace(-1, 0, 0)
_STATE = schema_of(ComponentState)


def mission_at(recording: Recording, classes: Mapping[str, type[Message]], at_s: float) -> RecordedMission:
    """Return the state of the mission after all messages before this time.

    Args:
        recording: Read again when the mission is asked questions.
        classes: Known message classes, by schema.

    Raises:
        NoRecording: The recording is damaged.
    """
    mission, before_ns = RecordedMission(classes), round(at_s * NS)
    before_s = (before_ns - 1) / NS
    if not all(key for key, _source, _schema in recording.channels().values()):  # more keys than a file can name
        for message in recording.messages(tuple(f"*/{said}" for said in _KNOWN), 0.0, before_s):
            mission.take(message)
        return mission
    if before_ns > 0:
        for message in recording.messages(_QUESTIONS, max(0.0, at_s - ANSWERED_WITHIN_S), before_s):
            mission.take(message)
        _Restoring(recording, classes, before_ns).fill(mission)
    return mission


class _Restoring:
    def __init__(self, recording: Recording, classes: Mapping[str, type[Message]], before_ns: int) -> None:
        self._recording, self._classes, self._before_ns = recording, classes, before_ns
        named = recording.channels()
        self._channels = {number: one for number, one in named.items() if _conversation(one[0]) in _KNOWN}
        self._newest = dict[int, MessagePlace]()
        missing = {*self._channels}
        for place, number in recording.newest_first(missing, before_ns):
            self._newest[number] = place
            missing.discard(number)
        self._spoke = dict[str, MessagePlace]()
        """Address → place of the newest message at its keys."""
        for number, place in self._newest.items():
            address = address_of(named[number][0])
            self._spoke[address] = max(place, self._spoke.get(address, _FIRST))
        self._rose, self._fell = self._tokens()

    def fill(self, mission: RecordedMission) -> None:
        """Set the state, except for the questions that are open."""
        before_s = (self._before_ns - 1) / NS
        falls = {address for address, fell in self._fell.items() if fell == self._spoke[address]}
        states = sorted(self._states(), key=lambda one: one[0])
        mission.restore(
            at_s=max(0, max(self._spoke.values(), default=_FIRST).at_ns) / NS,
            present=sorted(self._rose, key=self._rose.__getitem__),
            there=[one for one in (NAMESERVER, LAUNCHER, *self._spoke) if one not in falls],
            states={said.address: said for _place, said in states},
            newest=self._newest_states(),
            events=self._events(),
            decisions=since_last_snapshot(self._recording, before_s),
        )
        mission.earlier = EarlierAnswers(self._recording, self._classes, self._before_ns).find

    def _tokens(self) -> tuple[dict[str, MessagePlace], dict[str, MessagePlace]]:
        """Return the present addresses with the rises of their tokens, and last falls after an address's last state."""
        rose, fell, stated = dict[str, MessagePlace](), dict[str, MessagePlace](), dict[str, MessagePlace]()
        for number in self._of_states():
            address = address_of(self._channels[number][0])
            stated[address] = max(self._newest[number], stated.get(address, _FIRST))
        tokens = {*self._of(Conversation.ALIVE)}
        for place, number in self._recording.newest_first(tokens, self._before_ns):
            address = address_of(self._channels[number][0])
            match self._said(number, place):
                case Presence(alive=True) if address not in fell:
                    rose.setdefault(address, place)
                case Presence(alive=False):
                    fell.setdefault(address, place)
            if address in fell or place < stated.get(address, _FIRST):
                tokens.discard(number)
        return rose, fell

    def _states(self) -> Iterator[tuple[MessagePlace, ComponentState]]:
        """Yield the newest state from each sender at each key, unless its token has fallen since."""
        for number in self._of_states():
            key, source, _schema = self._channels[number]
            place, said = next(self._readable(number), (_FIRST, None))
            is_own = isinstance(said, ComponentState) and (not _is_asked(key) or source == said.address)
            if isinstance(said, ComponentState) and is_own and place > self._fell.get(said.address, _FIRST):
                yield place, said

    def _readable(self, number: int) -> Iterator[tuple[MessagePlace, Message]]:
        """Yield the messages of a channel that have the form of their class, newest first."""
        newest = self._newest[number]
        if (said := self._said(number, newest)) is not None:
            yield newest, said
        for place, _number in self._recording.newest_first({number}, self._before_ns):
            if place < newest and (said := self._said(number, place)) is not None:
                yield place, said

    def _said(self, number: int, place: MessagePlace) -> Message | None:
        return message_as_sent(self._classes, self._recording.at(number, place))

    def _of_states(self) -> list[int]:
        return [one for one in self._newest if self._channels[one][2] == _STATE]

    def _newest_states(self) -> list[Recorded]:
        """Return the newest message of each key and schema that carries a state."""
        newest = dict[tuple[str, str], tuple[MessagePlace, int]]()
        for number in self._of(*STATES):
            key, _source, schema = self._channels[number]
            newest[key, schema] = max((self._newest[number], number), newest.get((key, schema), (_FIRST, 0)))
        return [self._recording.at(number, place) for place, number in sorted(newest.values())]

    def _events(self) -> list[StoryEvent]:
        """Return the newest events, oldest first, one more than are kept."""
        found, channels = list[StoryEvent](), {*self._of(Conversation.LOG, Conversation.OPERATORS)}
        for place, number in self._recording.newest_first(channels, self._before_ns):
            message = self._recording.at(number, place)
            match message_as_sent(self._classes, message):
                case OperatorActed() as act:
                    found.append(act.event(message.source, message.cause))
                case StoryEvent() as event if _conversation(message.key) is Conversation.LOG:
                    found.append(event)
            if len(found) > EVENTS_KEPT:
                break
        return found[::-1]

    def _of(self, *conversations: Conversation) -> list[int]:
        """Return the channels of these conversations that have messages before the time."""
        return [number for number in self._newest if _conversation(self._channels[number][0]) in conversations]


class EarlierAnswers:
    """The answers to questions from before an instant; the recording is read backwards for a question of that kind.

    Args:
        before_ns: The instant; later questions and answers are not looked at.
    """

    def __init__(self, recording: Recording, classes: Mapping[str, type[Message]], before_ns: int) -> None:
        self._recording, self._classes, self._before_ns = recording, classes, before_ns
        self._found = dict[tuple[str, str, bytes], Message | None]()

    def find(self, address: str, question: Message) -> Message | None:
        """Return the answer to the newest equal question that was answered; None: there is none.

        Raises:
            NoRecording: The recording is damaged.
        """
        wanted = asked_of(address, question)
        if wanted not in self._found:
            asked = (one for one in self._questions(address, schema_of(type(question))) if self._is(one, wanted))
            answers = (self._answer(address, one) for one in asked)
            self._found[wanted] = next((one for one in answers if one is not None), None)
        return self._found[wanted]

    def _questions(self, address: str, schema: str) -> Iterator[Recorded]:
        """Yield the questions of a class to a component, newest first."""
        channels = {
            number
            for number, (key, _source, of) in self._recording.channels().items()
            if of == schema and _is_asked(key) and address_of(key) == address
        }
        for place, number in self._recording.newest_first(channels, self._before_ns):
            yield self._recording.at(number, place)

    def _is(self, message: Recorded, wanted: tuple[str, str, bytes]) -> bool:
        said = message_as_sent(self._classes, message)
        return said is not None and asked_of(wanted[0], said) == wanted

    def _answer(self, address: str, question: Recorded) -> Message | None:
        until_s = min((self._before_ns - 1) / NS, question.at_s + ANSWERED_WITHIN_S)
        for message in self._recording.messages((question.key,), question.at_s, until_s, address):
            if message.cause == question.id and (said := message_as_sent(self._classes, message)) is not None:
                return said
        return None


def _is_asked(key: str) -> bool:
    return _conversation(key) is Conversation.ASK


def _conversation(key: str) -> Conversation | None:
    said = key.rpartition("/")[2]
    return Conversation(said) if said in _KNOWN else None
