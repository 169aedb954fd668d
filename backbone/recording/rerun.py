"""Rerun: runs one component for real, on virtual time; the recording supplies everything around it.

The component gets the recorded publications, tokens and questions at their recorded times. Its questions get the
recorded answers, not earlier than recorded. All its messages are kept, to be compared with those of the recorded
component.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

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
from backbone.recording.hearing import Hearing, to_overhear
from backbone.recording.known_messages import message_classes
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded, Recording, heard_now
from backbone.recording.recorded_mission import NotAnswered, asked_of
from backbone.recording.revival import message_as_sent
from backbone.wire import WIRE_VERSION, Envelope, Message, Refused, schema_of, write

MOST_WAITING_BYTES = 2**31
NANOSECOND_S = 1e-9  # MCAP specification: times are whole nanoseconds
Known = Mapping[str, type[Message]]
ComponentType = Callable[[Launch, Bus, Clock], AnyComponent]


class NoSuchComponent(Refusal):
    """The recording lacks what is needed to run this component."""

    code = "recording.no_component"
    remedy = "Name a component of 'scout-backbone recording keys FILE'; record it from its start on: up --record."


@dataclass(frozen=True, slots=True)
class Rerun:
    """The messages of a component that ran again.

    Attributes:
        class_path: Its class.
        said: The messages in the order of sending.
        fell: The exception that ended the component early; None: it ran to the end.
    """

    class_path: str
    said: tuple[Recorded, ...]
    fell: BaseException | None


def launch_of(recording: Recording, classes: Known, name: str) -> Launch:
    """Return the launch of the first component of this name, without an endpoint.

    Raises:
        NoSuchComponent: The recording lacks its state, its parameters or the mission's types.
    """
    state: ComponentState | None = None
    parameters: Parameters | None = None
    types: dict[str, str] = {}
    seen: set[str] = set()
    incarnation = _incarnation(recording, name)
    for message in recording.messages():
        if message.schema in (schema_of(ComponentState), schema_of(Parameters), schema_of(Types)):
            said = message_as_sent(classes, message)
            match said:
                case ComponentState():
                    seen.add(component_of(said.address))
                    if state is None and component_of(said.address) == name:
                        state = said
                case Parameters() if parameters is None and component_of(message.source) == name:
                    parameters = said
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
            )
    lacks = "state" if state is None else "parameters" if parameters is None else f"type {state.type!r}"
    raise NoSuchComponent(f"the recording has no {lacks} of {name!r}{did_you_mean(name, seen)}")


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


def run_again(recording: Recording, classes: Known, launch: Launch, component: ComponentType) -> Rerun:
    """Run the component on the recording, from its first to its last message; return its messages.

    Args:
        recording: Must not be used elsewhere meanwhile.
        classes: Known message classes, by schema.
        launch: Launch of the component.
        component: Its class.
    """
    return run_virtual(_run(recording, classes, launch, component))


async def _run(recording: Recording, classes: Known, launch: Launch, make: ComponentType) -> Rerun:
    clock = VirtualClock()
    network = _RecordedNetwork(recording, classes, launch)
    await clock.sleep_until_s(network.begin_s)
    ear, bus = network.join("backbone/recorder", clock), network.join(launch.address, clock)
    for conversation in to_overhear(()):
        ear.overhear(conversation, partial(network.heard, clock), MOST_WAITING_BYTES)
    current_cause.set(network.begin_cause)
    component = make(launch, bus, clock)
    component.pid = network.pid
    living = asyncio.create_task(component.run(), name=f"rerun of {launch.name}")
    playing = asyncio.create_task(network.play(ear, clock), name="the recording")
    await asyncio.wait({living, playing}, return_when=asyncio.FIRST_COMPLETED)
    fell = living.exception() if living.done() and not living.cancelled() else None
    for task in (living, playing):
        task.cancel()
    await asyncio.wait({living, playing})
    await ear.close()
    await bus.close()
    if not playing.cancelled():
        playing.result()
    return Rerun(launch.class_path, tuple(network.said), fell)


class _RecordedNetwork(LocalNetwork):
    """A mission around one component; all other components are recorded."""

    def __init__(self, recording: Recording, classes: Known, launch: Launch) -> None:
        super().__init__(launch.mission)
        self.said: list[Recorded] = []
        self._recording, self._classes, self._own = recording, classes, launch.address
        self._hearing = Hearing(classes)
        self._tokens: dict[str, Subscription] = {}
        self._answers: dict[tuple[str, str, bytes], deque[tuple[float, Message]]] = defaultdict(deque)
        self.begin_s, self.end_s, self.pid = -1.0, 0.0, 0
        self.begin_cause = ""
        self._learn()

    def _learn(self) -> None:
        """Find out when the component lived, and which answers it got."""
        asked: dict[str, tuple[str, Message]] = {}
        for message in self._recording.messages():
            address, is_asked = address_of(message.key), message.key.endswith(f"/{Conversation.ASK}")
            if message.source == self._own:
                if self.begin_s < 0:
                    self.begin_s = _sent_s(message)
                    self.begin_cause = message.cause if message.schema == schema_of(Register) else ""
                self.end_s = _sent_s(message)
                if is_asked and address != self._own and (said := message_as_sent(self._classes, message)) is not None:
                    asked[message.id] = address, said
                if not self.pid and message.schema == schema_of(ComponentState):
                    self.pid = int(message.body["pid"])
            elif is_asked and message.cause in asked and asked[message.cause][0] == message.source == address:
                answer = message_as_sent(self._classes, message)
                if answer is not None:
                    self._answers[asked_of(*asked.pop(message.cause))].append((_sent_s(message), answer))

    async def play(self, bus: Bus, clock: Clock) -> None:
        """Publish the others' messages at their recorded times; return after the component's last recorded message."""
        for message in self._recording.messages(until_s=self.end_s):
            await clock.sleep_until_s(_sent_s(message))
            if message.source != self._own:
                self._play(bus, message)
        await clock.sleep_until_s(self.end_s)

    def _play(self, bus: Bus, message: Recorded) -> None:
        address, conversation = address_of(message.key), message.key.rpartition("/")[2]
        said = message_as_sent(self._classes, message)
        if isinstance(said, Presence):
            token = self._tokens.pop(address, None)
            if token is not None:
                token.close()
            if said.alive and address != self._own:
                self._tokens[address] = bus.declare_alive(address)
        elif said is not None and conversation == Conversation.ASK:
            if address == self._own and address in self.servers:
                LocalNetwork.carry_question(self, address, _sent(message, said), lambda _answer: None)
        elif said is not None:
            bus.pass_on(address, Conversation(conversation), _sent(message, said))

    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Give the component's question its recorded answer."""
        self._keep(key_of(self.mission, address, Conversation.ASK), write(asked), asked.stamp_s)
        known = self._answers[asked_of(address, asked.body)]
        loop = asyncio.get_running_loop()
        if known:
            at_s, answer = known.popleft() if len(known) > 1 else known[0]
        elif isinstance(asked.body, Register):
            at_s, answer = loop.time(), Registered()
        else:
            name = type(asked.body).__name__
            at_s, answer = loop.time(), Refused.of(NotAnswered(f"{address} was not asked {name} with these values"))
        envelope = Envelope(WIRE_VERSION, address, 0, max(at_s, loop.time()), asked.id, answer)
        loop.call_at(max(at_s, loop.time()), answered, envelope)

    def heard(self, clock: Clock, key: str, raw: bytes) -> None:
        """Keep a message that the component published or answered."""
        self._keep(key, raw, clock.now_s())

    def _keep(self, key: str, raw: bytes, at_s: float) -> None:
        for said_at, message in self._hearing.heard(key, raw, at_s):
            if message.source == self._own:
                self.said.append(heard_now(said_at, message, at_s))


def _sent_s(message: Recorded) -> float:
    """Return the time of sending, to the last digit, if it is credible."""
    return message.stamp_s if abs(message.stamp_s - message.at_s) < NANOSECOND_S else message.at_s


def _sent(message: Recorded, said: Message) -> Envelope[Message]:
    return Envelope(WIRE_VERSION, message.source, message.sequence, message.stamp_s, message.cause, said)
