"""Player: plays a recording on a bus, as if its mission were up.

Each publication is published as it was sent, at its own mission time. Questions get the answers that the recorded
mission gave; liveliness tokens appear and fall as recorded. Nothing can be commanded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from functools import partial, reduce
from operator import or_

from backbone.addresses import LAUNCHER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.keys import COPIED, Conversation, address_of
from backbone.launcher.ending_messages import EndMission, MissionEnding
from backbone.recording.hearing import is_meant
from backbone.recording.presence import Presence
from backbone.recording.read_ahead import ReadAhead, Ready
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorded_mission import RecordedMission
from backbone.recording.restoring import mission_at
from backbone.recording.revival import envelope_as_sent, message_as_sent
from backbone.wire import Envelope, Message

ANNOUNCED_S = 0.05  # measured: links that were idle for seconds are slow for the first 30 ms; seconds of the machine
TAKE_GAP_S = 0.005  # measured: the first message of a class takes so long, others a tenth; seconds of the machine
_PUBLISHED = frozenset(Conversation) - {Conversation.ASK, Conversation.ALIVE, *COPIED}


class Player:
    """Plays one recording from a mission time on.

    Args:
        bus: Bus with a hub of its own.
        clock: Must show ``since_s`` when ``run`` begins.
        recording: Read while it runs.
        classes: Known message classes, by schema.
        since_s: Mission time at which it begins; earlier messages are known.
        keys: Patterns of the keys whose publications are played; none: all.
        next_step: Awaited before each publication, with the message; None: play in the recorded time.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        recording: Recording,
        classes: Mapping[str, type[Message]],
        *,
        since_s: float,
        keys: tuple[str, ...] = (),
        next_step: Callable[[Recorded], Awaitable[None]] | None = None,
    ) -> None:
        self._bus, self._clock, self._recording = bus, clock, recording
        self._since_s, self._keys, self._next_step = since_s, keys, next_step
        self._classes = classes
        self._mission = RecordedMission(classes)
        self._ahead = ReadAhead(recording, classes, since_s, self._key_ahead)
        self._accepts = reduce(or_, classes.values())
        self._tokens: dict[str, Subscription] = {}
        self._served: dict[str, Subscription] = {}
        self._prepared: set[str] = set()
        self._to_prepare: dict[str, None] = {}  # keys of messages ahead
        self._untaken: deque[Ready] = deque()  # played; the mission's state takes them in a gap, or before an answer
        self.ends: Callable[[], None] = lambda: None
        """Called when a person orders the mission to end."""
        self.announces: Callable[[], None] = lambda: None
        """Called ``ANNOUNCED_S`` before the first message, but not in stepped playing; settable.

        Its publication warms up memory and links, which were idle, for the first message.
        """
        self.rests: Callable[[float], None] = lambda _gap_s: None
        """Called before each message with the seconds of the machine until its time; settable."""
        self.played = 0
        """Number of publications so far."""
        self.left_out = 0
        """Number of recorded publications that were not played, because no class known here has their form."""

    def catch_up(self) -> None:
        """Restore the state before the first message, and decode the next ones. Uses no bus, so it may run in a thread.

        Raises:
            NoRecording: The recording is damaged.
        """
        self._mission = mission_at(self._recording, self._classes, self._since_s)
        self._mission.rate = self._clock.rate
        self._ahead.fill()

    def begin(self) -> None:
        """Answer questions, and publish the present states. Call it after ``catch_up``.

        Prepare the keys of the messages that are read ahead, and later keys in gaps between messages. It takes
        milliseconds to serve an address or to declare a publisher, and the next message may be due earlier.
        """
        for address in self._mission.there:
            self._serve(address)
        while self._to_prepare:
            self._prepare_one()
        for address in self._mission.present:
            self._tokens[address] = self._bus.declare_alive(address)
        self._bus.watch_alive("*/*", lambda address, alive: None if alive else self._mission.gone(address))
        self.say_again()

    def say_again(self) -> None:
        """Publish the newest message of each key that carries a state."""
        self._take_all()
        for message in self._mission.newest():
            said = message_as_sent(self._classes, message)
            if said is not None:
                self._publish(message, said)

    async def run(self) -> None:
        """Play to the end of the recording; afterwards questions are still answered from its last state.

        Raises:
            NoRecording: The recording is damaged from here on.
        """
        if self._next_step is None and (first := self._ahead.first()) is not None:
            await self._clock.sleep_until_s(first.message.at_s - ANNOUNCED_S * self._clock.rate)
            self.announces()
        while (following := self._ahead.first()) is not None:
            await self._wait_until_due(following.message)
            self._ahead.pop()
            self._play(following)
        self._take_all()

    async def _wait_until_due(self, message: Recorded) -> None:
        clock, now_s = self._clock, self._clock.now_s()
        while self._ahead.has_time((message.at_s - now_s) / clock.rate):
            self._ahead.decode_one()
            self._ahead.took((clock.now_s() - now_s) / clock.rate)
            await clock.sleep_s(0.0)
            now_s = clock.now_s()
        while self._to_prepare and message.at_s - now_s > TAKE_GAP_S * clock.rate:
            self._prepare_one()
            now_s = clock.now_s()
        while self._untaken and message.at_s - now_s > TAKE_GAP_S * clock.rate:
            self._take_one()
            now_s = clock.now_s()
        self.rests((message.at_s - now_s) / clock.rate)
        if self._next_step is None:
            await clock.sleep_until_s(message.at_s)
        elif self._is_published(message.key):
            self._take_all()
            await self._next_step(message)

    def _play(self, following: Ready) -> None:
        message, said = following.message, following.said
        if self._is_published(message.key):
            if said is not None:
                self._publish(message, said)
                self.played += 1
            else:
                self.left_out += 1
        if isinstance(said, Presence) and message.key.endswith(f"/{Conversation.ALIVE}"):
            self._token_changed(address_of(message.key), is_up=said.alive)
        self._untaken.append(following)

    def _is_published(self, key: str) -> bool:
        is_wanted = not self._keys or is_meant(key, self._keys)
        return is_wanted and key.rpartition("/")[2] in _PUBLISHED

    def _publish(self, message: Recorded, said: Message) -> None:
        conversation = Conversation(message.key.rpartition("/")[2])
        self._bus.pass_on(address_of(message.key), conversation, envelope_as_sent(message, said))

    def _token_changed(self, address: str, *, is_up: bool) -> None:
        if is_up and address not in self._tokens:
            self._serve(address)
            self._tokens[address] = self._bus.declare_alive(address)
        elif not is_up and address in self._tokens:
            self._tokens.pop(address).close()
            self._served.pop(address).close()

    def _key_ahead(self, key: str) -> None:
        if key and key not in self._prepared:
            self._to_prepare[key] = None

    def _prepare_one(self) -> None:
        key = next(iter(self._to_prepare))
        del self._to_prepare[key]
        self._prepared.add(key)
        self._serve(address_of(key))
        if self._is_published(key):
            self._bus.declare_publisher(address_of(key), Conversation(key.rpartition("/")[2]))

    def _serve(self, address: str) -> None:
        if address not in self._served:
            self._served[address] = self._bus.serve(address, self._accepts, partial(self._answer, address))

    def _take_one(self) -> None:
        taken = self._untaken.popleft()
        self._mission.take_said(taken.message, taken.said)

    def _take_all(self) -> None:
        while self._untaken:
            self._take_one()

    async def _answer(self, address: str, asked: Envelope[Message]) -> Message:
        if isinstance(asked.body, EndMission) and address == LAUNCHER:
            self.ends()
            return MissionEnding(has_components=False)
        self._take_all()
        if self._next_step is None:
            self._mission.now_s = max(self._mission.now_s, self._clock.now_s())
        return self._mission.answer(address, asked.body)
