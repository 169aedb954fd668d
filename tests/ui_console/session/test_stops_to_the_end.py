"""A stop is carried out to its end, whatever ends the console meanwhile, and no robot counts as stopped for nothing."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from held_robot import HeldRobot
from stoppable_robot import StoppableRobot

from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Clock
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from resource_pool.stop_latch import StopLatch
from ui_console.model.console import ConsoleModel
from ui_console.session.observer import Observer
from ui_console.session.scripted import ScriptDriver


def joined(network: Any, clock: Clock, subsystem: Subsystem, name: str) -> tuple[Launch, Any, Clock]:
    """Return what a component of this name begins with."""
    launch = Launch(network.mission, subsystem, name, "x", "x:Y", "local", "", 0.0, 1.0)
    return launch, network.join(launch.address, clock), clock


class Stage:
    """Two robots, and two people at consoles that know no robot yet."""

    def __init__(self, network: Any) -> None:
        self.network, self.clock = network, VirtualClock()
        self.robots = [StoppableRobot(*self._joined(Subsystem.RESOURCE_POOL, name)) for name in ("scout1", "scout2")]
        self.models = {name: ConsoleModel(name, name) for name in ("anna", "ben")}
        self.consoles = {name: self.console(name) for name in self.models}

    def console(self, name: str) -> Observer[Any]:
        show = self.models[name].apply
        return Observer(*self._joined(Subsystem.UI_CONSOLE, name), show=show, watches=False, user=name)

    def _joined(self, subsystem: Subsystem, name: str) -> tuple[Launch, Any, Clock]:
        return joined(self.network, self.clock, subsystem, name)


Scene = Callable[[Stage], Awaitable[None]]


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network, AsyncExitStack() as stack:
                on = Stage(network)
                for one in (*on.robots, *on.consoles.values()):
                    await stack.enter_async_context(beside(one))
                await scene(on)

        run_virtual(main())

    return run


def test_a_stop_of_all_is_carried_out_before_a_console_that_must_end_leaves(stage: Callable[[Scene], None]) -> None:
    """As when a terminal is closed, or a signal comes, right after the key."""

    async def scene(on: Stage) -> None:
        stopping = asyncio.create_task(on.consoles["anna"].stop_all())
        await asyncio.sleep(0)
        on.consoles["anna"].end("SIGTERM")
        assert await stopping == []
        assert [robot.latch.state.is_stopped for robot in on.robots] == [True, True]

    stage(scene)


@pytest.mark.parametrize("restarts", ["resource_pool/scout1", NAMESERVER])
def test_a_stop_outlasts_a_restart_of_the_robots_rc_and_of_the_nameserver(
    stage: Callable[[Scene], None], restarts: str
) -> None:
    async def scene(on: Stage) -> None:
        away = on.network.servers.pop(restarts)
        stopping = asyncio.create_task(on.consoles["anna"].stop_all())
        await on.clock.sleep_s(0.3)
        on.network.servers[restarts] = away
        assert await stopping == []
        assert [robot.latch.state.is_stopped for robot in on.robots] == [True, True]

    stage(scene)


def test_a_stop_is_repeated_until_a_robot_that_was_cut_off_answers(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, latch = on.consoles["anna"], on.robots[0].latch
        away = on.network.servers.pop("resource_pool/scout1")
        assert not await anna.stop_robot("scout1", "smoke")
        await on.clock.sleep_s(300.0)
        on.network.servers["resource_pool/scout1"] = away
        await on.clock.sleep_s(2.0)
        assert (latch.state.is_stopped, latch.state.by, latch.state.reason) == (True, "anna", "smoke")
        assert await anna.lift_stop("scout1", latch.state.number)
        await on.clock.sleep_s(300.0)
        assert not latch.state.is_stopped

    stage(scene)


def test_a_stop_that_was_answered_is_not_repeated(stage: Callable[[Scene], None]) -> None:
    """The operator pressed again: the second press counts for both."""

    async def scene(on: Stage) -> None:
        anna, latch = on.consoles["anna"], on.robots[0].latch
        away = on.network.servers.pop("resource_pool/scout1")
        assert not await anna.stop_robot("scout1")
        on.network.servers["resource_pool/scout1"] = away
        assert await anna.stop_robot("scout1")
        assert await anna.lift_stop("scout1", latch.state.number)
        await on.clock.sleep_s(10.0)
        assert not latch.state.is_stopped

    stage(scene)


def test_a_known_robot_that_hangs_does_not_delay_the_stop_of_an_unknown_one(
    stage: Callable[[Scene], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene(on: Stage) -> None:
        anna, (one, other) = on.consoles["anna"], on.robots
        monkeypatch.setattr(anna.feed, "_robots", {"scout1"})
        monkeypatch.setattr(one, "answer", lambda _asked: on.clock.sleep_s(60.0))
        stopping = asyncio.create_task(anna.stop_all())
        await on.clock.sleep_s(0.1)
        assert other.latch.state.is_stopped
        assert await stopping == ["scout1"]

    stage(scene)


def test_a_stop_of_all_is_not_sure_without_a_list_of_all(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        away = on.network.servers.pop(NAMESERVER)
        assert await on.consoles["anna"].stop_all()
        on.network.servers[NAMESERVER] = away
        assert await on.consoles["anna"].stop_all() == []

    stage(scene)


@pytest.mark.parametrize("is_lifted", [True, False], ids=["lifted meanwhile", "radio lost"])
def test_a_stop_that_is_answered_and_did_not_stop_the_wheels_is_not_confirmed(
    stage: Callable[[Scene], None], monkeypatch: pytest.MonkeyPatch, is_lifted: bool
) -> None:
    async def scene(on: Stage) -> None:
        latch, ben = on.robots[0].latch, on.consoles["ben"]

        def stop(*given: Any) -> None:
            StopLatch.stop(latch, *given)
            latch.confirm(False)
            if is_lifted:
                latch.lift(latch.state.number, "anna", 0.0)

        monkeypatch.setattr(latch, "stop", stop)
        assert not await ben.stop_robot("scout1")
        assert await ben.stop_all() == ["scout1"]

    stage(scene)


def test_a_stop_is_not_lifted_while_nobody_knows_where_its_author_is(stage: Callable[[Scene], None]) -> None:
    """The author is at another screen by now, and the nameserver, which lists the screens, is away for a moment."""

    async def scene(on: Stage) -> None:
        robot = on.robots[0]
        await on.consoles["anna"].stop_robot("scout1")
        on.consoles["anna"].end("goes to another room")
        await on.clock.sleep_s(0.1)
        away = on.network.servers.pop(NAMESERVER)
        assert not await on.consoles["ben"].lift_stop("scout1", robot.latch.state.number)
        assert robot.latch.state.is_stopped
        on.network.servers[NAMESERVER] = away
        assert await on.consoles["ben"].lift_stop("scout1", robot.latch.state.number)

    stage(scene)


class SilentRobot(StoppableRobot):
    """Hangs: its answer comes too late."""

    async def answer(self, asked: Envelope[Any]) -> Message:
        await self.clock.sleep_s(60.0)
        return await super().answer(asked)


def test_a_script_waits_for_the_outcome_of_its_stops(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission("iros2001") as network:
            placer = FakePlacer(network, VirtualClock(), {})
            on = HeldRobot(placer, is_scripted=True)
            said: list[bytes] = []
            driver = ScriptDriver(said.append)
            on.make_console(show=driver.show, work=driver.drive)
            async with beside(SilentRobot(*joined(network, on.clock, Subsystem.RESOURCE_POOL, "scout9"))):
                living = asyncio.create_task(on.console.run())
                await on.held()
                for line in ('{"stop_robot":"scout9"}', None):
                    driver.feed(line)
                await living
            await on.rc.close()
            await placer.close()
            assert driver.exit_code(on.console) == 5
            assert any("scout9 did not confirm the stop" in json.loads(line).get("detail", "") for line in said)

    run_virtual(main())
