"""The lines of a mission that is up without a live picture."""

from __future__ import annotations

import asyncio
import gc
import io

import pytest
from rich.console import Console

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.mission_console import ConsoleObserver
from backbone.component.messages import Absence, ComponentState, LifeState, StoryEvent
from backbone.keys import Conversation
from backbone.picture.health import HealthWord, MissionHealth
from backbone.rc_manager.messages import AskSchedule, TraceLine
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule
from backbone.waiting import end_tasks
from backbone.wire import Envelope, Message


def test_consoles_that_came_and_went_are_not_kept_but_named_by_their_people() -> None:
    lines = io.StringIO()

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        observer = ConsoleObserver(Console(file=lines), live=False)
        observer.connected(network.join("backbone/launcher", clock))
        for number in range(100):
            address = f"ui_console/passing-{number}"
            bus = network.join(address, clock)
            state = ComponentState(address, "console", "base", number, LifeState.READY, 0.0, user=f"Anna {number}")
            bus.publish(address, Conversation.STATUS, state)
            story = StoryEvent(0.0, address, f"was taken by passing-{number}-drive", "scout1", "")
            bus.publish(address, Conversation.LOG, story)
            await clock.sleep_s(1.0)
            await bus.close()
        kept = [one for one in gc.get_objects() if issubclass(type(one), dict) and "ui_console/passing-7" in one]
        assert kept == []

    run_virtual(scene())
    assert "was taken by Anna 99" in lines.getvalue()


def test_sixty_components_that_start_are_one_line() -> None:
    lines = io.StringIO()
    radios = [Absence(f"radio{number}", 4.0, "no process yet", "its owner asks for it") for number in range(60)]

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        await clock.sleep_s(5.0)
        ConsoleObserver(Console(file=lines), live=False).connected(network.join("backbone/up", clock))
        launcher = network.join("backbone/launcher", clock)
        launcher.publish("backbone/launcher", Conversation.HEALTH, MissionHealth(HealthWord.STARTING, radios))
        await clock.sleep_s(1.0)

    run_virtual(scene())
    [line] = lines.getvalue().splitlines()
    assert line.startswith("  … each of 60 components (radio0, ")


def test_a_long_wait_is_told_less_and_less_often() -> None:
    lines = io.StringIO()

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        ConsoleObserver(Console(file=lines), live=False).connected(network.join("backbone/up", clock))
        launcher = network.join("backbone/launcher", clock)
        for second in range(1, 400):
            await clock.sleep_s(1.0)
            missing = [
                Absence(host, 0.0, "no creator yet", "waits") for host in ("far", "farther")[: 1 + (second > 299)]
            ]
            launcher.publish("backbone/launcher", Conversation.HEALTH, MissionHealth(HealthWord.STARTING, missing))

    run_virtual(scene())
    told = [line for line in lines.getvalue().splitlines() if "farther" not in line]
    assert 8 <= len(told) <= 14
    assert "farther is absent for 300.0 s" in lines.getvalue()


@pytest.mark.parametrize(("requests", "most"), [(3, 105), (100, 15)])
def test_the_more_requests_there_are_the_more_seldom_their_holders_are_asked_for(requests: int, most: int) -> None:
    asked: list[float] = []
    waiting = [
        RequestView(f"arc{number}", "", RequestState.WAITING, ["radio"], 0.0, -1.0, -1.0, "", [], 1.0, "", 0)
        for number in range(requests)
    ]

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        manager, up = network.join(RC_MANAGER, clock), network.join("backbone/launcher", clock)

        async def answer(_asked: Envelope[Message]) -> Message:
            asked.append(clock.now_s())
            return Schedule(clock.now_s(), [], waiting, [])

        manager.serve(RC_MANAGER, AskSchedule, answer)
        observer = ConsoleObserver(Console(file=io.StringIO()), live=False)
        showing = asyncio.create_task(observer.up(up, clock))
        for _ in range(200):
            await clock.sleep_s(0.05)
            manager.publish(RC_MANAGER, Conversation.EVENTS, TraceLine({"ev": "grant"}, ""))
        await end_tasks(showing)

    run_virtual(scene())
    assert most / 2 <= len(asked) <= most


def test_a_decision_before_the_manager_knew_its_subscriber_is_shown_all_the_same() -> None:
    """The first holder was never shown, if no further decision followed."""
    lines = io.StringIO()

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        manager, up = network.join(RC_MANAGER, clock), network.join("backbone/launcher", clock)
        held = RequestView("patrol-drive", "", RequestState.RUNNING, ["radio"], 0.0, 0.0, -1.0, "", [], 1.0, "", 0)

        async def answer(_asked: Envelope[Message]) -> Message:
            return Schedule(clock.now_s(), [], [held] if clock.now_s() > 0.5 else [], [])

        manager.serve(RC_MANAGER, AskSchedule, answer)
        showing = asyncio.create_task(ConsoleObserver(Console(file=lines), live=False).up(up, clock))
        await clock.sleep_s(3.0)
        await end_tasks(showing)

    run_virtual(scene())
    assert "no ARC has a request" in lines.getvalue()
    assert "runs: patrol-drive" in lines.getvalue()
