"""A person at a browser: carries out intents, and puts views and answers into the outbox."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Protocol, assert_never

import msgspec

from backbone.bus.interface import Clock
from backbone.errors import LinkError, Refusal, code_of
from backbone.keys import Conversation
from backbone.moments import Now
from backbone.printable import printable_all
from ui_console.model.console import ConsoleModel
from ui_console.model.debug_views import SeenViews
from ui_console.model.driving import STICK_LASTS_S, GiveWish, move_by_stick
from ui_console.model.events import Attention, CommandApplied, ConsoleEvent, PictureSeen, failed
from ui_console.model.orders import Order
from ui_console.model.team import TeamModel
from ui_console.model.views import view_json
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.observer import AnyObserver
from ui_console.session.teleoperation import Teleoperation
from ui_console.web import protocol
from ui_console.web.found_log import FoundLog
from ui_console.web.key_sight import KeySight, NoSuchKey
from ui_console.web.login import Welcome
from ui_console.web.ordering import Ordering
from ui_console.web.own_console import OwnConsole
from ui_console.web.page_client import PageClient
from ui_console.web.sights import PageSight

log = logging.getLogger(__name__)

MOST_ASKED = 8  # chosen: a person asks one question at a time, and more would burden the mission's services
LATENCY_STEP = (
    0.2  # chosen: weight of the newest picture in the shown latency: it follows within a second and is readable
)

Asked = protocol.WhyRequest | protocol.ParametersRequest | protocol.SetRequest | protocol.SearchLog
Stop = protocol.StopRequest | protocol.StopAllRequest
AtWork = (
    Asked
    | Stop
    | protocol.LiftRequest
    | protocol.OrderRequest
    | protocol.PictureOrder
    | protocol.EndOrders
    | protocol.TakeOver
    | protocol.ReleaseRequest
)


class OperatorServices(Protocol):
    """Services of the server for an operator."""

    observer: AnyObserver
    team: TeamModel
    clock: Clock
    hidden: frozenset[Conversation]

    async def new_console(self, operator: Operator, robot: str, orders: Sequence[Order] = ()) -> Teleoperation:
        """Return a console for this operator; it claims the robot, or gives the orders, as soon as it runs."""

    def watching_changed(self) -> None:
        """Record that an operator wants other pictures."""

    def attention_changed(self) -> None:
        """Record that an operator came or went."""

    def sights_changed(self) -> None:
        """Record that an operator watches other debug views."""

    def keys_changed(self) -> None:
        """Record that an operator watches other messages on the bus."""


class Operator(PageClient):
    """A person at a browser.

    Args:
        services: Services of the server.
        welcome: Identity and priority.
        former: The same person at the same page before a jump in a recording; None: a new page.
    """

    def __init__(self, services: OperatorServices, welcome: Welcome, former: Operator | None = None) -> None:
        super().__init__(welcome, former)
        self.is_there = True
        self.sight: PageSight = PageSight() if former is None else former.sight
        """The debug views that this page shows."""
        self.key_sight: KeySight = KeySight() if former is None else former.key_sight
        """The messages on the bus that this page shows."""
        self.model = ConsoleModel(welcome.user, welcome.user, services.team)
        observer = services.observer
        self.answers = ConsentAnswers(observer.bus, welcome.user, services.clock, self.show, observer.acted)
        """The questions of others to this person."""
        self._services = services
        self._console = OwnConsole(self._new_console, self._show_failed, services.observer.fail)
        self._found: FoundLog | None = None
        self._ordering = Ordering(services.team)
        self._latency_s: dict[str, float] = {}
        self._work: dict[asyncio.Task[None], AtWork] = {}
        self._stops: set[asyncio.Task[None]] = set()

    def obey(self, intent: protocol.Intent) -> None:
        """Carry out the browser's intent; a slow intent runs in its own task."""
        match intent:
            case protocol.Steer(moment, forward, right, speed) if self.model.reach is not None:
                move = move_by_stick(forward, right, speed, self.model.reach)
                self._by_press(moment, lambda console: console.hold(move, STICK_LASTS_S))
            case protocol.Steer():
                pass  # the ARC has no body that moves
            case protocol.StopWheels():
                self.stop()
            case protocol.GiveRequest(moment, word, values, role):
                self._give(moment, GiveWish(word, values, role))
            case protocol.OrderRequest(moment=moment) | protocol.PictureOrder(moment=moment):
                self._begin_order(moment, intent)
            case protocol.Drawn(robot, number):
                self._drawn(robot, number)
            case protocol.Watch(robots):
                self.outbox.watch(frozenset(robots))  # also unknown ones: a page may be older than the server
                self._services.watching_changed()
            case protocol.LookInto(behavior, view):
                self._look(PageSight(behavior, view))
            case protocol.ListKeys() | protocol.ViewKey():
                self._watch_keys(intent)
            case protocol.Acknowledge(key):
                self._acknowledge(key)
            case protocol.MoreLog(number, first):
                self._hand_out(number, first)
            case protocol.Here(is_there):
                self._attend(is_there)
            case protocol.MayI(why):
                self._console.act(lambda console: console.begin_ask_consent(why))
            case protocol.Decide(is_given, number):
                if not self.answers.decide(is_given, number=number):
                    self.refuse("no answer was given: that question is over")
            case protocol.DismissLost():
                self.model.dismiss_lost()
                self.refresh(self._services.clock.now_s())
            case protocol.TakeOver() | protocol.ReleaseRequest() | protocol.EndOrders() | protocol.LiftRequest():
                self._begin(intent)
            case protocol.StopRequest() | protocol.StopAllRequest():
                self._begin_stop(intent)
            case protocol.WhyRequest() | protocol.ParametersRequest() | protocol.SetRequest() | protocol.SearchLog():
                self._begin(intent)
            case _:
                assert_never(intent)

    def stop(self) -> None:
        """Stop the wheels that this operator turns."""
        self._console.act(Teleoperation.stop)

    async def leave(self, reason: str) -> None:
        """Stop the wheels and release the robot; afterwards the operator is gone, and no emergency stop is under way.

        Emergency stops are carried out to their end, because their operator expects robots to stand.
        """
        stops, work = list(self._stops), list(self._work)
        for task in work:
            task.cancel()
        if work:
            await asyncio.wait(work)
        self.is_there = False
        await self._console.leave(reason)
        if stops:
            await asyncio.wait(stops)
        self._services.watching_changed()
        self._services.sights_changed()
        self._services.attention_changed()

    def show(self, event: ConsoleEvent) -> None:
        """Process an event of this operator's robot."""
        if isinstance(event, Attention):
            self.is_there = event.is_there
            self._services.attention_changed()
            return
        self.model.apply(printable_all(event))
        if not isinstance(event, PictureSeen | CommandApplied):
            self.refresh(self._services.clock.now_s())

    def saw(self, robot: str, number: int, captured_s: float, packet: bytes) -> None:
        """Process a picture of a robot that this operator may watch."""
        if robot in self.outbox.watched:
            self.model.apply(PictureSeen(self._services.clock.now_s(), captured_s, robot))
            self.outbox.put_picture(robot, number, captured_s, packet)
            self.news.set()

    def show_views(self, seen: SeenViews) -> None:
        """Send the list of a behavior's debug views."""
        self.put("seen", msgspec.json.encode(seen))

    def saw_view(self, stream: str, number: int, at_s: float, packed: bytes) -> None:
        """Send a picture of a debug view, or the newest of the messages that this page watches."""
        self.outbox.put_picture(stream, number, at_s, packed)
        self.news.set()

    def refresh(self, now_s: float) -> None:
        """Send the changes of this operator's own part of the view, and of the alarms."""
        model, put = self.model, self.put
        model.sees = model.robot in self.outbox.watched
        model.look(now_s)
        put("own", view_json(model.own(now_s)))
        put("abilities", view_json(model.abilities))
        put("robots", msgspec.json.encode(model.robots(now_s)))
        put("links", msgspec.json.encode(model.links(now_s)))
        put("alarms", msgspec.json.encode(model.alarm_views()))
        put("drawn", msgspec.json.encode({robot: round(at, 3) for robot, at in sorted(self._latency_s.items())}))

    def schedule_heard(self) -> None:
        """React to a new schedule: ask why this operator waits, if so."""
        self._console.act(Teleoperation.schedule_heard)

    def _by_press(self, moment: int, act: Callable[[Teleoperation], None]) -> None:
        """Move the robot, unless the press is from an earlier moment; this also covers a late message."""
        if moment == self.model.moment:
            self._console.act(act)

    def _give(self, moment: int, wish: GiveWish) -> None:
        """Send a command, unless the robot was stopped, freed, granted or lost since the page showed it."""
        if moment == self.model.moment:
            self._console.act(lambda console: console.give(wish))
        else:
            self.refuse(f"{wish.word} was not given: the robot's state has changed; press again")

    def _begin_order(self, moment: int, intent: protocol.OrderRequest | protocol.PictureOrder) -> None:
        """Give orders, unless a robot was stopped, freed, granted or lost since the page showed it."""
        if moment == self.model.moment:
            self._begin(intent)
        else:
            self.refuse("no order was given: the robot's state has changed; tap again")

    def _drawn(self, robot: str, number: int) -> None:
        captured_s = self.outbox.drawn(robot, number)
        self.news.set()
        if captured_s is not None and "/" not in robot:  # neither a debug view nor a message of a key
            self._ordering.drawn(robot, captured_s)
            took_s = max(0.0, self._services.clock.now_s() - captured_s)
            before_s = self._latency_s.get(robot, took_s)
            self._latency_s[robot] = before_s + LATENCY_STEP * (took_s - before_s)

    def _look(self, sight: PageSight) -> None:
        if sight.behavior != self.sight.behavior:
            self.show_views(SeenViews(sight.behavior))
        self.sight = sight
        self.outbox.look(sight.stream)
        self._services.sights_changed()

    def _watch_keys(self, intent: protocol.ListKeys | protocol.ViewKey) -> None:
        try:
            self.key_sight = self.key_sight.after(intent, self._services.hidden)
        except NoSuchKey as refusal:
            self.refuse(f"{refusal.detail}. {refusal.remedy}")
            return
        self.outbox.open_beside(self.key_sight.streams)
        self._services.keys_changed()

    def _acknowledge(self, key: str) -> None:
        seen = self.model.acknowledge(key)
        if seen:
            self._services.observer.acknowledged(seen, key, self.welcome.user)
            self.refresh(self._services.clock.now_s())

    def _attend(self, is_there: bool) -> None:
        if is_there:
            self._console.act(Teleoperation.touch)
        else:
            self._console.act(Teleoperation.leave)
        if self.is_there != is_there:
            self.is_there = is_there
            self._services.attention_changed()

    def _begin(self, intent: AtWork) -> None:
        """Begin an intent; a repetition of the newest one at work has no effect of its own."""
        if intent == next(reversed(self._work.values()), None):
            return
        if isinstance(intent, Asked) and len(self._work) >= MOST_ASKED:
            self.refuse("too much is being asked at once; wait for the answers")
            return
        task = asyncio.create_task(self._do(intent), name=f"{self.welcome.user}:{type(intent).__name__}")
        self._work[task] = intent
        task.add_done_callback(self._done)

    def _begin_stop(self, intent: Stop) -> None:
        """Begin an emergency stop; every press counts, because an earlier stop at work may be lifted already."""
        task = asyncio.create_task(self._do(intent), name=f"{self.welcome.user}:{type(intent).__name__}")
        self._stops.add(task)
        task.add_done_callback(self._done)

    async def _do(self, intent: AtWork) -> None:
        observer, user = self._services.observer, self.welcome.user
        match intent:
            case protocol.TakeOver(robot, kind):
                await self._console.take(robot, kind)
            case protocol.OrderRequest() | protocol.PictureOrder():
                await self._order(intent)
            case protocol.EndOrders(robots):
                await self._console.end_orders(robots, self.model.robot)
            case protocol.ReleaseRequest():
                await self._console.give_back(f"{user} released it")
            case protocol.StopRequest(robot):
                await self._stop(robot)
            case protocol.StopAllRequest():
                self._console.act(Teleoperation.require_let_go)
                self._report_unsure(await observer.stop_all("", user))
            case protocol.LiftRequest(robot, number):
                await observer.lift_stop(robot, number, user, self.show)
            case protocol.WhyRequest(name):
                self.answer({"why": name, "lines": await observer.why(name)})
            case protocol.ParametersRequest(name):
                self.answer({"parameters": name, "told": await observer.feed.ask_parameters(name)})
            case protocol.SearchLog():
                await self._search(intent)
            case protocol.SetRequest(name, parameter, value):
                is_set = await observer.set_parameter(name, parameter, value, user)
                self.answer({"set": name, "parameter": parameter, "done": is_set})
            case _:
                assert_never(intent)
        self.refresh(self._services.clock.now_s())

    async def _search(self, wanted: protocol.SearchLog) -> None:
        """Search the mission's log; the page fetches the rest of the result part by part."""
        clock = self._services.clock
        now = Now(clock.now_s(), datetime.now(), clock.rate)
        try:
            found = await self._services.observer.feed.search_log(wanted.asked(now))
        except Refusal as refusal:
            refused = {"code": code_of(refusal), "refused": refusal.detail, "remedy": refusal.remedy}
            self.answer({"log": {"number": wanted.number, **refused}})
            return
        self._found = FoundLog(wanted.number, found, now)
        self._hand_out(wanted.number, 0)

    def _hand_out(self, number: int, first: int) -> None:
        """Send a part of the result, unless the page means an earlier search."""
        if self._found is not None and self._found.number == number:
            self.answer({"log": self._found.part(first)})

    async def _stop(self, robot: str) -> None:
        """Emergency stop; the wheels that this operator drives also stop."""
        self._console.act(Teleoperation.require_let_go)
        is_known = robot in self._services.team.robots.names()
        is_stopped = is_known and await self._services.observer.stop_robot(robot, "", self.welcome.user)
        self._report_unsure([] if is_stopped else [robot])

    def _report_unsure(self, robots: list[str]) -> None:
        if robots:
            self.refuse(f"not certain to have stopped: {', '.join(robots)}")

    async def _order(self, intent: protocol.OrderRequest | protocol.PictureOrder) -> None:
        try:
            is_given = await self._console.order(lambda: self._ordering.orders_for(intent))
        except Refusal as refusal:
            self.refuse(f"{refusal.detail}. {refusal.remedy}")
            return
        if not is_given:
            self.refuse("no order was given: your console is not ready; tap again")

    async def _new_console(self, robot: str, orders: Sequence[Order]) -> Teleoperation:
        console = await self._services.new_console(self, robot, orders)
        self.model.name = console.name  # other consoles of this person are other screens
        return console

    def _show_failed(self, error: Refusal | LinkError) -> None:
        self.show(failed(self._services.clock.now_s(), error))

    def _done(self, task: asyncio.Task[None]) -> None:
        self._work.pop(task, None)
        self._stops.discard(task)
        if not task.cancelled() and (bug := task.exception()) is not None:
            self._services.observer.fail(bug)
