"""A mission with a web console: browsers on the loopback, real sockets and time; placer and ARCs decide nothing."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pytest
from fake_resource_pool import FakeArc, FakePlacer
from known_arcs import lit_types, serve_resources, serve_types
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from backbone.addresses import COMPONENT_DATABASE, LAUNCHER, RC_MANAGER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.component.launch import Launch
from backbone.component.messages import StoryEvent
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.keys import Conversation
from backbone.mission_log.log import AskLog, AskPeople, MissionLog, PeopleKnown
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule
from backbone.wire import Envelope, Message
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import EmergencyQuestion, EmergencyStop, EmergencyStopped, LiftStop
from ui_console.web.hub import WebHub
from ui_console.web.login import TokenRights

MISSION = "web-test"
HIGH, LOW, ANYBODY = "high-token", "low-token", "anybody"
RIGHTS = {HIGH: TokenRights("anna", 100), LOW: TokenRights("ben", 50), ANYBODY: TokenRights("", 10)}
WITHIN_S = 15.0
WIDTH_PX, HEIGHT_PX = 32, 24


def robot_view(robot: str, holders: list[Holder], *until_s: float) -> RcView:
    return RcView(robot, "scout", "up", False, 1.0, holders, 1, [], list(until_s), is_robot=True)


class Browser:
    """What a page does, without a page: keeps the newest of each section, and says that pictures are drawn."""

    def __init__(self, socket_: ClientConnection) -> None:
        self.socket = socket_
        self.view: dict[str, Any] = {}
        self.answers: list[dict[str, Any]] = []
        self.pictures: dict[str, list[int]] = {}
        self.told: dict[str, list[Any]] = {}
        """Lists of keys, and messages of the key in view, by stream."""
        self.news = asyncio.Event()

    async def listen(self) -> None:
        try:
            async for message in self.socket:
                if isinstance(message, bytes):
                    robot = message[1 : 1 + message[0]].decode()
                    (number,) = struct.unpack_from(">I", message, 1 + message[0])
                    packed = message[13 + message[0] :]
                    if robot.startswith(("/keys", "/fields")):
                        self.told.setdefault(robot, []).append(json.loads(packed))
                    else:
                        assert packed.startswith(b"\xff\xd8"), "a JPEG"
                        self.pictures.setdefault(robot, []).append(number)
                    await self.say(do="drawn", robot=robot, number=number)
                else:
                    said = json.loads(message)
                    self.view.update(said.get("view", {}))
                    self.answers += [said["answer"]] if "answer" in said else []
                self.news.set()
        except ConnectionClosed:
            self.news.set()

    async def say(self, **message: Any) -> None:
        await self.socket.send(json.dumps(message))

    async def drive(self, **stick: float) -> None:
        """Say that the stick is held since now."""
        await self.say(do="drive", moment=self.view["own"]["moment"], **stick)

    async def decide(self, *, is_given: bool) -> None:
        """Answer the question on the page."""
        await self.say(do="decide", is_given=is_given, number=self.view["own"]["consent"]["number"])

    async def wait(self, holds: Callable[[], Any], what: str) -> None:
        """Return when this holds of what was heard so far."""
        try:
            async with asyncio.timeout(WITHIN_S):
                while not holds():
                    self.news.clear()
                    await self.news.wait()
        except TimeoutError:
            pytest.fail(f"never: {what}; own: {self.view.get('own')}; alarms: {self.view.get('alarms')}")

    def has_alarm(self, words: str) -> bool:
        return any(words in alarm["line"] for alarm in self.view.get("alarms", []))

    @property
    def is_held(self) -> bool:
        return bool(self.view.get("own", {}).get("is_held"))


class FakeRobot:
    """The RC of a robot, which operators stop and free; nothing moves it here.

    Attributes:
        orders: How often it was told to stop.
        lifts: How often somebody wanted its stop lifted.
        is_deaf: It answers nothing.
    """

    def __init__(self, bus: Bus, clock: MissionClock, name: str, changed: Callable[[StopLatch], None]) -> None:
        self.bus, self._clock, self._address, self._changed = bus, clock, bus.source, changed
        self.latch, self.orders, self.lifts, self.is_deaf = StopLatch(name), 0, 0, False
        bus.serve(bus.source, EmergencyQuestion, self._answer)
        bus.declare_alive(bus.source)

    @property
    def is_stopped(self) -> bool:
        return self.latch.state.is_stopped

    def stop(self, by: str, console: str, reason: str = "") -> None:
        """Stop by an operator elsewhere."""
        self.latch.stop(by, reason, self._clock.now_s(), console)
        self._tell()

    def free(self) -> None:
        """Lift the stop by an operator elsewhere."""
        self.latch.lift(self.latch.state.number, "somebody", self._clock.now_s())
        self._tell()

    def _tell(self) -> None:
        self._changed(self.latch)
        self.bus.publish(self._address, Conversation.EVENTS, self.latch.state)

    async def _answer(self, asked: Envelope[Any]) -> Message:
        if self.is_deaf:
            await self._clock.sleep_s(WITHIN_S)
        match asked.body:
            case EmergencyStop(reason=reason, user=user):
                self.orders += 1
                self.latch.stop(user or asked.source, reason, self._clock.now_s(), asked.source)
            case LiftStop(number=number, user=user):
                self.lifts += 1
                self.latch.lift(number, user or asked.source, self._clock.now_s())
            case _:
                return self.latch.state
        self._tell()
        return self.latch.state


class Stage:
    """A mission with a web console and no operator yet."""

    def __init__(self, network: Any, clock: MissionClock, placer: FakePlacer, rc_manager: Bus) -> None:
        self.placer, self.clock, self.rc_manager = placer, clock, rc_manager
        launch = Launch(
            network.mission, Subsystem.UI_CONSOLE, "web-1", "console", "in this process", "local", "", 0.0, 1.0
        )

        async def join(one_more: Launch) -> Bus:
            return network.join(one_more.address, clock)

        self.hub = WebHub(launch, network.join(launch.address, clock), clock, join, kind="capture")
        self.port, self.path = 0, "/"
        self.robots: dict[str, FakeRobot] = {}
        self.network = network
        self._others: list[Bus] = []

    @property
    def address(self) -> str:
        """Address of the page, for a person who states a name."""
        return f"http://127.0.0.1:{self.port}{self.path}#token={ANYBODY}"

    def place_robots(self, *names: str) -> None:
        """Add robots that can be stopped, without holders."""
        for name in names:
            bus = self.network.join(address(Subsystem.RESOURCE_POOL, name), self.clock)
            self.robots[name] = FakeRobot(bus, self.clock, name, self._stop_changed)
        self.publish_schedule(**dict.fromkeys(names, ""))

    def know_commands(self, types: Sequence[ComponentType] = (), resources: Sequence[Resource] = ()) -> None:
        """Add databases with these types and resources; no types: each robot is held with a lamp beside it."""
        bus = self.network.join(COMPONENT_DATABASE, self.clock)
        serve_types(bus, types or lit_types("capture"))
        serve_resources(bus, resources)
        self._others.append(bus)

    def keep_log(self, events: Iterable[StoryEvent]) -> None:
        """Add a launcher that has kept these events."""
        log, bus = MissionLog(), self.network.join(LAUNCHER, self.clock)
        for event in events:
            log.add(event)

        async def answer(asked: Envelope[Any]) -> Message:
            return log.answer(asked.body) if isinstance(asked.body, AskLog) else PeopleKnown({})

        bus.serve(LAUNCHER, AskLog | AskPeople, answer)
        self._others.append(bus)

    def _stop_changed(self, latch: StopLatch) -> None:
        """Let the ARCs of a stopped robot refuse commands that move it."""
        state = latch.state
        facts = {"rc": state.rc, "number": state.number, "is_stopped": state.is_stopped, "by": state.by}
        refusal = EmergencyStopped(f"{state.rc} was stopped by {state.by}", **facts, reason="", since_s=state.at_s)
        for arc in self.placer.arcs.values():
            if arc.rcs["scout"] == state.rc:
                arc.refusal = refusal if state.is_stopped else None

    async def close(self) -> None:
        for other in self._others:
            await other.close()
        for robot in self.robots.values():
            await robot.bus.close()

    @asynccontextmanager
    async def browser(self, token: str = HIGH, **hello: Any) -> AsyncIterator[Browser]:
        async with self.connection() as connection:
            browser = Browser(connection)
            await browser.say(do="hello", token=token, **hello)
            listening = asyncio.create_task(browser.listen(), name="browser")
            try:
                await browser.wait(lambda: "own" in browser.view, "welcome")
                yield browser
            finally:
                listening.cancel()
                await asyncio.wait({listening})

    def connection(self, **options: Any) -> connect:
        return connect(f"ws://127.0.0.1:{self.port}{self.path}socket", compression=None, proxy=None, **options)

    def grant_all(self) -> None:
        """Grant every ARC its robot at once, as if no other ARC were there."""

        def grant(arc: FakeArc) -> None:
            arc.bus.start(arc.grant())  # type: ignore[attr-defined]

        self.placer.on_arc = grant

    def publish_schedule(self, **arcs: str) -> None:
        """Say which ARC holds which robot; an empty name: none."""
        now_s = self.clock.now_s()
        rcs = [
            robot_view(robot, [Holder(arc, 1, now_s, 0.0)] if arc else [], now_s + 5.0) for robot, arc in arcs.items()
        ]
        schedule = Schedule(now_s, rcs, [], [])
        self.rc_manager.publish(RC_MANAGER, Conversation.SCHEDULE, schedule)

    def answer_who_holds(self) -> None:
        """Let the RC manager know every ARC; granted ARCs hold their robots."""

        async def answer(_asked: Envelope[Any]) -> Message:
            now_s = self.clock.now_s()
            held = [Holder(arc.name, arc.epoch, now_s, 0.0) for arc in self.placer.arcs.values() if arc.granted]
            requests = [
                RequestView(name, arc.parameters["owner"], RequestState.WAITING, [], 0.0, 0.0, 0.0, "", [], 5.0, "", 0)
                for name, arc in self.placer.arcs.items()
            ]
            return Schedule(now_s, [robot_view("scout1", held)], requests, [])

        self.rc_manager.serve(RC_MANAGER, AskSchedule, answer)

    def drives(self, robot: str = "scout1") -> list[tuple[float, Any]]:
        return [
            (at_s, command)
            for arc in self.placer.arcs.values()
            if arc.rcs["scout"] == robot
            for at_s, _epoch, command in arc.commands
        ]
