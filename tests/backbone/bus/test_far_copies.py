"""What no socket brings to the recorder of the mission comes to it by network, once; what a socket brings does not."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import NamedTuple

import pytest
import pytest_asyncio
from bus_laws import ASK_S, ASKER, SERVER, THIRD, Echo, Echoed, News, echo
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock
from backbone.bus.host_copies import PICTURES, HostCopies, copy_at
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import COPIED, Conversation, key
from backbone.quality import NEVER_DROPPED
from backbone.recording.host_ear import HostEar
from backbone.recording.translation import heading_of

WITHIN_S = 10.0
MISSION = "conformance"


class Copied(NamedTuple):
    key: str
    source: str
    sequence: int


class Recording(list[Copied]):
    """Copies as a recorder takes them."""

    def take(self, key: str, raw: bytes) -> None:
        heading = heading_of(raw)
        self.append(Copied(key, heading.source, heading.sequence))

    def take_far(self, _key: str, raw: bytes) -> None:
        at = 0
        while (copy := copy_at(raw, at)) is not None:
            self.take(copy.key, copy.raw)
            at = copy.end
        assert at == len(raw)


class Place(NamedTuple):
    join: Callable[[str], ZenohBus]
    endpoint: str
    clock: MissionClock


@pytest_asyncio.fixture
async def place() -> AsyncIterator[Place]:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    buses = [ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))]

    def join(source: str) -> ZenohBus:
        buses.append(ZenohBus.open(MISSION, source, clock, client_config(endpoint)))
        return buses[-1]

    yield Place(join, endpoint, clock)
    for bus in reversed(buses):
        await bus.close()


async def listening(place: Place, source: str = ASKER) -> Recording:
    """Return what a recorder hears, once the hub knows that it listens: it has told another session so."""
    recording, other = Recording(), place.join("tester/other")
    place.join(source).overhear(Conversation.FAR, recording.take_far, 10_000_000)
    await until(lambda: knows_listener(other), "the hub knows of the listener")
    return recording


@asynccontextmanager
async def recorder_of_host(directory: Path, recording: Recording, *, is_of_mission: bool) -> AsyncIterator[None]:
    ear = HostEar(directory, is_of_mission=is_of_mission)
    await ear.open(recording.take, lambda bug: pytest.fail(str(bug)))
    try:
        yield
    finally:
        await ear.close()


async def until(holds: Callable[[], bool], what: str) -> None:
    try:
        async with asyncio.timeout(WITHIN_S):
            while not holds():  # noqa: ASYNC110  other threads set no event
                await asyncio.sleep(0.01)
    except TimeoutError:
        pytest.fail(f"not within {WITHIN_S} s: {what}")


async def test_all_but_pictures_comes_once_from_the_first_message_of_a_process_on_to_its_last(place: Place) -> None:
    recording = await listening(place)
    spoken = [one for one in Conversation if one not in {Conversation.ASK, Conversation.ALIVE}]
    source = place.join(SERVER)
    source.publish(THIRD, Conversation.LOG, News(0))
    await until(lambda: knows_listener(source), "the listener is known")
    for number in range(3):
        for conversation in spoken:
            source.publish(THIRD, conversation, News(number))
    await source.close()
    left_out = {*COPIED, *PICTURES}
    first = Copied(key(MISSION, THIRD, Conversation.LOG), SERVER, 1)
    expected = [first] + [
        Copied(key(MISSION, THIRD, conversation), SERVER, 2 + number * len(spoken) + place_)
        for number in range(3)
        for place_, conversation in enumerate(spoken)
        if conversation not in left_out
    ]
    await until(lambda: len(recording) >= len(expected), "all came")
    assert recording == expected
    assert {copied.key.rpartition("/")[2] for copied in recording} >= NEVER_DROPPED


async def test_questions_come_with_their_answers_from_who_answers(place: Place) -> None:
    recording = await listening(place, THIRD)
    server, asker = place.join(SERVER), place.join(ASKER)
    server.serve(SERVER, Echo, echo)
    served = asyncio.Event()
    asker.watch_alive(SERVER, lambda _address, _stands: served.set())
    server.declare_alive(SERVER)
    await served.wait()  # the hub learned of the token after it had learned of the server
    for _question in range(3):
        await asker.ask(SERVER, Echo("hello"), Echoed, within_s=ASK_S)
    await until(lambda: len(recording) == 6, "questions and answers")
    assert {copied.key for copied in recording} == {key(MISSION, SERVER, Conversation.ASK)}


@pytest.mark.parametrize("is_of_mission", [True, False])
async def test_a_process_sends_no_copies_by_network_once_its_socket_leads_to_the_recorder_of_the_mission(
    place: Place, short_path: Path, is_of_mission: bool
) -> None:
    far, near = await listening(place), Recording()
    async with recorder_of_host(short_path, near, is_of_mission=is_of_mission):
        source = place.join(SERVER)
        source.copies = HostCopies(short_path)
        for number in range(10):
            source.publish(SERVER, Conversation.LOG, News(number))
            source.publish(SERVER, Conversation.STATUS, News(number))
        await source.close()
        await until(lambda: len(near) == 20, "all came by the socket")
        if is_of_mission:
            await asyncio.sleep(0.1)
            assert far == []
        else:
            await until(lambda: len(far) == 20, "the recorder of the mission has them, too")
            assert far == near


async def test_a_process_that_hears_of_a_recorder_sends_it_pictures_at_once(
    place: Place, short_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("backbone.bus.host_copies.LOOK_EACH_S", 1e6)  # it would not look again in this test
    source, near = place.join(SERVER), Recording()
    source.copies = HostCopies(short_path)
    async with recorder_of_host(short_path, near, is_of_mission=True):
        far = await listening(place)
        await until(lambda: knows_listener(source), "the listener is known")
        for conversation in (Conversation.FRAMES, Conversation.BODIES):
            source.publish(SERVER, conversation, News(1))
        await source.close()
        await until(lambda: len(near) == 2, "both came by the socket")
        assert far == []


async def test_when_its_recorder_ends_a_process_sends_its_copies_by_network(place: Place, short_path: Path) -> None:
    far, near = await listening(place), Recording()
    source = place.join(SERVER)
    async with recorder_of_host(short_path, near, is_of_mission=True):
        source.copies = HostCopies(short_path)
        source.publish(SERVER, Conversation.LOG, News(0))
        await until(lambda: len(near) == 1, "it came by the socket")
    for number in range(1, 10):
        source.publish(SERVER, Conversation.LOG, News(number))
    await until(lambda: bool(far) and far[-1].sequence == 10, "the last came by network")
    assert [copied.sequence for copied in far] == [*range(far[0].sequence, 11)]
    assert far[0].sequence <= 3, "what was on its way to a socket without a reader is lost"


async def test_members_of_a_shared_process_send_their_copies_once(place: Place) -> None:
    recording = await listening(place)
    session = SharedSession(MISSION, place.endpoint)
    members = session.join(SERVER, place.clock), session.join(THIRD, place.clock)
    try:
        for member in members:
            member.publish(member.source, Conversation.STATUS, News(1))
        members[0].serve(SERVER, Echo, echo)
        await members[1].ask(SERVER, Echo("neighbor"), Echoed, within_s=ASK_S)
        await until(lambda: len(recording) >= 4, "both states, question and answer")
        assert len(recording) == len(set(recording)) == 4
    finally:
        for member in members:
            await member.close()
        await session.close()


async def test_nothing_is_copied_while_no_recorder_listens(place: Place) -> None:
    source = place.join(SERVER)
    assert source.far is not None
    while source.far.wants(Conversation.LOG):  # noqa: ASYNC110  as long as a session may not know of listeners
        await asyncio.sleep(0.05)
    recording = await listening(place)
    await until(lambda: knows_listener(source), "it is known that a recorder listens")
    assert recording == []


def knows_listener(source: ZenohBus) -> bool:
    return source.far is not None and source.far.wants(Conversation.OUTPUTS)
