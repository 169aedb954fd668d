"""A recording is played as it was said, and its mission answers what it answered."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from small_recordings import CLASSES, SCOUT, Said, recorded

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Clock
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import (
    AskParameters,
    AskState,
    ComponentState,
    LifeState,
    LogLevel,
    Parameters,
    Register,
    Registered,
    Story,
    StoryEvent,
)
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.launcher.ending_messages import EndMission, MissionEnding
from backbone.mission_log.log import AskLog, Log
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.recording.playback import Playback
from backbone.recording.player import Player
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorded_mission import NotAnswered, TakesNoCommands
from backbone.wire import Envelope, Message
from resource_pool.commands import Move


def event(number: int) -> StoryEvent:
    return StoryEvent(float(number), SCOUT, f"event {number}", "scout1", "", LogLevel.INFO)


def state(doing: str) -> ComponentState:
    return ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, doing)


def recording_of(*said: Said) -> Recording:
    return Recording(recorded(said))


MORNING = (
    Said(1.0, SCOUT, Conversation.ALIVE, Presence(True), ""),
    Said(1.1, SCOUT, Conversation.STATUS, state("drives")),
    Said(1.2, SCOUT, Conversation.ASK, AskParameters(), "ui_console/anna"),
    Said(1.3, SCOUT, Conversation.ASK, Parameters({"speed": 1}), SCOUT, "ui_console/anna#1"),
    Said(2.0, SCOUT, Conversation.LOG, event(2)),
    Said(3.0, SCOUT, Conversation.STATUS, state("stands")),
    Said(4.0, SCOUT, Conversation.LOG, event(4)),
    Said(5.0, SCOUT, Conversation.ALIVE, Presence(False), ""),
)


def played(
    recording: Recording,
    scene: Callable[[LocalBus, VirtualClock, Player], Awaitable[None]] | None = None,
    *,
    since_s: float = 0.0,
    classes: Mapping[str, type[Message]] = CLASSES,
    speed: float = 0.0,
    **options: Any,
) -> list[tuple[float, str, Envelope[Message]]]:
    """Return what was heard, with times, while the recording was played beside the scene.

    Args:
        speed: Mission seconds in one of the loop; 0: by a clock of the loop.
    """
    heard: list[tuple[float, str, Envelope[Message]]] = []

    async def play() -> None:
        clock: Clock = VirtualClock()
        await clock.sleep_s(since_s)
        if speed:
            clock = Playback(clock, since_s, recording.contents().end_s + 1.0)
            clock.play(speed)
        network = LocalNetwork("night")
        bus, ear = network.join("backbone/replay", clock), network.join("ui_console/ear", clock)
        for conversation in (Conversation.LOG, Conversation.STATUS):
            ear.subscribe(
                "*/*",
                conversation,
                StoryEvent | ComponentState,
                lambda envelope, said=conversation: heard.append((clock.now_s(), said, envelope)),
            )
        ear.watch_alive("*/*", lambda address, alive: tokens.append((address, alive)))
        player = Player(bus, clock, recording, classes, since_s=since_s, **options)
        player.catch_up()
        player.begin()
        running = asyncio.create_task(player.run())
        if scene is not None:
            await scene(ear, clock, player)
        await running
        await clock.sleep_s(0.01)
        await ear.close()
        await bus.close()

    tokens.clear()
    run_virtual(play())
    return heard


tokens: list[tuple[str, bool]] = []


class CountingClasses(dict[str, type[Message]]):
    """Message classes that count how many messages were restored."""

    restored = 0

    def get(self, schema: str, default: Any = None) -> Any:
        self.restored += 1
        return super().get(schema, default)


def restored_by(minutes: int) -> int:
    """Return how many messages are restored for a replay from the end of a mission of so many minutes."""
    said = [
        one
        for number, at_s in enumerate(range(1, 60 * minutes, 5), 1)
        for one in (
            Said(at_s, SCOUT, Conversation.ALIVE, Presence(True), ""),
            Said(at_s, SCOUT, Conversation.STATUS, state(f"round {number}")),
            Said(at_s, SCOUT, Conversation.ASK, AskParameters(), f"ui_console/anna-{number % 3}"),
            Said(at_s, SCOUT, Conversation.ASK, Parameters({"n": number}), SCOUT, f"ui_console/anna-{number % 3}#1"),
        )
    ]
    classes = CountingClasses(CLASSES)
    clock = Playback(VirtualClock(), 60.0 * minutes, 60.0 * minutes)
    bus = LocalNetwork("night").join("backbone/replay", clock)
    player = Player(bus, clock, recording_of(*said), classes, since_s=60.0 * minutes)
    player.catch_up()
    return classes.restored


def test_a_replay_from_a_late_instant_restores_no_more_messages_than_from_an_early_one():
    """From 2590 s on, 121 743 messages were restored; this took half a minute."""
    assert restored_by(minutes=200) == restored_by(minutes=5)


def test_a_question_that_was_open_at_the_begin_gets_its_recorded_answer():
    late = (
        Said(1.0, SCOUT, Conversation.ASK, AskParameters(), "ui_console/anna"),
        Said(4.0, SCOUT, Conversation.LOG, event(4)),
        Said(5.0, SCOUT, Conversation.ASK, Parameters({"speed": 2}), SCOUT, "ui_console/anna#1"),
        Said(7.0, SCOUT, Conversation.LOG, event(7)),
    )

    async def scene(bus: LocalBus, clock: VirtualClock, _player: Player) -> None:
        with pytest.raises(NotAnswered):
            await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0)
        await clock.sleep_until_s(6.0)
        assert await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0) == Parameters({"speed": 2})

    played(recording_of(*late), scene, since_s=3.0)


@settings(max_examples=share(60))
@given(times=st.lists(st.floats(0.0, 50.0), min_size=1, max_size=30), since_s=st.sampled_from([0.0, 10.0]))
def test_each_publication_comes_at_its_time_in_order_with_its_sender_and_number(times: list[float], since_s: float):
    times.sort()
    recording = recording_of(*(Said(at_s, SCOUT, Conversation.LOG, event(n)) for n, at_s in enumerate(times)))
    heard = [(at_s, envelope) for at_s, said, envelope in played(recording, since_s=since_s)]
    expected = [(at_s, n + 1) for n, at_s in enumerate(times) if at_s >= since_s]
    assert [envelope.sequence for _at_s, envelope in heard] == [number for _at_s, number in expected]
    assert [at_s for at_s, _envelope in heard] == pytest.approx([at_s for at_s, _number in expected], abs=1e-6)
    assert all(envelope.source == SCOUT and envelope.stamp_s <= at_s + 1e-9 for at_s, envelope in heard)


@pytest.mark.parametrize(("since_s", "speed", "expected_s"), [(0.5, 0.0, 0.95), (0.5, 2.0, 0.9), (0.98, 0.0, 0.98)])
def test_the_replay_is_announced_a_moment_before_the_first_message(since_s: float, speed: float, expected_s: float):
    announced_s: list[float] = []

    async def scene(_ear: LocalBus, clock: VirtualClock, player: Player) -> None:
        player.announces = lambda: announced_s.append(clock.now_s())

    played(recording_of(*MORNING), scene, since_s=since_s, speed=speed)
    assert announced_s == pytest.approx([expected_s], abs=1e-5)


def test_steps_are_not_announced():
    announced: list[bool] = []

    async def scene(_ear: LocalBus, _clock: VirtualClock, player: Player) -> None:
        player.announces = lambda: announced.append(True)

    async def step(_message: Recorded) -> None:
        assert not announced

    played(recording_of(*MORNING), scene, next_step=step)
    assert not announced


def test_tokens_rise_and_fall():
    played(recording_of(*MORNING))
    assert tokens == [(SCOUT, True), (SCOUT, False)]


def test_who_comes_in_the_middle_is_told_the_newest_states():
    heard = played(recording_of(*MORNING), since_s=3.5)
    assert [(said, envelope.body) for _at_s, said, envelope in heard] == [
        (Conversation.STATUS, state("stands")),
        (Conversation.LOG, event(4)),
    ]
    assert tokens == [(SCOUT, True), (SCOUT, False)]


def test_only_keys_that_are_meant_are_played():
    heard = played(recording_of(*MORNING), keys=("*/log",))
    assert [said for _at_s, said, _envelope in heard] == [Conversation.LOG, Conversation.LOG]


def test_step_by_step_the_order_is_the_same():
    shown: list[str] = []

    async def step(message: Recorded) -> None:
        shown.append(message.schema)
        await asyncio.sleep(0.5)

    heard = played(recording_of(*MORNING), next_step=step)
    assert shown == ["ComponentState/2", "StoryEvent/1", "ComponentState/2", "StoryEvent/1"]
    assert [envelope.sequence for _at_s, _said, envelope in heard] == [1, 3, 4, 5]


@settings(max_examples=share(40))
@given(times=st.lists(st.sampled_from([0.0, 0.1, 0.101, 0.2, 7.0]), min_size=1, max_size=30), data=st.data())
def test_at_any_speed_and_step_by_step_the_order_is_the_same(times: list[float], data: st.DataObject):
    """Also of messages of one instant, from several senders."""
    senders = data.draw(st.lists(st.sampled_from([SCOUT, "resource_pool/scout2"]), min_size=30, max_size=30))
    file = recorded(
        Said(at_s, source, Conversation.LOG, event(n), source)
        for n, (at_s, source) in enumerate(zip(sorted(times), senders, strict=False))
    )

    async def step(_message: Recorded) -> None:
        await asyncio.sleep(0.0)

    ways: list[dict[str, Any]] = [{}, {"speed": 0.5}, {"speed": 10.0}, {"speed": 100.0}, {"next_step": step}]
    orders = [[one.id for _at_s, _said, one in played(Recording(file), **way)] for way in ways]
    assert len(orders[0]) == len(times)
    assert all(order == orders[0] for order in orders)


def test_questions_get_the_answers_of_that_time():
    async def scene(bus: LocalBus, clock: VirtualClock, _player: Player) -> None:
        with pytest.raises(NotAnswered, match="absent"):
            await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0)
        await clock.sleep_until_s(1.15)
        with pytest.raises(NotAnswered):
            await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0)
        await clock.sleep_until_s(2.5)
        assert await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0) == Parameters({"speed": 1})
        assert await bus.ask(SCOUT, AskState(), ComponentState, within_s=1.0) == state("drives")
        listed = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=1.0)
        assert listed.components == [state("drives")]
        resolved = await bus.ask(NAMESERVER, Resolve("scout1"), Resolved, within_s=1.0)
        assert resolved.component == state("drives")
        log = await bus.ask(LAUNCHER, AskLog(), Log, within_s=1.0)
        assert log.events == [event(2)]
        await clock.sleep_until_s(5.5)
        listed = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=1.0)
        assert listed.components == []
        with pytest.raises(UnknownName):
            await bus.ask(NAMESERVER, Resolve("scout1"), Resolved, within_s=1.0)
        with pytest.raises(NoResponder):
            await bus.ask(SCOUT, AskState(), ComponentState, within_s=1.0)

    played(recording_of(*MORNING), scene)


def test_a_question_that_led_to_another_gets_its_own_answer():
    other = "resource_pool/scout2"
    chain = (
        Said(1.0, SCOUT, Conversation.ASK, AskParameters(), "ui_console/anna"),
        Said(1.1, other, Conversation.ASK, AskParameters(), SCOUT, "ui_console/anna#1"),
        Said(1.2, other, Conversation.ASK, Parameters({"of": 2}), other, f"{SCOUT}#1"),
        Said(1.3, SCOUT, Conversation.ASK, Parameters({"of": 1}), SCOUT, "ui_console/anna#1"),
        Said(3.0, SCOUT, Conversation.LOG, event(3)),
    )

    async def scene(bus: LocalBus, clock: VirtualClock, _player: Player) -> None:
        await clock.sleep_until_s(2.0)
        assert await bus.ask(SCOUT, AskParameters(), Parameters, within_s=1.0) == Parameters({"of": 1})
        assert await bus.ask(other, AskParameters(), Parameters, within_s=1.0) == Parameters({"of": 2})

    played(recording_of(*chain), scene)


def test_nothing_can_be_commanded_though_it_was_commanded_then():
    commanded = (
        Said(1.0, SCOUT, Conversation.ASK, Move(0.1, 0.0), "ui_console/anna"),
        Said(1.1, SCOUT, Conversation.ASK, Story([]), SCOUT, "ui_console/anna#1"),
    )

    async def scene(bus: LocalBus, clock: VirtualClock, _player: Player) -> None:
        await clock.sleep_until_s(2.0)
        with pytest.raises(TakesNoCommands):
            await bus.ask(SCOUT, Move(0.1, 0.0), Story, within_s=1.0)

    played(recording_of(*commanded, *MORNING[4:]), scene)


def test_a_console_may_register_and_a_person_may_end_it():
    ended: list[bool] = []

    async def scene(bus: LocalBus, _clock: VirtualClock, player: Player) -> None:
        player.ends = lambda: ended.append(True)
        assert await bus.ask(NAMESERVER, Register(state("")), Registered, within_s=1.0) == Registered()
        assert await bus.ask(LAUNCHER, EndMission(), MissionEnding, within_s=1.0) == MissionEnding(has_components=False)

    played(recording_of(*MORNING), scene)
    assert ended == [True]


def test_a_message_of_an_unknown_class_is_passed_over_and_counted():
    counts: list[tuple[int, int]] = []

    async def count(_ear: LocalBus, clock: VirtualClock, player: Player) -> None:
        await clock.sleep_s(6.0)
        counts.append((player.played, player.left_out))

    known = {schema: kind for schema, kind in CLASSES.items() if kind is not ComponentState}
    heard = played(recording_of(*MORNING), count, classes=known)
    assert [said for _at_s, said, _envelope in heard] == [Conversation.LOG, Conversation.LOG]
    assert counts == [(2, 2)]


def test_who_comes_to_look_is_there_until_it_leaves():
    guest = ComponentState("ui_console/web-1", "console", "base", 8, LifeState.READY, 0.0, "")

    async def scene(bus: LocalBus, clock: VirtualClock, _player: Player) -> None:
        async def there() -> list[str]:
            listed = await bus.ask(NAMESERVER, ListComponents(subsystem="ui_console"), Components, within_s=1.0)
            return [one.address for one in listed.components]

        await clock.sleep_until_s(1.5)
        await bus.ask(NAMESERVER, Register(guest), Registered, within_s=1.0)
        token = bus.declare_alive(guest.address)
        assert await there() == [guest.address]
        token.close()
        await clock.sleep_s(0.1)
        assert await there() == []

    played(recording_of(*MORNING), scene)


def test_as_many_addresses_are_served_as_components_live_at_a_time():
    """In a long recording thousands come and go; each served address costs two threads."""
    served, most = set[str](), 0
    lives = []
    for number in range(300):
        one, at_s = f"ui_console/console-{number}", 1.0 + 3.0 * number
        lives += [
            Said(at_s, one, Conversation.ALIVE, Presence(True), ""),
            Said(at_s + 1.0, one, Conversation.LOG, StoryEvent(at_s, one, "x" * 50_000, "", "", LogLevel.INFO)),
            Said(at_s + 2.0, one, Conversation.ALIVE, Presence(False), ""),
        ]
    serve = LocalBus.serve

    class Watched:
        def __init__(self, address: str, declared: Any) -> None:
            self.address, self.declared = address, declared

        def close(self) -> None:
            served.discard(self.address)
            self.declared.close()

    def watched(bus: LocalBus, address: str, *how: Any) -> Watched:
        nonlocal most
        served.add(address)
        most = max(most, len(served))
        return Watched(address, serve(bus, address, *how))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(LocalBus, "serve", watched)
        played(recording_of(*lives))
    assert len(served) < 5
    assert most < 120  # as many as the player reads ahead, 4 MiB of messages
