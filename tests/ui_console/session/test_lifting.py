"""The author of a stop lifts it at once, others if each author who is there agrees; silence keeps it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from stoppable_robot import StoppableRobot

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem
from backbone.wire import Envelope
from resource_pool.arc_client import Stopper, StopState
from resource_pool.stop_latch import StopLatch
from ui_console.model.consent import CONSENT_WITHIN_S, Consent, NotAnOperator
from ui_console.model.console import ConsoleModel
from ui_console.model.lifting import AskFirst, AskLift, LiftNow, NotThatStop, decide_lift, is_agreed, lift_line
from ui_console.session.observer import Observer, no_person_here

PEOPLE = ["anna", "ben", "cleo"]


def stopped_by(*names: str) -> StopState:
    latch = StopLatch("scout1")
    for name in names:
        latch.stop(name, "", 1.0, f"ui_console/{name}")
    return latch.state


@given(st.lists(st.sampled_from(PEOPLE), min_size=1, max_size=5), st.sampled_from(PEOPLE), st.integers(0, 6))
def test_everybody_else_who_stopped_the_robot_is_asked_and_nobody_twice(
    stoppers: list[str], user: str, number: int
) -> None:
    stop = stopped_by(*stoppers)
    match decide_lift(stop, number, user, f"ui_console/{user}"):
        case LiftNow():
            assert (number, set(stoppers)) == (stop.number, {user})
        case AskFirst(authors):
            assert number == stop.number
            assert sorted(author.by for author in authors) == sorted(set(stoppers) - {user})
        case NotThatStop():
            assert number != stop.number


@given(st.lists(st.booleans()))
def test_one_no_keeps_the_stop(answers: list[bool]) -> None:
    assert is_agreed([Consent(given, "x", "") for given in answers]) is all(answers)


def test_a_stop_that_nobody_can_be_asked_about_is_lifted_by_anybody() -> None:
    stop = StopState("scout1", True, 1, "unknown", "the file of an earlier stop cannot be read", 0.0)
    assert decide_lift(stop, 1, "anna", "ui_console/anna") == LiftNow()


@pytest.mark.parametrize(
    ("stoppers", "there", "line"),
    [
        (["anna"], PEOPLE, "hold to lift"),
        (["ben"], PEOPLE, "asks ben first"),
        (["ben"], ["anna"], "ben is not here any more"),
        (["ben", "anna", "cleo"], PEOPLE, "asks ben and cleo first"),
        (["ben", "cleo"], ["cleo"], "asks cleo first"),
        (["ben", "cleo"], [], "ben and cleo are not here any more"),
    ],
)
def test_people_read_what_it_takes_to_lift_a_stop(stoppers: list[str], there: list[str], line: str) -> None:
    stop = stopped_by(*stoppers)
    assert lift_line(stop, "anna", "ui_console/anna", lambda author: author.by in there) == line


def test_who_stopped_under_no_name_is_known_by_the_console() -> None:
    stop = StopLatch("scout1")
    stop.stop("ui_console/console-7", "", 1.0, "ui_console/console-7")
    assert decide_lift(stop.state, 1, "anna", "ui_console/console-7") == LiftNow()
    assert decide_lift(stop.state, 1, "anna", "ui_console/x") == AskFirst((Stopper(*["ui_console/console-7"] * 2),))


class Person:
    """A person at a console, and the content of its screens."""

    def __init__(self, name: str, stage: Stage, console: str = "") -> None:
        self.name, self.clock = name, stage.clock
        self.model = ConsoleModel(name, name)
        launch = stage.launch(Subsystem.UI_CONSOLE, console or name, "console")
        bus = stage.network.join(launch.address, stage.clock)
        self.console: Observer[Any] = Observer(launch, bus, stage.clock, show=self.model.apply, user=name)

    def asked(self) -> str:
        """What the screens say of the question this person asked."""
        return self.model.own(self.clock.now_s()).asked

    def question(self) -> Any:
        """What the screens ask this person."""
        return self.model.own(self.clock.now_s()).consent


class Stage:
    """One robot, and people at consoles."""

    def __init__(self, network: Any) -> None:
        self.network, self.clock = network, VirtualClock()
        launch = self.launch(Subsystem.RESOURCE_POOL, "scout1", "scout")
        self.robot = StoppableRobot(launch, network.join(launch.address, self.clock), self.clock)
        self.people = {name: Person(name, self) for name in PEOPLE}
        self.acts: list[tuple[str, OperatorAction]] = []
        self.ear: Bus = network.join("mission_control/ear", self.clock)
        self.ear.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard)

    def launch(self, subsystem: Subsystem, name: str, kind: str) -> Launch:
        return Launch(
            self.network.mission, subsystem, name, kind, "x:Y", "local", "", 0.0, 1.0, requester="backbone/launcher"
        )

    def _heard(self, said: Envelope[Any]) -> None:
        if said.body.action not in (OperatorAction.ATTACH, OperatorAction.DETACH, OperatorAction.STOP_ROBOT):
            self.acts.append((said.body.user, said.body.action))

    async def until(self, condition: Callable[[], Any], within_s: float = 20.0) -> None:
        async with asyncio.timeout(within_s):
            while not condition():
                await self.clock.sleep_s(0.01)

    def lift(self, name: str) -> Any:
        """Lift the stop in force by this person."""
        console = self.people[name].console
        return asyncio.ensure_future(console.lift_stop("scout1", self.robot.latch.state.number))


Scene = Callable[[Stage], Awaitable[None]]


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network, AsyncExitStack() as stack:
                on = Stage(network)
                await stack.enter_async_context(beside(on.robot))
                for person in on.people.values():
                    await stack.enter_async_context(beside(person.console))
                await on.clock.sleep_s(0.1)
                try:
                    await scene(on)
                finally:
                    await on.ear.close()

        run_virtual(main())

    return run


def test_ones_own_stop_is_lifted_at_once(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        await on.people["anna"].console.stop_robot("scout1", "child in the room")
        began_s = on.clock.now_s()
        assert await on.lift("anna")
        assert not on.robot.latch.state.is_stopped
        assert on.clock.now_s() - began_s < 0.1
        assert on.acts == [("anna", OperatorAction.LIFT_STOP)]

    stage(scene)


def test_the_author_of_a_stop_is_asked_and_says_yes(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, ben = on.people["anna"], on.people["ben"]
        await anna.console.stop_robot("scout1", "child in the room")
        lifting = on.lift("ben")
        await on.until(anna.question)
        assert (anna.question().topic, anna.question().user) == ("lift", "ben")
        assert anna.question().line == "ben asks whether scout1, which you stopped, may move again"
        assert ben.asked().startswith("asked anna for leave to lift the stop of scout1")
        assert on.robot.latch.state.is_stopped
        anna.console.decide(True)
        assert await lifting
        assert not on.robot.latch.state.is_stopped
        assert anna.question() is None
        assert ben.asked() == "anna lets scout1 move"
        assert on.acts == [
            ("ben", OperatorAction.ASK_LIFT),
            ("anna", OperatorAction.LET_LIFT),
            ("ben", OperatorAction.LIFT_STOP),
        ]

    stage(scene)


@pytest.mark.parametrize("is_answered", [True, False])
def test_a_no_or_silence_keeps_the_stop_and_says_so(stage: Callable[[Scene], None], is_answered: bool) -> None:
    async def scene(on: Stage) -> None:
        anna, ben = on.people["anna"], on.people["ben"]
        await anna.console.stop_robot("scout1")
        began_s = on.clock.now_s()
        lifting = on.lift("ben")
        await on.until(anna.question)
        if is_answered:
            anna.console.decide(False, "not yet")
        assert not await lifting
        assert on.robot.latch.state.is_stopped
        assert ben.asked() == f"anna keeps scout1 stopped: {'not yet' if is_answered else 'no answer'}"
        assert (on.clock.now_s() - began_s >= CONSENT_WITHIN_S - 0.1) is not is_answered
        assert anna.question() is None
        await on.clock.sleep_s(60.0)
        assert ben.asked() == "", "an old answer is no news"

    stage(scene)


def test_an_author_who_left_keeps_no_robot_standing(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, ben = on.people["anna"], on.people["ben"]
        await anna.console.stop_robot("scout1")
        anna.console.end("goes home")
        await on.clock.sleep_s(0.5)
        assert await on.lift("ben")
        assert ben.asked() == "anna lets scout1 move: is not here any more"
        assert not on.robot.latch.state.is_stopped

    stage(scene)


def test_an_author_who_sits_at_another_screen_by_now_is_asked_there(
    stage: Callable[[Scene], None], beside: Any
) -> None:
    async def scene(on: Stage) -> None:
        anna = on.people["anna"]
        await anna.console.stop_robot("scout1")
        anna.console.end("goes to another room")
        there = Person("anna", on, "tablet")
        async with beside(there.console):
            lifting = on.lift("ben")
            await on.until(there.question)
            there.console.decide(False, "not yet")
            assert not await lifting
            assert on.people["ben"].asked() == "anna keeps scout1 stopped: not yet"

    stage(scene)


def test_a_program_that_watches_under_an_authors_name_is_not_that_author(
    stage: Callable[[Scene], None], beside: Any
) -> None:
    async def scene(on: Stage) -> None:
        anna = on.people["anna"]
        await anna.console.stop_robot("scout1")
        anna.console.end("goes home")
        launch = on.launch(Subsystem.UI_CONSOLE, "logger", "console")
        bus = on.network.join(launch.address, on.clock)
        logger: Observer[Any] = Observer(
            launch, bus, on.clock, show=lambda event: None, user="anna", answers_of=no_person_here
        )
        async with beside(logger):
            began_s = on.clock.now_s()
            assert await on.lift("ben")
            assert on.clock.now_s() - began_s < 1.0

    stage(scene)


def test_an_author_who_leaves_while_being_asked_keeps_it_no_longer(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna = on.people["anna"]
        await anna.console.stop_robot("scout1")
        lifting = on.lift("ben")
        await on.until(anna.question)
        anna.console.end("goes home")
        assert await lifting

    stage(scene)


def test_all_who_stopped_it_are_asked_and_one_no_is_enough(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, ben, cleo = (on.people[name] for name in PEOPLE)
        await anna.console.stop_robot("scout1")
        await ben.console.stop_robot("scout1")
        lifting = on.lift("cleo")
        await on.until(lambda: anna.question() and ben.question())
        anna.console.decide(True)
        ben.console.decide(False)
        assert not await lifting
        assert cleo.asked() == "anna lets scout1 move; ben keeps scout1 stopped"

    stage(scene)


def test_a_stop_pressed_while_its_author_is_asked_is_not_lifted_by_the_yes(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        anna, cleo = on.people["anna"], on.people["cleo"]
        await anna.console.stop_robot("scout1")
        lifting = on.lift("ben")
        await on.until(anna.question)
        await cleo.console.stop_robot("scout1")
        anna.console.decide(True)
        assert not await lifting
        assert on.robot.latch.state.is_stopped

    stage(scene)


def test_a_lift_of_a_stop_that_is_not_in_force_any_more_lifts_nothing_and_says_so(
    stage: Callable[[Scene], None],
) -> None:
    async def scene(on: Stage) -> None:
        anna = on.people["anna"]
        await anna.console.stop_robot("scout1")
        seen = on.robot.latch.state.number
        await anna.console.stop_robot("scout1")
        assert not await anna.console.lift_stop("scout1", seen)
        assert on.robot.latch.state.is_stopped
        lines = [alarm.line for alarm in anna.model.alarm_views()]
        assert any("scout1 was stopped again since" in line for line in lines)

    stage(scene)


def test_stopping_twice_never_lifts(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        for press in range(6):
            person = on.people[PEOPLE[press % 3]]
            await (person.console.stop_all() if press % 2 else person.console.stop_robot("scout1"))
            assert on.robot.latch.state.is_stopped

    stage(scene)


def test_programs_cannot_ask_for_a_lift(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        with pytest.raises(NotAnOperator):
            await on.ear.ask(
                "ui_console/anna", AskLift("scout1", "anna", "ui_console/anna", "ear"), Consent, within_s=1.0
            )

    stage(scene)


def test_rows_say_whose_stop_it_is_and_the_alarm_ends_with_it_for_those_who_came_later_too(
    stage: Callable[[Scene], None], beside: Any
) -> None:
    async def scene(on: Stage) -> None:
        anna, ben = on.people["anna"], on.people["ben"]
        await anna.console.stop_robot("scout1", "child in the room")
        await on.clock.sleep_s(0.1)
        for person, is_mine in ((anna, True), (ben, False)):
            robots, address = person.model.team.robots, f"ui_console/{person.name}"
            stop = robots.stop_view("scout1", on.clock.now_s(), person.name, address)
            assert stop is not None
            assert (stop.by_user, stop.reason, stop.is_mine, stop.also) == ("anna", "child in the room", is_mine, [])
        assert await on.lift("anna")
        await on.clock.sleep_s(0.1)
        for person in on.people.values():
            assert person.model.team.robots.stop_of("scout1") is None
            assert not [alarm for alarm in person.model.alarm_views() if alarm.is_active]

    stage(scene)
