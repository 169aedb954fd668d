"""A player decodes messages before they are due: at the time of a message it only publishes it."""

from __future__ import annotations

import asyncio
import io
import re
from collections.abc import Iterator
from itertools import accumulate
from typing import Any

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from small_recordings import CLASSES, SCOUT, Said, recorded

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation, address_of
from backbone.recording.chunks import chunk_records
from backbone.recording.player import Player
from backbone.recording.read_ahead import GAP_S, MOST_AHEAD_BYTES, ReadAhead
from backbone.recording.reader import NoRecording, Recorded, Recording
from backbone.recording.recorded_mission import RecordedMission
from backbone.wire import Message

LARGEST = 200_000
gaps_s = st.sampled_from([0.0, GAP_S / 8, 3 * GAP_S, 0.5])
sizes = st.sampled_from([10, 30_000, LARGEST])


def recording_of(messages: list[tuple[float, int]]) -> io.BytesIO:
    """Return the file of a recording with messages of these sizes, each so long after the one before, from 1 s on."""
    times_s = accumulate((gap_s for gap_s, _size in messages), initial=1.0)
    return recorded(
        Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, "x" * size, "", "", LogLevel.INFO))
        for at_s, (_gap_s, size) in zip(times_s, messages, strict=False)
    )


class WatchedRecording(Recording):
    """Notes in ``log`` each message that is decoded."""

    log: list[tuple[str, float, float, int]]

    def records(self, *args: Any, **options: Any) -> Iterator[Any]:
        for found in super().records(*args, **options):
            self.log.append(("decoded", asyncio.get_running_loop().time(), found[3].at_s, len(found[2].data)))
            yield found


class WorkingClock(VirtualClock):
    """Mission time that passes with work, too."""

    def __init__(self) -> None:
        self.worked_s = 0.0

    def now_s(self) -> float:
        return super().now_s() + self.worked_s


def played(file: io.BytesIO, chunk_s: float = 0.0) -> list[tuple[str, float, float, int]]:
    """Return what was decoded and published, in order: what, when, due when, size.

    Args:
        chunk_s: Time that the machine takes to decode a chunk of the file.
    """
    recording = WatchedRecording(file)
    log = recording.log = []
    clock = WorkingClock()

    def pass_on(_bus: LocalBus, _address: str, _conversation: Conversation, envelope: Any) -> None:
        log.append(("published", clock.now_s(), envelope.stamp_s, 0))

    def decode_chunk(*args: Any, **options: Any) -> Any:
        clock.worked_s += chunk_s
        return chunk_records(*args, **options)

    async def play() -> None:
        bus = LocalNetwork("night").join("backbone/replay", clock)
        player = Player(bus, clock, recording, CLASSES, since_s=0.0)
        player.catch_up()
        player.begin()
        await player.run()
        await bus.close()

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(LocalBus, "pass_on", pass_on)
        patched.setattr("backbone.recording.chunks.chunk_records", decode_chunk)
        run_virtual(play())
    return log


@settings(max_examples=share(60))
@given(messages=st.lists(st.tuples(gaps_s, sizes), min_size=1, max_size=40))
def test_nothing_is_decoded_while_a_decoded_message_is_due(messages: list[tuple[float, int]]):
    log = played(recording_of(messages))
    waiting = list[tuple[float, int]]()
    for what, at_s, due_s, size in log:
        if what == "decoded":
            assert not waiting or waiting[0][0] > at_s, "a message was due, and another one was decoded before it"
            waiting.append((due_s, size))
            assert sum(size for _due_s, size in waiting) <= MOST_AHEAD_BYTES + 2 * LARGEST, "memory is bounded"
        else:
            assert waiting.pop(0)[0] == pytest.approx(due_s, abs=1e-6)
            assert at_s == pytest.approx(due_s, abs=1e-6)
    assert not waiting
    assert sum(what == "published" for what, *_rest in log) == len(messages)


@pytest.mark.parametrize("gap_s", [GAP_S / 20, 0.1])
def test_of_a_steady_mission_each_message_is_decoded_before_it_is_due(gap_s: float):
    log = played(recording_of([(gap_s, 5_000)] * 1500))
    assert sum(what == "decoded" for what, *_rest in log) == 1500
    assert all(at_s < due_s - 1e-6 for what, at_s, due_s, _size in log if what == "decoded")


def test_a_chunk_that_takes_five_milliseconds_delays_no_message():
    """Of messages that come in bursts, one each millisecond, many are the first of their chunk."""
    burst = [(0.1, 5_000), *[(0.001, 5_000)] * 30]
    log = played(recording_of(burst * 30), chunk_s=0.005)
    late_s = [at_s - due_s for what, at_s, due_s, _size in log if what == "published"]
    assert len(late_s) == 30 * len(burst)
    assert max(late_s) < 1e-6


def test_a_machine_that_is_slow_for_a_while_decodes_in_longer_gaps_only():
    ahead = ReadAhead(Recording(recording_of([(0.1, LARGEST)] * 40)), CLASSES, 0.0)
    for _message in range(MOST_AHEAD_BYTES // LARGEST // 2):
        ahead.decode_one()
    assert ahead.has_time(GAP_S)
    ahead.took(2 * GAP_S)
    assert not ahead.has_time(GAP_S)
    assert ahead.has_time(5 * GAP_S)
    for _message in range(100):
        ahead.took(GAP_S / 10)
    assert ahead.has_time(GAP_S)


def test_what_takes_long_is_done_before_the_first_message_or_in_a_gap():
    """A component is served, a publisher declared, a message taken; the messages of one instant go before."""
    addresses = [f"resource_pool/scout{number}" for number in range(3)]
    file = recorded(
        Said(at_s, address, Conversation.LOG, StoryEvent(at_s, address, "", "", "", LogLevel.INFO))
        for at_s, address in zip([1.0, 1.0, 3.0], addresses, strict=True)
    )
    log: list[tuple[str, str, float]] = []

    async def play() -> None:
        clock = VirtualClock()
        bus = LocalNetwork("night").join("backbone/replay", clock)
        player = Player(bus, clock, Recording(file), CLASSES, since_s=0.0)
        serve = bus.serve
        bus.serve = lambda address, *how: log.append(("served", address, clock.now_s())) or serve(address, *how)
        bus.declare_publisher = lambda address, _said: log.append(("declared", address, clock.now_s()))
        bus.pass_on = lambda address, *_said: log.append(("said", address, clock.now_s()))
        player.catch_up()
        player.begin()
        await player.run()
        await bus.close()

    def take(_mission: RecordedMission, message: Recorded, _said: Message | None) -> None:
        log.append(("taken", address_of(message.key), asyncio.get_running_loop().time()))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(RecordedMission, "take_said", take)
        run_virtual(play())
    first, second, third = addresses
    begun = len(log) - 6
    assert log[:begun] == [
        ("served", NAMESERVER, 0.0),
        ("served", LAUNCHER, 0.0),
        *((what, address, 0.0) for address in addresses for what in ("served", "declared")),
    ]
    assert log[begun:] == [
        ("said", first, 1.0),
        ("said", second, 1.0),
        ("taken", first, 1.0),
        ("taken", second, 1.0),
        ("said", third, 3.0),
        ("taken", third, 3.0),
    ]


def test_messages_before_a_damage_are_played():
    file = recording_of([(0.1, LARGEST)] * 40)
    named = [found.start() for found in re.finditer(b"zstd", file.getvalue())]  # once in each chunk, once in the index
    file.getbuffer()[named[len(named) // 2 - 1] + 30] ^= 0xFF
    ahead = ReadAhead(Recording(file), CLASSES, 0.0)
    ahead.fill()
    count = 0

    def count_all() -> None:
        nonlocal count
        while ahead.first() is not None:
            ahead.pop()
            count += 1
            ahead.fill()

    with pytest.raises(NoRecording):
        count_all()
    assert 30 < count < 40
