"""Rerun: runs components for real, on virtual time; the recording supplies everything around them.

They get the recorded publications, tokens and questions at their recorded times. Each of their questions gets its
recorded answer, not earlier than recorded; a question that was recorded without an answer gets none again. Real
components send new messages to each other. All their messages are kept, to be compared with the recorded ones.
"""

from __future__ import annotations

import asyncio
from bisect import insort
from collections import defaultdict, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import NamedTuple

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Clock, Subscription, current_cause
from backbone.bus.local_bus import Answered, LocalNetwork
from backbone.component.component import AnyComponent
from backbone.component.launch import Launch
from backbone.component.messages import ComponentState, Parameters, Register, Registered, Stop
from backbone.component_database.messages import Types
from backbone.errors import Refusal
from backbone.keys import Conversation, address_of
from backbone.keys import key as key_of
from backbone.naming import Subsystem, component_of, did_you_mean
from backbone.placer.messages import Start
from backbone.recording.hearing import Hearing, to_overhear
from backbone.recording.known_messages import message_classes
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded, Recording, heard_now
from backbone.recording.recorded_mission import NotAnswered, asked_of
from backbone.recording.revival import envelope_as_sent, message_as_sent
from backbone.wire import WIRE_VERSION, Envelope, Message, Refused, schema_of, write

MOST_WAITING_BYTES = 2**31
NANOSECOND_S = 1e-9  # MCAP specification: times are whole nanoseconds
Known = Mapping[str, type[Message]]
ComponentType = Callable[[Launch, Bus, Clock], AnyComponent]
_Answer = tuple[float, Message | None]
"""Time and message of an answer; for a question without an answer, its own time and None."""
_TELL_OF_LAUNCHES = frozenset(schema_of(each) for each in (ComponentState, Parameters, Start, Types))


class NoSuchComponent(Refusal):
    """The recording lacks what is needed to run this component."""

    code = "recording.no_component"
    remedy = "Name a component of 'scout-backbone recording keys FILE'; record it from its start on: up --record."


class RealComponent(NamedTuple):
    """A component that runs again: its launch, and its class, which may be another one than the recorded."""

    launch: Launch
    make: ComponentType


@dataclass(frozen=True, slots=True)
class Rerun:
    """What happened while components ran again.

    Attributes:
        said: Their messages in the order of sending.
        fell: Name of each component that an exception ended early → the exception.
    """

    said: tuple[Recorded, ...]
    fell: dict[str, BaseException]


def launch_of(recording: Recording, classes: Known, name: str) -> Launch:
    """Return the launch of the first component of this name, without an endpoint.

    Raises:
        NoSuchComponent: The recording lacks its state, its parameters or the mission's types.
    """
    state: ComponentState | None = None
    parameters: Parameters | None = None
    types: dict[str, str] = {}
    seen: set[str] = set()
    order_id = ""
    incarnation = _incarnation(recording, name)
    for message in recording.messages():
        if message.schema in _TELL_OF_LAUNCHES:
            said = message_as_sent(classes, message)
            match said:
                case ComponentState():
                    seen.add(component_of(said.address))
                    if state is None and component_of(said.address) == name:
                        state = said
                case Parameters() if parameters is None and component_of(message.source) == name:
                    parameters = said
                case Start() if said.name == name:
                    order_id = said.order_id
                case Types():
                    types |= {one.component_type.name: one.component_type.class_path for one in said.types}
        if state is not None and parameters is not None and state.type in types:
            return Launch(
                recording.contents().about.get("mission", "recording"),
                Subsystem(state.address.partition("/")[0]),
                name,
                state.type,
                types[state.type],
                state.host,
                "",
                0.0,
                1.0,
                parameters.values,
                state.requester,
                incarnation=incarnation,
                order_id=order_id,
            )
    lacks = "state" if state is None else "parameters" if parameters is None else f"type {state.type!r}"
    hint = did_you_mean(name, seen) if state is None else ""
    raise NoSuchComponent(f"the recording has no {lacks} of {name!r}{hint}")


def _incarnation(recording: Recording, name: str) -> str:
    """Return the incarnation named in the order that stopped the component; empty: no such order was recorded."""
    stops = (one for one in recording.messages((f"*/{name}/{Conversation.ASK}",)) if one.schema == schema_of(Stop))
    found = next(stops, None)
    return str(found.body["incarnation"]) if found is not None else ""


def classes_of(launch: Launch) -> Known:
    """Return the message classes, by schema, with those that the component and its modules declare; imports them."""
    given = launch.parameters.get("modules", ())  # of an execution unit
    paths = [one["class_path"] for one in given if isinstance(one, dict) and "class_path" in one]
    return message_classes(path.partition(":")[0] for path in (launch.class_path, *paths))


def run_again(recording: Recording, classes: Known, components: Sequence[RealComponent]) -> Rerun:
    """Run components on the recording, from their first to their last message, or until one falls.

    Args:
        recording: Must not be used elsewhere meanwhile.
        classes: Known message classes, by schema.
        components: At least one.
    """
    return run_virtual(_run(recording, classes, components))


async def _run(recording: Recording, classes: Known, components: Sequence[RealComponent]) -> Rerun:
    clock = VirtualClock()
    network = _RecordedNetwork(recording, classes, [one.launch for one in components])
    await clock.sleep_until_s(network.begin_s)
    ear = network.join("backbone/recorder", clock)
    for conversation in to_overhear(()):
        ear.overhear(conversation, partial(network.heard, clock), MOST_WAITING_BYTES)
    living = {
        one.launch.name: asyncio.create_task(_live(network, clock, one), name=f"rerun of {one.launch.name}")
        for one in components
    }
    playing = asyncio.create_task(network.play(ear, clock), name="the recording")
    while not playing.done() and all(_bug_of(task) is None for task in living.values()):
        going_on = [task for task in (playing, *living.values()) if not task.done()]
        await asyncio.wait(going_on, return_when=asyncio.FIRST_COMPLETED)
    fell = {name: bug for name, task in living.items() if (bug := _bug_of(task)) is not None}
    for task in (playing, *living.values()):
        task.cancel()
    await asyncio.wait({playing, *living.values()})
    await ear.close()
    if not playing.cancelled():
        playing.result()
    return Rerun(tuple(network.said), fell)


async def _live(network: _RecordedNetwork, clock: Clock, component: RealComponent) -> None:
    """Run a component from its first recorded message on."""
    life = network.lives[component.launch.address]
    if clock.now_s() < life.begin_s:
        await clock.sleep_until_s(life.begin_s)
    bus = network.join(component.launch.address, clock)
    try:
        current_cause.set(life.begin_cause)
        made = component.make(component.launch, bus, clock)
        made.pid, made.start_number = life.pid, life.start
        await made.run()
    finally:
        await bus.close()


def _bug_of(task: asyncio.Task[None]) -> BaseException | None:
    return task.exception() if task.done() and not task.cancelled() else None


@dataclass(slots=True)
class _RecordedLife:
    """The recorded life of a component: times of its first and last message, cause of the first, pid, start."""

    begin_s: float = -1.0
    end_s: float = 0.0
    begin_cause: str = ""
    pid: int = 0
    start: int = 0


class _RecordedNetwork(LocalNetwork):
    """A mission around some real components; all other components are recorded."""

    def __init__(self, recording: Recording, classes: Known, launches: Sequence[Launch]) -> None:
        super().__init__(launches[0].mission)
        self.said: list[Recorded] = []
        self.lives = {launch.address: _RecordedLife() for launch in launches}
        self._recording, self._classes = recording, classes
        self._hearing = Hearing(classes)
        self._tokens: dict[str, Subscription] = {}
        self._answers: dict[tuple[str, tuple[str, str, bytes]], deque[_Answer]] = defaultdict(deque)
        self._learn()
        self.begin_s = min(life.begin_s for life in self.lives.values())

    def _learn(self) -> None:
        """Find out when the components lived, and which answers the recorded ones gave them."""
        asked: dict[str, tuple[float, str, str, Message]] = {}  # id → time, asker, asked component, question
        for message in self._recording.messages():
            address, is_asked = address_of(message.key), message.key.endswith(f"/{Conversation.ASK}")
            life = self.lives.get(message.source)
            if life is not None:
                if life.begin_s < 0:
                    life.begin_s = _sent_s(message)
                    life.begin_cause = message.cause if message.schema == schema_of(Register) else ""
                life.end_s = _sent_s(message)
                is_elsewhere = is_asked and address not in self.lives
                if is_elsewhere and (said := message_as_sent(self._classes, message)) is not None:
                    asked[message.id] = _sent_s(message), message.source, address, said
                if not life.pid and message.schema == schema_of(ComponentState):
                    life.pid, life.start = int(message.body["pid"]), int(message.body.get("start", 0))
            elif is_asked and message.cause in asked and asked[message.cause][2] == message.source == address:
                answer = message_as_sent(self._classes, message)
                if answer is not None:
                    _asked_s, asker, _address, question = asked.pop(message.cause)
                    self._answers[asker, asked_of(address, question)].append((_sent_s(message), answer))
        for asked_s, asker, address, question in asked.values():
            known = self._answers[asker, asked_of(address, question)]
            insort(known, (asked_s, None), key=itemgetter(0))

    async def play(self, bus: Bus, clock: Clock) -> None:
        """Publish the others' messages at their recorded times; return after the last message of a real component.

        Of the messages sent before the first of them began, only tokens have an effect: none of them got the others.
        """
        end_s = max(life.end_s for life in self.lives.values())
        for message in self._recording.messages(until_s=end_s):
            at_s = _sent_s(message)
            if message.source in self.lives or (at_s < self.begin_s and message.schema != schema_of(Presence)):
                continue
            await clock.sleep_until_s(at_s)
            self._play(bus, message)
        await clock.sleep_until_s(end_s)

    def _play(self, bus: Bus, message: Recorded) -> None:
        address, conversation = address_of(message.key), message.key.rpartition("/")[2]
        said, is_real = message_as_sent(self._classes, message), address in self.lives
        if isinstance(said, Presence):
            token = self._tokens.pop(address, None)
            if token is not None:
                token.close()
            if said.alive and not is_real:
                self._tokens[address] = bus.declare_alive(address)
        elif said is not None and conversation == Conversation.ASK:
            if is_real and address in self.servers:
                super().carry_question(address, envelope_as_sent(message, said), lambda _answer: None)
        elif said is not None:
            bus.pass_on(address, Conversation(conversation), envelope_as_sent(message, said))

    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Give a question to a real component, or its recorded answer."""
        if address in self.lives:
            super().carry_question(address, asked, answered)
            return
        known = self._answers[asked.source, asked_of(address, asked.body)]
        loop = asyncio.get_running_loop()
        answer: Message | None
        if known:
            at_s, answer = known.popleft() if len(known) > 1 else known[0]
            if answer is None:
                answered(None)  # the asker's bus copies the question
                return
        elif isinstance(asked.body, Register):
            at_s, answer = loop.time(), Registered()
        else:
            name = type(asked.body).__name__
            at_s, answer = loop.time(), Refused.of(NotAnswered(f"{address} was not asked {name} with these values"))
        self._keep(key_of(self.mission, address, Conversation.ASK), write(asked), asked.stamp_s)
        envelope = Envelope(WIRE_VERSION, address, 0, max(at_s, loop.time()), asked.id, answer)
        loop.call_at(max(at_s, loop.time()), answered, envelope)

    def heard(self, clock: Clock, key: str, raw: bytes) -> None:
        """Keep a message that a real component published, asked of another real one, or answered."""
        self._keep(key, raw, clock.now_s())

    def _keep(self, key: str, raw: bytes, at_s: float) -> None:
        for said_at, message in self._hearing.heard(key, raw, at_s):
            if message.source in self.lives:
                self.said.append(heard_now(said_at, message, at_s))


def _sent_s(message: Recorded) -> float:
    """Return the time of sending, to the last digit, if it is credible."""
    return message.stamp_s if abs(message.stamp_s - message.at_s) < NANOSECOND_S else message.at_s
