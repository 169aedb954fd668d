"""The feed hears a mission, in one process on virtual time; what needs no grant goes through it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Any

import msgspec
import pytest
from console_scenes import SCHEDULE

from backbone.addresses import LAUNCHER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.abilities import Abilities, field_forms
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import Absence, StoryEvent
from backbone.component_database.messages import ComponentType, ListTypes, TypeCount, Types
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem
from backbone.picture.health import HealthWord, MissionHealth
from backbone.rc_manager.messages import AskSchedule, Leases
from backbone.scheduling.requests import Lease
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope, Message
from resource_pool.messages import AskReadings, Readings
from resource_pool.robots.rover.report import RoverReport
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop, EmergencyStop, LiftStop
from ui_console.model.console import ConsoleModel
from ui_console.model.events import ConsoleEvent, event_json, event_word
from ui_console.model.views import AlarmKind, view_json
from ui_console.session.feed import PULSE_S
from ui_console.session.observer import Observer

Scene = Callable[["Stage"], Awaitable[None]]


class Watcher(Component[Any]):
    """A behavior with a parameter."""

    class Parameters(NoParameters, frozen=True):
        threshold: int = 20

    parameters_type = Parameters


class RcManager(Component[Any]):
    """Answers with one schedule."""

    accepts = AskSchedule

    async def answer(self, asked: Envelope[Any]) -> Message:
        return SCHEDULE


class Robot(Component[Any]):
    """Only stops and moves again; silent on request."""

    is_robot = True
    accepts = AskStop | AskReadings | EmergencyStop | LiftStop

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.latch = StopLatch(self.name)
        self.readings = Readings(self.name, -1.0)

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case AskReadings():
                return self.readings
            case EmergencyStop(reason=reason, user=user):
                self.latch.stop(user, reason, self.clock.now_s())
            case LiftStop(number=number, user=user):
                self.latch.lift(number, user, self.clock.now_s())
        return self.latch.state


class Database(Component[Any]):
    """Knows one kind of robot, which reports as a rover does."""

    accepts = ListTypes

    async def answer(self, asked: Envelope[Any]) -> Message:
        abilities = Abilities(is_robot=True, reports=field_forms(RoverReport))
        return Types([TypeCount(ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL, abilities=abilities), 1)])


class Stage:
    """A mission with few players and one observer."""

    def __init__(self, network: Any, beside: Any) -> None:
        self.network, self.beside, self.clock = network, beside, VirtualClock()
        self.model = ConsoleModel("console-1", "anna")
        self.events: list[ConsoleEvent] = []

    def show(self, event: ConsoleEvent) -> None:
        self.events.append(event)
        self.model.apply(event)

    def make(self, kind: type[Component[Any]], subsystem: Subsystem, name: str, type_name: str, **more: Any) -> Any:
        launch = Launch(
            "local", subsystem, name, type_name, "x:Y", "local", "", 0.0, 1.0, requester="backbone/launcher"
        )
        return kind(launch, self.network.join(launch.address, self.clock), self.clock, **more)

    def observer(self) -> Any:
        return self.make(Observer, Subsystem.UI_CONSOLE, "console-1", "console", show=self.show, user="anna")

    def robot(self, name: str) -> Any:
        return self.make(Robot, Subsystem.RESOURCE_POOL, name, "scout")

    def manager(self) -> Any:
        return self.make(RcManager, Subsystem.BACKBONE, "rc_manager", "rc_manager")

    async def until(self, condition: Callable[[], Any], within_s: float = 10.0) -> None:
        deadline_s = self.clock.now_s() + within_s
        while not condition():
            assert self.clock.now_s() < deadline_s, [event_word(event) for event in self.events]
            await self.clock.sleep_s(0.01)

    def words(self) -> set[str]:
        return {event_word(event) for event in self.events}


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission() as network:
                await scene(Stage(network, beside))

        run_virtual(main())

    return run


def test_one_that_comes_late_hears_how_things_are_and_then_what_changes(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        async with on.beside(on.manager()) as manager, on.beside(on.robot("scout1")) as robot:
            robot.latch.stop("ben", "fire", 0.0)
            async with on.beside(on.observer()):
                await on.until(lambda: {"schedule", "components", "stop"} <= on.words())
                assert [row.robot for row in on.model.robots(8.0)] == ["scout1", "scout2"]
                stop = on.model.team.robots.stop_of("scout1")
                assert stop is not None
                assert stop.by == "ben"
                manager.bus.publish(RC_MANAGER, Conversation.SCHEDULE, Schedule(9.0, [], [], []))
                await on.until(lambda: not on.model.robots(9.0))
                manager.bus.publish(RC_MANAGER, Conversation.LEASES, Leases([Lease("a", "b", 1)], 2.0))
                manager.publish_event("scout1", "saw something")
                await on.until(lambda: "leases" in on.words() and on.model.log())
                assert on.model.log()[-1].what == "saw something"

    stage(scene)


def test_what_the_bus_brings_is_printable_text_before_a_screen_sees_it(stage: Callable[[Scene], None]) -> None:
    hostile = "\x1b]0;owned\x07\x1b[2J\rall is well\u202e"

    async def scene(on: Stage) -> None:
        async with on.beside(on.manager()) as manager, on.beside(on.robot("scout1")) as robot, on.beside(on.observer()):
            await on.until(lambda: "components" in on.words())
            story = StoryEvent(1.0, hostile, hostile, hostile, hostile)
            manager.bus.publish(RC_MANAGER, Conversation.LOG, story)
            absent = [Absence(hostile, 1.0, hostile, hostile, "x" * 1_000_000)]
            health = MissionHealth(HealthWord.FAILED, absent)
            manager.bus.publish(LAUNCHER, Conversation.HEALTH, health)
            robot.report(hostile)
            said = {"story", "health"}
            await on.until(lambda: said <= on.words() and "all is well" in on.model.view(2.0).robots[0].feedback)
            shown = view_json(on.model.view(2.0)).decode()
            assert shown.isprintable()
            assert len(shown) < 100_000
            assert all(event_json(event).decode().isprintable() for event in on.events)

    stage(scene)


def test_a_death_is_an_alarm_and_a_good_end_is_none(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        async with on.beside(on.manager()), on.beside(on.observer()):
            async with on.beside(on.robot("scout1")):
                await on.until(lambda: on.model.team.component("scout1"))
            await on.until(lambda: on.model.team.component("scout1") is None)
            assert on.model.alarm_views() == []
            dying = on.robot("scout2")
            async with on.beside(dying):
                await on.until(lambda: on.model.team.component("scout2"))
                await dying.leave_bus()
                await on.until(on.model.alarm_views)
            [alarm] = on.model.alarm_views()
            assert (alarm.kind, alarm.subject) == (AlarmKind.LOST, "scout2")

    stage(scene)


@pytest.mark.parametrize("is_late", [False, True])
def test_what_robots_report_is_asked_of_the_database_also_of_one_that_comes_late(
    stage: Callable[[Scene], None], is_late: bool
) -> None:
    async def scene(on: Stage) -> None:
        database = on.make(Database, Subsystem.BACKBONE, "component_database", "component_database")
        robot = on.robot("scout1")
        async with on.beside(on.manager()), on.beside(robot), AsyncExitStack() as later:
            if not is_late:
                await later.enter_async_context(on.beside(database))
            await later.enter_async_context(on.beside(on.observer()))
            await on.until(lambda: "components" in on.words())
            if is_late:
                assert "types" not in on.words()
                await later.enter_async_context(on.beside(database))
            await on.until(lambda: "types" in on.words())
            robot.bus.publish(robot.address, Conversation.READINGS, Readings("scout1", 1.0, {"lift": 0.25}))
            await on.until(lambda: on.model.robots(2.0)[0].gauges)
            assert [gauge.span for gauge in on.model.robots(2.0)[0].gauges] == ["0 to 1"]

    stage(scene)


@pytest.mark.parametrize("is_late", [False, True])
def test_readings_from_before_it_heard_the_robot_are_asked_for(stage: Callable[[Scene], None], is_late: bool) -> None:
    async def scene(on: Stage) -> None:
        database = on.make(Database, Subsystem.BACKBONE, "component_database", "component_database")
        robot = on.robot("scout1")
        robot.readings = Readings("scout1", 0.0, {"lift": 0.25})
        async with on.beside(on.manager()), on.beside(database), AsyncExitStack() as later:
            if is_late:
                await later.enter_async_context(on.beside(robot))
            await later.enter_async_context(on.beside(on.observer()))
            await on.until(lambda: "components" in on.words())
            if not is_late:
                await later.enter_async_context(on.beside(robot))
            await on.until(lambda: on.model.robots(2.0) and on.model.robots(2.0)[0].gauges)

    stage(scene)


def test_hosts_and_what_fell_there_are_heard_from_their_creators(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        creator = on.make(Component, Subsystem.BACKBONE, "creator-local", "creator")
        async with on.beside(on.manager()), on.beside(creator), on.beside(on.observer()):
            await on.until(lambda: "components" in on.words())
            await on.clock.sleep_s(0.1)
            creator.bus.publish(creator.address, Conversation.TELEMETRY, HostLoad("local", [], 0.5, 0.2, 2, 3))
            fell = ProcessFell("scout1", "signal 9", -1.0, [])
            creator.bus.publish(creator.address, Conversation.EVENTS, fell)
            await on.until(lambda: {"load", "fell"} <= on.words())
            assert on.model.team.links.hosts(0.0)[0].load.host == "local"
            assert "given up" in on.model.alarm_views()[0].line

    stage(scene)


def test_the_pulse_measures_the_link_and_counts_the_radio(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        radio = on.make(Component, Subsystem.RESOURCE_POOL, "radio", "command_radio")
        async with on.beside(on.manager()), on.beside(radio), on.beside(on.observer()):
            await on.clock.sleep_s(2.5 * PULSE_S)
            links = {link.name: link for link in on.model.links(0.0)}
            assert links["hub"].latency_s >= 0
            assert "packets sent" in links["radio"].feedback

    stage(scene)


def test_all_robots_are_stopped_also_those_not_heard_of_and_a_silent_one_is_named(
    stage: Callable[[Scene], None],
) -> None:
    async def scene(on: Stage) -> None:
        console = on.observer()
        one, other = on.robot("scout1"), on.robot("scout9")
        async with on.beside(one), on.beside(other), on.beside(on.manager()), on.beside(console):
            await on.until(lambda: "schedule" in on.words())
            unsure = await console.stop_all("fire")
            assert unsure == ["scout2"]
            for robot in (one, other):
                state = robot.latch.state
                assert (state.is_stopped, state.by, state.reason) == (True, "anna", "fire")
            lines = [alarm.line for alarm in on.model.alarm_views()]
            assert any("scout2 did not confirm the stop" in line for line in lines)
            assert await console.lift_stop("scout1", one.latch.state.number)
            assert on.model.team.robots.stop_of("scout1") is None
            assert not one.latch.state.is_stopped

    stage(scene)


def test_a_robot_that_was_removed_is_not_told_to_stop_and_one_that_crashed_is(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        console, manager = on.observer(), on.manager()
        async with on.beside(manager), on.beside(console):
            async with on.beside(on.robot("scout1")), on.beside(on.robot("scout2")), on.beside(on.robot("scout9")):
                await on.until(lambda: "schedule" in on.words() and console.feed.robots >= {"scout1", "scout9"})
                assert await console.stop_all() == []
                left = msgspec.structs.replace(SCHEDULE, rcs=[rc for rc in SCHEDULE.rcs if rc.rc != "scout1"])
                manager.bus.publish(manager.address, Conversation.SCHEDULE, left)
                await on.clock.sleep_s(0.1)
                assert await console.stop_all() == [], "it still answers"
            await on.clock.sleep_s(0.1)
            assert await console.stop_all() == ["scout2"]

    stage(scene)


@pytest.mark.parametrize("stops", [0, 1], ids=["lost", "unreadable"])
def test_the_stop_of_a_robot_is_that_of_its_present_rc_also_if_earlier_ones_were_lost(
    stage: Callable[[Scene], None], stops: int
) -> None:
    """Another host, for example, has no file of the stops."""

    async def scene(on: Stage) -> None:
        def number() -> int | None:
            stop = on.model.team.robots.stop_of("scout1")
            return None if stop is None else stop.number

        async with on.beside(on.manager()), on.beside(on.observer()) as console:
            async with on.beside(on.robot("scout1")):
                await on.until(lambda: "scout1" in console.feed.robots)
                for user in ("anna", "ben", "eve"):
                    assert await console.stop_robot("scout1", "", user)
            await on.until(lambda: on.model.team.component("scout1") is None)
            again = on.robot("scout1")
            for _stop in range(stops):
                again.latch.stop("unknown", "", 0.0)
            async with on.beside(again):
                await on.until(lambda: number() == (stops or None))

    stage(scene)


def test_each_thing_an_operator_does_is_one_event_with_the_name(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        console, robot = on.observer(), on.robot("scout1")
        watcher = on.make(Watcher, Subsystem.MISSION_CONTROL, "watch1", "watch")
        heard: list[OperatorActed] = []
        async with on.beside(on.manager()) as manager, on.beside(robot), on.beside(watcher):
            manager.bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda said: heard.append(said.body))
            async with on.beside(console):
                await on.until(lambda: "schedule" in on.words())
                await console.stop_robot("scout1", "child in the room")
                await console.stop_all("fire")
                await console.lift_stop("scout1", robot.latch.state.number)
                await console.set_parameter("watch1", "threshold", 30)
                await console.set_parameter("watch1", "threshold", "high")
                console.acknowledged(2)
                console.acknowledged(0)
                await on.clock.sleep_s(0.1)
                logged = [row.what for row in on.model.log()]
            await on.clock.sleep_s(0.1)
        assert {act.user for act in heard} == {"anna"}
        assert [(act.action, act.subject, act.detail) for act in heard] == [
            (OperatorAction.ATTACH, "console-1", "to watch"),
            (OperatorAction.STOP_ROBOT, "scout1", "child in the room"),
            (OperatorAction.STOP_ALL, "robots", "scout1, scout2, fire"),
            (OperatorAction.LIFT_STOP, "scout1", "stop 2 by anna"),
            (OperatorAction.SET_PARAMETER, "watch1", "threshold = 30"),
            (OperatorAction.SET_PARAMETER, "watch1", 'threshold = "high", which it did not take'),
            (OperatorAction.ACKNOWLEDGE, "alarms", "all 2"),
            (OperatorAction.DETACH, "console-1", ""),
        ]
        assert logged.count("anna stops it: child in the room") == 1, "the operator's own log tells it once, too"
        told = [event.what for event in console.story.of("scout1")]
        assert "anna stops it: child in the room" in told

    stage(scene)


def test_a_parameter_is_told_changed_and_refused(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        console = on.observer()
        watcher = on.make(Watcher, Subsystem.MISSION_CONTROL, "watch1", "watch")
        async with on.beside(on.manager()), on.beside(watcher), on.beside(console):
            assert await console.feed.ask_parameters("watch1")
            assert await console.set_parameter("watch1", "threshold", 30)
            [parameter] = on.model.team.parameters()
            assert (parameter.value, parameter.before, parameter.changed_by) == ("30", "20", "anna")
            assert watcher.parameters.threshold == 30
            assert not await console.set_parameter("watch1", "threshold", "high")
            assert not await console.set_parameter("watch1", "nothing", 1)
            assert not await console.feed.ask_parameters("nobody")
            assert watcher.parameters.threshold == 30
            assert on.model.alarm_views()

    stage(scene)


def test_why_asks_whoever_knows_and_says_so_if_nobody_does(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        console = on.observer()
        async with on.beside(on.manager()), on.beside(on.robot("scout1")), on.beside(console):
            assert any("scout1 is ready" in line for line in await console.why("scout1"))
            assert all(await console.why("nobody"))

    stage(scene)
