"""The hub for all browsers: one subscription to the mission, one model of it, and one copy of each robot's pictures."""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
import re
from collections.abc import Awaitable, Callable, Sequence

import msgspec
import numpy as np

from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.launch import Launch
from backbone.component.messages import LifeState, LogLevel
from backbone.keys import Conversation
from backbone.mission_log.lines import event_json
from backbone.mission_log.operators import OperatorAction
from backbone.naming import Subsystem, address
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope, plain
from resource_pool.arc_client import Frame
from ui_console.model.console import ConsoleModel
from ui_console.model.debug_views import SeenViews
from ui_console.model.events import ConsoleEvent, Heard
from ui_console.model.orders import Order
from ui_console.model.team import TeamModel
from ui_console.model.views import AlarmKind
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.observer import AnyObserver, Observer
from ui_console.session.teleoperation import Teleoperation
from ui_console.web.floor import FloorSection
from ui_console.web.key_ears import BusEar
from ui_console.web.key_sight import NO_MESSAGES
from ui_console.web.key_watch import KeyWatch
from ui_console.web.login import ProtocolViolation, ViolationKind, Welcome
from ui_console.web.operator import Operator
from ui_console.web.outbox import Outbox
from ui_console.web.pictures import jpeg, packet
from ui_console.web.protocol import Intent
from ui_console.web.sights import Sights

log = logging.getLogger(__name__)

OWN_EVERY_S = 0.25  # chosen: people read no faster; events of their own robot are shown at once
TEAM_EVERY = 4  # chosen: the tables of the whole mission cost more, so only every fourth refresh has them
TOLD_EVERY_S = 10.0  # chosen: so that a client with a thousand violations a second does not fill a recording
MAX_USER_IN_NAME = 24  # chosen: leaves room for the unique part of a component's name, and its ARC's

LIFT_REMEDY = "When the robot may move, hold “Hold to lift” on its picture."
Join = Callable[[Launch], Awaitable[Bus]]


class WebHub:
    """Serves any number of operators from one process.

    Args:
        launch: Launch of the component that subscribes to the mission; operators' consoles are launched in the same
            way.
        bus: Bus of that component.
        clock: The mission's clock.
        join: Opens a bus for one more component of this process.
        kind: Component type of the ARCs that operators claim; empty: one for the robot, with pictures.
        away_after_s: Time without an operator's action after which a console releases its robot; 0: never.
    """

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        join: Join,
        *,
        kind: str = "",
        away_after_s: float = 0.0,
    ) -> None:
        self.clock = clock
        self.team = TeamModel(launch.mission, LIFT_REMEDY)
        self.observer: AnyObserver = Observer(
            launch,
            bus,
            clock,
            show=self._heard,
            signs_in=False,
            user=launch.name,
            answers_of=self._answers_of,
            has_map=True,
        )
        self.mission = launch.mission
        self.hidden = NO_MESSAGES
        """Conversations that pages do not view."""
        self.served = [launch.mission]
        """Names of all missions of the same server."""
        self.clients: dict[Operator, None] = {}
        self._model = ConsoleModel(launch.name, launch.name, self.team, sees=False, alarms=self.team.alarms)
        self._launch, self._bus, self._join = launch, bus, join
        self._kind, self._away_after_s = kind, away_after_s
        self._floor = FloorSection()
        self._arcs: dict[str, str] = {}
        self._streams: dict[str, tuple[str, Subscription]] = {}
        self._numbers: dict[str, int] = {}
        self.sights = Sights(bus, clock, lambda: self.clients, self.observer.start_task)
        """The debug views that its operators look at."""
        self.keys = KeyWatch(BusEar(bus, clock), clock, lambda: self.clients, self.observer.start_task)
        """The messages on the bus that its operators look at."""
        self._consoles = itertools.count(1)
        self._has_operators = asyncio.Event()
        self._told_s: dict[ViolationKind, float] = {}
        self.pictures_packed = 0
        """Number of pictures encoded as JPEG."""

    def enter(self, welcome: Welcome, former: Operator | None = None) -> Operator:
        """Return a new operator, whose page gets the whole view; ``former`` as in ``Operator``."""
        operator = Operator(self, welcome, former)
        self.clients[operator] = None
        who = {"user": welcome.user, "priority": welcome.priority}
        welcomed = who | {"mission": self.mission, "missions": self.served}
        operator.outbox.put_section("welcome", msgspec.json.encode(welcomed))
        self._send_tables([operator.outbox])
        self._send_map([operator.outbox])
        operator.show_views(SeenViews())
        operator.refresh(self.clock.now_s())
        self._say(OperatorAction.ATTACH, welcome.user, f"with priority {welcome.priority}")
        self._watch_map()
        self._has_operators.set()
        self.attention_changed()
        return operator

    async def leave(self, client: Operator, reason: str) -> None:
        """Remove an operator; the wheels stop, and the robot is released."""
        self.clients.pop(client, None)
        self._watch_map()
        if not self.clients:
            self._has_operators.clear()
        await client.leave(reason)
        self._say(OperatorAction.DETACH, client.welcome.user, reason)

    async def obey(self, client: Operator, intent: Intent) -> None:
        """Carry out an operator's intent; a slow intent runs in its own task."""
        client.obey(intent)

    def refused(self, client: Operator) -> None:
        """Stop the wheels of an operator whose connection is being closed."""
        client.stop()

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the operators a client's violation.

        Args:
            who: Operator's name or address, for people.
        """
        now_s = self.clock.now_s()
        line = f"{who} {violation.line}"
        key = f"{AlarmKind.VISITOR}:{violation.kind}:{who}"
        self.team.alarms.happened(AlarmKind.VISITOR, "web", line, now_s, violation.remedy, key)
        if now_s >= self._told_s.get(violation.kind, -TOLD_EVERY_S) + TOLD_EVERY_S:
            self._told_s[violation.kind] = now_s
            log.warning("%s", line)
            if self.observer.state is LifeState.READY:
                self.observer.publish_event("web", line, LogLevel.WARNING)

    async def refresh_all(self) -> None:
        """Refresh every operator's view while there are operators; until cancelled."""
        for turn in itertools.count():
            await self._has_operators.wait()
            now_s = self.clock.now_s()
            if turn % TEAM_EVERY == 0:
                self._send_tables([operator.outbox for operator in self.clients])
            await self._floor.follow(self.team.map.floor)
            self._send_map([operator.outbox for operator in self.clients])
            for operator in self.clients:
                operator.refresh(now_s)
            self.sights_changed()
            self.keys_changed()
            await self.clock.sleep_s(OWN_EVERY_S * self.clock.rate)

    # Services for operators, see ``OperatorServices``.
    async def new_console(self, operator: Operator, robot: str, orders: Sequence[Order] = ()) -> Teleoperation:
        """Return a console for this operator; it claims the robot, or gives the orders, as soon as it runs."""
        number, welcome = next(self._consoles), operator.welcome
        wished = {
            "robot": robot,
            "kind": self._kind,
            "priority": welcome.priority,
            "away_after_s": self._away_after_s,
        }
        launch = msgspec.structs.replace(
            self._launch,
            name=f"{_name_from(welcome.user)}-{os.getpid()}-{number}",
            class_path="ui_console.session.teleoperation:Teleoperation",
            parameters=wished,
        )
        bus = await self._join(launch)
        return Teleoperation(
            launch,
            bus,
            self.clock,
            show=operator.show,
            takes=not orders,
            orders=orders,
            watches=False,
            keeps_arc=True,
            signs_in=False,
            user=welcome.user,
            answers=operator.answers,
        )

    def watching_changed(self) -> None:
        """Subscribe to exactly the pictures that an operator watches and that a grant delivers."""
        watched = {robot for operator in self.clients for robot in operator.outbox.watched}
        wanted = {robot: arc for robot, arc in self._arcs.items() if robot in watched}
        for robot, (arc, stream) in list(self._streams.items()):
            if wanted.get(robot) != arc:
                stream.close()
                del self._streams[robot]
        for robot in wanted.keys() - self._streams.keys():
            self._streams[robot] = (wanted[robot], self._listen(robot, wanted[robot]))

    def sights_changed(self) -> None:
        """Watch exactly the debug views that operators watch, as soon as the component runs."""
        if self.observer.state is LifeState.READY:
            self.sights.changed()

    def keys_changed(self) -> None:
        """Watch exactly the messages that operators watch, as soon as the component runs."""
        if self.observer.state is LifeState.READY:
            self.keys.changed()

    def attention_changed(self) -> None:
        """Note whether any operator looks after the mission."""
        self.team.alarms.attention(any(one.is_there for one in self.clients), self.clock.now_s())

    def _answers_of(self, user: str) -> ConsentAnswers | None:
        """Return the questions at the page that this person watches, else at another open page of this person."""
        pages = [one for one in self.clients if one.welcome.user == user]
        return next((page.answers for page in sorted(pages, key=lambda page: not page.is_there)), None)

    def _heard(self, event: ConsoleEvent) -> None:
        self._model.apply(event)
        if isinstance(event, Heard) and isinstance(event.body, Schedule):
            rcs = event.body.rcs
            self._arcs = {rc.rc: rc.holders[0].arc for rc in rcs if rc.is_robot and rc.holders}
            self.watching_changed()
            for operator in self.clients:
                operator.schedule_heard()

    def _listen(self, robot: str, arc: str) -> Subscription:
        def arrived(envelope: Envelope[Frame]) -> None:
            frame = envelope.body
            if frame.robot == robot:
                self._show_picture(frame)

        at = address(Subsystem.RESOURCE_POOL, arc)
        return self._bus.subscribe(at, Conversation.FRAMES, Frame, arrived, latest=True)

    def _show_picture(self, frame: Frame) -> None:
        watchers = [operator for operator in self.clients if frame.robot in operator.outbox.watched]
        if not watchers:
            return
        number = self._numbers[frame.robot] = self._numbers.get(frame.robot, 0) + 1
        picture = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        packed = packet(frame.robot, number, frame.captured_s, jpeg(picture))
        self.pictures_packed += 1
        for operator in watchers:
            operator.saw(frame.robot, number, frame.captured_s, packed)

    def _send_tables(self, outboxes: list[Outbox]) -> None:
        team, now_s = self.team, self.clock.now_s()
        tables: dict[str, object] = {
            "tree": team.tree(),
            "requests": plain(team.requests()),
            "timeline": team.timeline(now_s),
            "health": team.health(now_s),
            "parameters": team.parameters(),
            "components": plain(team.components()),
            "log": [event_json(event) for event in team.log()],
            "now_s": now_s,
        }
        for name, table in tables.items():
            body = msgspec.json.encode(table)
            for outbox in outboxes:
                outbox.put_section(name, body)

    def _watch_map(self) -> None:
        if self.observer.map is not None:
            self.observer.map.watch(bool(self.clients))

    def _send_map(self, outboxes: list[Outbox]) -> None:
        bodies = msgspec.json.encode(self.team.map.views(self.clock.now_s()))
        for outbox in outboxes:
            outbox.put_section("floor", self._floor.body)
            outbox.put_section("bodies", bodies)

    def _say(self, action: OperatorAction, user: str, detail: str) -> None:
        if self.observer.state is LifeState.READY:
            self.observer.acted(action, "web", detail, user)


def _name_from(user: str) -> str:
    """Return the operator's part of a component's name.

    Example:
        >>> _name_from("Anna B."), _name_from("7")
        ('anna-b', 'web-7')
    """
    plain = re.sub(r"[^a-z0-9]+", "-", user.lower()).strip("-")[:MAX_USER_IN_NAME].strip("-")
    return plain if plain and plain[0].isalpha() else f"web-{plain}".strip("-")
