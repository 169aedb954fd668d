"""A mission that comes up is ``starting``, not ``degraded``, unless something has failed or it takes too long."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable
from typing import Any, cast

import pytest
from rich.console import Console

from backbone.addresses import LAUNCHER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.command_line.mission_console import ConsoleObserver
from backbone.component.launch import Launch
from backbone.component.messages import Absence
from backbone.creator.process_keeper import ProcessKeeper
from backbone.keys import Conversation
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.launcher import Launcher
from backbone.launcher.mission_recorder import MissionRecorder
from backbone.mission.reader import read_mission_bytes
from backbone.naming import Subsystem
from backbone.picture.health import FAILED_AFTER_S, STARTING_MOST_S, HealthWord, MissionHealth, health
from backbone.picture.look import look

MISSION = b"""<mission name="local" priority="1"><behaviors><behavior type="wait" name="one" priority="1">
<parameter name="seconds" value="9"/></behavior></behaviors></mission>"""
START = Absence("m", 0.0, "not all of it is ready", "starts world", is_start=True)
WORLD = Absence("world", 1.0, "no process yet", "it starts")


@pytest.mark.parametrize(
    ("absent", "now_s", "word"),
    [
        ([START, WORLD], 5.0, HealthWord.STARTING),
        ([START, WORLD], STARTING_MOST_S + 1.0, HealthWord.DEGRADED),
        ([START, Absence("world", 1.0, "it fell three times")], 5.0, HealthWord.FAILED),
        ([START, Absence("placer", 1.0, "it fell", "it starts", vital=True)], FAILED_AFTER_S + 2.0, HealthWord.FAILED),
        ([WORLD], 5.0, HealthWord.DEGRADED),
    ],
    ids=["starts", "takes long", "gave up", "without a placer", "is up"],
)
def test_the_word_of_a_mission_that_comes_up(absent: list[Absence], now_s: float, word: HealthWord) -> None:
    assert health({}, absent, now_s).word is word


def test_a_mission_that_comes_up_is_not_called_absent() -> None:
    assert MissionHealth(HealthWord.STARTING, [START]).lines(2.0) == [
        "m has been coming up for 2.0 s: not all of it is ready; starts world"
    ]


class CoreServices:
    """Core services that are up; none of them answers."""

    on_fell = on_silent = on_changed = on_bug = None

    async def start(self, *_given: object) -> None: ...

    async def end(self, *_given: object) -> None: ...

    def absences(self) -> list[object]:
        return []


class Watcher:
    """Observer of a bring-up."""

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_arguments: None


class LateRecorder:
    """A recorder that does not begin."""

    async def begin(self) -> None:
        await asyncio.get_running_loop().create_future()

    async def keep(self) -> None: ...

    def absence(self) -> Absence:
        return Absence("recorder", 0.0, "it does not listen yet", "components here wait for it")


def launcher_on(bus: Bus, clock: Clock, observer: object = None, recorder: LateRecorder | None = None) -> Launcher:
    return Launcher(
        Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", "localhost", "", 0.0, 1.0),
        bus,
        clock,
        keeper=cast("ProcessKeeper", CoreServices()),
        description=read_mission_bytes(MISSION, "m.xml"),
        options=UpOptions(),
        observer=cast("Any", observer or Watcher()),
        began_s=0.0,
        recorder=cast("MissionRecorder | None", recorder),
    )


def test_the_launcher_says_that_its_mission_starts(local_mission: Callable[..., Any]) -> None:
    async def main() -> None:
        async with local_mission() as network:
            clock, said = VirtualClock(), asyncio.Queue[MissionHealth]()
            network.join(PLACER, clock).declare_alive(PLACER)  # it starts nothing, so the start goes on
            hearing = network.join("ui_console/console", clock)
            hearing.subscribe(
                LAUNCHER, Conversation.HEALTH, MissionHealth, lambda envelope: said.put_nowait(envelope.body)
            )
            launcher = launcher_on(network.join(LAUNCHER, clock), clock)
            running = asyncio.create_task(launcher.run())
            assert (await said.get()).word is HealthWord.STARTING
            running.cancel()
            await asyncio.wait([running])

    run_virtual(main())


def test_a_mission_that_waits_for_its_recorder_says_so_and_ends_without_it(local_mission: Callable[..., Any]) -> None:
    lines = io.StringIO()

    async def main() -> None:
        async with local_mission() as network:
            clock, observer = VirtualClock(), ConsoleObserver(Console(file=lines), live=False)
            observer.connected(network.join("backbone/up", clock))
            launcher = launcher_on(network.join(LAUNCHER, clock), clock, observer, LateRecorder())
            running = asyncio.create_task(launcher.run())
            await clock.sleep_s(14.0)
            picture = await look(network.join("ui_console/status", clock), clock.now_s())
            assert picture.health.word is HealthWord.STARTING
            assert [absence.name for absence in picture.health.absent] == ["local", "recorder"]
            launcher.end("the test is over")
            await asyncio.wait_for(running, 1.0)

    run_virtual(main())
    assert "recorder is absent for 2.0 s: it does not listen yet" in lines.getvalue()
    assert "launcher" not in lines.getvalue()
