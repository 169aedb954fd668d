"""Looks at keys: what is said is seen, live and recorded, and nothing is subscribed to while nobody looks."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Coroutine
from types import SimpleNamespace
from typing import cast

import pytest
from small_recordings import CLASSES, MISSION, SCOUT, Said, recorded

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import ComponentState, LifeState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.playback import Playback
from backbone.recording.reader import Recording
from backbone.waiting import end_tasks
from backbone.wire import Message, schema_of
from ui_console.model.console import ConsoleModel
from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.team import TeamModel
from ui_console.session.key_looking import keep_hearing, keep_listing, keep_listing_recorded, keep_reading
from ui_console.session.observer import AnyObserver
from ui_console.session.verbs import Session

LOG = KeyRow(f"{SCOUT}/log", SCOUT, schema_of(StoryEvent))
STATUS = KeyRow(f"{SCOUT}/status", SCOUT, schema_of(ComponentState))


def event(number: int) -> StoryEvent:
    return StoryEvent(float(number), SCOUT, f"round {number}", "scout1", "", LogLevel.INFO)


def state(number: int) -> ComponentState:
    return ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, f"round {number}", is_robot=True)


async def looked(look: Coroutine[object, None, None], lasts_s: float) -> None:
    task = asyncio.create_task(look)
    await asyncio.sleep(lasts_s)
    await end_tasks(task)


def test_what_is_said_live_is_listed_and_shown_only_while_somebody_looks() -> None:
    async def scene() -> None:
        network, clock = LocalNetwork(MISSION), VirtualClock()
        scout, console = network.join(SCOUT, clock), network.join("ui_console/anna", clock)

        async def speak() -> None:
            for number in range(1, 1000):
                await clock.sleep_s(0.1)
                scout.publish(SCOUT, Conversation.LOG, event(number))
                scout.publish(SCOUT, Conversation.STATUS, state(number))

        speaking = asyncio.create_task(speak())
        await clock.sleep_s(1.0)
        assert (network.overhearers, scout.told) == ([], 0)

        lists: list[list[KeyRow]] = []
        await looked(keep_listing(console, clock, lists.append), 8.5)
        assert lists[0] == []
        assert [row.id for row in lists[-1]] == [LOG.id, STATUS.id]
        assert all(9.0 < row.messages_per_s < 11.0 and row.mean_bytes > 10.0 for row in lists[-1])
        assert network.overhearers == []

        told = scout.told
        for row in (LOG, STATUS):
            view = KeyView(row.schema, {})
            await looked(keep_hearing(console, clock, CLASSES, row, view), 2.05)
            assert 19 <= view.messages <= 21
            assert any("round" in shown.text for shown in view.rows)
            assert network.overhearers == []
        assert told < scout.told <= told + 21, "copies are made for one of the two looks only"
        await end_tasks(speaking)

    run_virtual(scene())


def test_the_list_imports_no_message_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Red before: the first list of a console imported the modules of all component types of its mission."""

    async def imported(*_given: object) -> dict[str, type[Message]]:
        raise AssertionError("message classes were imported")

    async def scene() -> None:
        network, clock = LocalNetwork(MISSION), VirtualClock()
        scout, session = network.join(SCOUT, clock), Session(ConsoleModel("anna", "anna", TeamModel(MISSION, "")))
        session._console = cast(AnyObserver, SimpleNamespace(bus=network.join("ui_console/anna", clock), clock=clock))  # noqa: SLF001
        lists: list[list[KeyRow]] = []
        asyncio.get_running_loop().call_later(0.5, scout.publish, SCOUT, Conversation.LOG, event(1))
        await looked(session.keep_listing(lists.append), 2.5)
        assert [row.id for row in lists[-1]] == [LOG.id]

    monkeypatch.setattr("ui_console.session.verbs.mission_classes", imported)
    run_virtual(scene())


def a_minute() -> Recording:
    said = [Said(float(number), SCOUT, Conversation.LOG, event(number)) for number in range(1, 120)]
    return Recording(io.BytesIO(recorded([Said(0.5, SCOUT, Conversation.STATUS, state(0)), *said]).getvalue()))


def test_a_recording_is_listed_with_the_rates_of_its_time_wherever_that_stands() -> None:
    async def scene() -> None:
        playback = Playback(VirtualClock(), 0.5, 119.0)
        playback.go_to(60.0)
        lists: list[list[KeyRow]] = []
        await looked(keep_listing_recorded(a_minute(), playback, lists.append), 3.5)
        log, status = lists[-1]
        assert (log.id, status.id) == (LOG.id, STATUS.id)
        assert 0.8 < log.messages_per_s < 1.4
        assert (status.messages_per_s, status.heard_s) == (0.0, -1.0)

    run_virtual(scene())


def test_a_recorded_key_is_shown_with_its_past_and_goes_on_as_it_is_played() -> None:
    async def scene() -> None:
        playback, view = Playback(VirtualClock(), 0.5, 119.0), KeyView(LOG.schema, {})
        playback.go_to(90.0)
        looking = asyncio.create_task(keep_reading(a_minute(), playback, LOG, view))
        await asyncio.sleep(1.0)
        series = view.series("at_s")
        assert series is not None
        assert series.extent(90.0) == (31.0, 90.0)
        playback.play(10.0)
        await asyncio.sleep(1.05)
        assert (view.at_s, series.extent(100.0)) == (100.0, (41.0, 100.0))
        await end_tasks(looking)

    run_virtual(scene())


def test_what_was_last_said_before_is_shown_however_long_ago_it_was() -> None:
    async def scene() -> None:
        playback, view = Playback(VirtualClock(), 0.5, 119.0), KeyView(STATUS.schema, {})
        playback.go_to(110.0)
        await looked(keep_reading(a_minute(), playback, STATUS, view), 1.0)
        assert (view.messages, view.at_s) == (1, 0.5)
        assert "round 0" in {row.text for row in view.rows}

    run_virtual(scene())
