"""A person at a page is asked whether their stop may be lifted; a person who closed the page is not."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from importlib import resources
from typing import Any

import pytest
from stoppable_robot import StoppableRobot

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from resource_pool.stop_messages import EmergencyStop
from ui_console.model.consent import CONSENT_WITHIN_S
from ui_console.model.console import ConsoleModel
from ui_console.model.views import AlarmKind, AlarmView
from ui_console.session.observer import Observer
from ui_console.web.hub import WebHub
from ui_console.web.login import Welcome
from ui_console.web.operator import Operator
from ui_console.web.protocol import Decide, LiftRequest, StopAllRequest, StopRequest

WITHIN_S = 5.0


class Stage:
    """A server of pages, a robot, and ben at a terminal."""

    def __init__(self, network: Any) -> None:
        self.network, self.clock = network, VirtualClock()
        self.robot = StoppableRobot(*self._who(Subsystem.RESOURCE_POOL, "scout1"))
        launch, bus, clock = self._who(Subsystem.UI_CONSOLE, "web-1")
        self.hub = WebHub(launch, bus, clock, self._join, kind="capture")
        self.ben = ConsoleModel("ben", "ben")
        self.terminal: Observer[Any] = Observer(
            *self._who(Subsystem.UI_CONSOLE, "ben"), show=self.ben.apply, user="ben"
        )

    def _who(self, subsystem: Subsystem, name: str) -> tuple[Launch, Bus, VirtualClock]:
        kind = "scout" if subsystem is Subsystem.RESOURCE_POOL else "console"
        launch = Launch(self.network.mission, subsystem, name, kind, "x:Y", "local", "", 0.0, 1.0)
        return launch, self.network.join(launch.address, self.clock), self.clock

    async def _join(self, launch: Launch) -> Bus:
        joined: Bus = self.network.join(launch.address, self.clock)
        return joined

    async def until(self, condition: Callable[[], Any]) -> None:
        async with asyncio.timeout(WITHIN_S):
            while not condition():
                await self.clock.sleep_s(0.01)

    def question(self, page: Operator) -> Any:
        return page.model.own(self.clock.now_s()).consent


Scene = Callable[[Stage], Awaitable[None]]


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                on = Stage(network)
                async with beside(on.robot), beside(on.hub.observer), beside(on.terminal):
                    await scene(on)

        run_virtual(main())

    return run


def test_the_person_at_the_page_who_stopped_the_robot_is_asked_and_nobody_else(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, cleo = on.hub.enter(Welcome("anna", 100)), on.hub.enter(Welcome("cleo", 100))
        await on.hub.observer.stop_robot("scout1", "", "anna")
        lifting = asyncio.create_task(on.terminal.lift_stop("scout1", on.robot.latch.state.number))
        await on.until(lambda: on.question(anna))
        assert on.question(cleo) is None
        cleo.obey(Decide(True, on.question(anna).number))
        assert on.robot.latch.state.is_stopped
        anna.obey(Decide(True, on.question(anna).number))
        assert await lifting
        assert on.question(anna) is None

    stage(scene)


def test_a_person_who_closed_the_page_keeps_no_robot_standing(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna = on.hub.enter(Welcome("anna", 100))
        await on.hub.observer.stop_robot("scout1", "", "anna")
        await on.hub.leave(anna, "closed the page")
        assert await on.terminal.lift_stop("scout1", on.robot.latch.state.number)
        assert on.ben.own(on.clock.now_s()).asked == "anna lets scout1 move: is not here any more"

    stage(scene)


def test_one_page_asks_another_of_the_same_server_and_reads_the_answer(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, cleo = on.hub.enter(Welcome("anna", 100)), on.hub.enter(Welcome("cleo", 100))
        await on.hub.observer.stop_robot("scout1", "", "anna")
        cleo.obey(LiftRequest("scout1", on.robot.latch.state.number))
        await on.until(lambda: on.question(anna))
        anna.obey(Decide(False, on.question(anna).number))
        await on.until(lambda: "anna keeps scout1 stopped" in cleo.model.own(on.clock.now_s()).asked)
        assert anna.model.own(on.clock.now_s()).asked == ""
        anna.obey(LiftRequest("scout1", on.robot.latch.state.number))
        await on.until(lambda: not on.robot.latch.state.is_stopped)

    stage(scene)


def test_two_people_at_pages_of_one_server_ask_at_the_same_time(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, ben, cleo = (on.hub.enter(Welcome(name, 100)) for name in ("anna", "ben", "cleo"))
        await on.hub.observer.stop_robot("scout1", "", "anna")
        for page in (ben, cleo):
            page.obey(LiftRequest("scout1", on.robot.latch.state.number))
        await on.until(lambda: on.question(anna) and on.question(anna).others == 1)
        for page in (ben, cleo):
            assert on.question(anna).user == page.welcome.user
            anna.obey(Decide(False, on.question(anna).number))
            await on.until(lambda page=page: "anna keeps scout1 stopped" in page.model.own(on.clock.now_s()).asked)  # type: ignore[misc]
        assert on.question(anna) is None

    stage(scene)


def test_a_yes_that_comes_too_late_does_not_answer_the_next_question(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, cleo = on.hub.enter(Welcome("anna", 100)), on.hub.enter(Welcome("cleo", 100))
        await on.hub.observer.stop_robot("scout1", "", "anna")
        number = on.robot.latch.state.number
        asking = asyncio.create_task(on.terminal.lift_stop("scout1", number))
        await on.until(lambda: on.question(anna))
        to_ben = Decide(True, on.question(anna).number)
        await on.clock.sleep_s(CONSENT_WITHIN_S - 1.0)
        cleo.obey(LiftRequest("scout1", number))
        assert not await asking, "nobody answered in time"
        anna.obey(to_ben)
        assert on.question(anna).user == "cleo", "still asked"
        assert anna.outbox.next(0.0) == '{"answer":{"refused":"no answer was given: that question is over"}}'
        await on.clock.sleep_s(1.0)
        assert on.robot.latch.state.is_stopped

    stage(scene)


@pytest.mark.parametrize("stop", [StopRequest("scout1"), StopAllRequest()], ids=["one", "all"])
def test_a_press_of_stop_counts_also_while_the_answer_to_an_earlier_one_is_awaited(
    stage: Callable[[Scene], None], monkeypatch: pytest.MonkeyPatch, stop: StopRequest | StopAllRequest
) -> None:
    """The earlier stop was lifted meanwhile, while the robot's answer, or that of another robot, takes its time."""

    async def scene(on: Stage) -> None:
        answer, latch = on.robot.answer, on.robot.latch

        async def answer_late(asked: Envelope[Any]) -> Message:
            done = await answer(asked)
            await on.clock.sleep_s(0.9 if isinstance(asked.body, EmergencyStop) else 0.0)
            return done

        monkeypatch.setattr(on.robot, "answer", answer_late)
        anna = on.hub.enter(Welcome("anna", 100))
        await on.until(lambda: "scout1" in on.hub.team.robots.names())
        anna.obey(stop)
        await on.until(lambda: latch.state.is_stopped)
        latch.lift(latch.state.number, "anna", on.clock.now_s())
        anna.obey(stop)
        await on.clock.sleep_s(0.1)
        assert latch.state.is_stopped
        await on.hub.leave(anna, "closed the page")

    stage(scene)


def test_the_remedy_of_a_stop_names_the_pages_button(stage: Callable[[Scene], None]) -> None:
    page = resources.files("ui_console.web").joinpath("page", "cards.js").read_text()

    async def scene(on: Stage) -> None:
        await on.terminal.stop_robot("scout1")

        def stopped() -> list[AlarmView]:
            return [alarm for alarm in on.hub.team.alarms.views() if alarm.kind is AlarmKind.STOPPED]

        await on.until(stopped)
        assert stopped()[0].remedy == "When the robot may move, hold “Hold to lift” on its picture."
        assert '"Hold to lift"' in page

    stage(scene)
