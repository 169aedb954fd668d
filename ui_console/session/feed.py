"""The feed of a console: subscribes to the mission's messages and passes them to the pure model as events.

One feed serves any number of views in a process. It claims no robot and asks few questions: the list of components
once, the round-trip time every ``LINK_EVERY_S``, the radios' counts every ``PULSE_S``. It also carries out an
operator's actions that need no grant.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Iterable

from backbone.addresses import COMPONENT_DATABASE, LAUNCHER, NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.asking import ask_until_answered
from backbone.component.messages import (
    AskParameters,
    AskStatistics,
    AskStory,
    AskTime,
    ComponentState,
    MissionTime,
    Parameters,
    SetParameter,
    Statistics,
    Story,
    StoryEvent,
)
from backbone.component_database.messages import ListTypes, Types
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.mission_log.log import AskLog, AskPeople, Log, PeopleKnown
from backbone.mission_log.operators import OperatorActed
from backbone.nameserver.messages import Appeared, Components, Disappeared, ListComponents, Resolve, Resolved
from backbone.naming import Subsystem, component_of
from backbone.picture.health import MissionHealth
from backbone.picture.mission import LOG_KEPT
from backbone.picture.reasons import reasons_for
from backbone.rc_manager.messages import AskSchedule, Leases
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope, Message
from resource_pool.arc_client import (
    StopState,
    ask_readings,
    ask_stop,
    lift_stop,
    stop_robot,
    watch_readings,
    watch_stops,
)
from ui_console.model.events import CommandRefused, Heard, LinkHeard, LinkTrouble, Said, failed
from ui_console.model.tree_board import is_behavior
from ui_console.session.missing_answers import Answered, quietly
from ui_console.session.unanswered_stops import UnansweredStops

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: a person accepts this delay of a view
LINK_FRESH_S = 0.8  # chosen: a view older than a second must be marked, and drawing takes a moment; machine seconds
LINK_EVERY_S = 0.3  # chosen: one answer may be lost before the view counts as old; machine seconds
PULSE_S = 2.0  # chosen: detects a slow link soon, and a question costs almost nothing; machine seconds

LOG_WITHIN_S = 5.0  # chosen: ten thousand events on a slow link; machine seconds

FeedEvent = Heard | LinkHeard | LinkTrouble | CommandRefused


class LogAway(Refusal):
    """The mission's log cannot be searched now."""

    code = "console.log_away"
    remedy = "Search again in a moment; the table without a search shows what this console heard."


class ConsoleFeed:
    """Turns the messages of a mission into events.

    Args:
        show: Called in the event loop with each event, in order.
    """

    def __init__(self, bus: Bus, clock: Clock, show: Callable[[FeedEvent], None]) -> None:
        self._bus, self._clock, self._show = bus, clock, show
        self._hosts: dict[str, list[Subscription]] = {}
        self._radios: set[str] = set()
        self._robots: set[str] = set()
        self._scheduled: set[str] | None = None
        self._listing = asyncio.Event()
        self._appeared: asyncio.Queue[str] = asyncio.Queue()
        self.listed = asyncio.Event()
        """Set when every component has answered the first questions or timed out."""
        self._is_up = True
        self.unanswered = UnansweredStops(bus, clock, self._hear, self._showing_failure)
        """Stops that no robot answered, to be run by its owner."""

    def listen(self) -> None:
        """Subscribe; once, before ``run``."""
        bus = self._bus
        bus.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, self._heard, latest=True)
        bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard, latest=True)
        bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard)
        bus.subscribe("*/*", Conversation.STATUS, ComponentState, self._heard, latest=True)
        bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard_nameserver)
        bus.subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, self._heard, latest=True)
        watch_stops(bus, self._hear)
        watch_readings(bus, self._hear)
        bus.watch_link(self._heard_link)

    async def run(self) -> None:
        """Ask for the mission's state, now and whenever the link is back, and measure the link; until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._list_when_due(), name="feed:list")
            group.create_task(self._ask_appeared(), name="feed:appeared")
            group.create_task(self._feel_link(), name="feed:link")
            group.create_task(self._feel_pulse(), name="feed:pulse")

    async def stop_robots(self, robots: Iterable[str], reason: str = "", user: str = "") -> list[str]:
        """Stop these robots, all at once, regardless of their holders; return the robots without confirmation.

        While ``unanswered`` runs, the stop of a robot that does not answer is repeated until it does.
        """
        wanted = sorted(set(robots))
        answers = await asyncio.gather(*(self._stop(robot, reason, user) for robot in wanted))
        return [robot for robot, is_stopped in zip(wanted, answers, strict=True) if not is_stopped]

    @property
    def robots(self) -> frozenset[str]:
        """All known robots: those in the schedule, also if their RCs are down, and those that are there."""
        return frozenset(self._robots)

    async def find_robots(self) -> frozenset[str] | None:
        """Return all robots of the mission, also those not known so far; None: the nameserver did not answer."""
        pool = await self._list_of(Subsystem.RESOURCE_POOL, again_within_s=REPLY_TIME_S)
        return None if pool is None else self.robots | {component_of(one.address) for one in pool if one.is_robot}

    async def ask_stop(self, robot: str) -> StopState | None:
        """Return the state of the robot's stop; None: its RC did not answer."""
        with self._showing_failure():
            stop = await ask_stop(self._bus, robot)
            self._hear(stop)
            return stop
        return None

    async def consoles(self) -> list[str] | None:
        """Return the addresses of all consoles of the mission; None: the nameserver did not answer."""
        listed = await self._list_of(Subsystem.UI_CONSOLE)
        return None if listed is None else [one.address for one in listed]

    async def lift(self, stop: StopState, user: str = "") -> bool:
        """Lift the stop of a robot; return whether the robot may move."""
        with self._showing_failure():
            self._hear(await lift_stop(self._bus, stop, user))
            return True
        return False

    async def why(self, name: str) -> list[str]:
        """Return the explanation of the state of this robot, ARC, behavior, console or component, for people."""
        try:
            return (await reasons_for(self._bus, name, self._clock)).lines(self._clock.now_s())
        except Refusal as refusal:
            return [refusal.detail, refusal.remedy]
        except LinkError as error:
            return [f"no component answers: {error}"]

    async def search_log(self, asked: AskLog) -> Log:
        """Return the matching events of the mission's log, as far back as the launcher keeps it.

        Raises:
            LogAway: The launcher did not answer.
            Refusal: It refused the question.
        """
        try:
            return await self._bus.ask(LAUNCHER, asked, Log, within_s=LOG_WITHIN_S)
        except LinkError as error:
            raise LogAway(f"the launcher, which keeps the log, did not answer: {error}") from error

    async def ask_parameters(self, name: str) -> bool:
        """Ask a component for its parameters; return whether it answered."""
        with self._showing_failure():
            address = await self._resolve(name)
            self._hear(await self._bus.ask(address, AskParameters(), Parameters, within_s=REPLY_TIME_S), address)
            return True
        return False

    async def set_parameter(self, name: str, parameter: str, value: object, user: str = "") -> bool:
        """Set a parameter of a component; return whether the component applied it."""
        with self._showing_failure():
            address = await self._resolve(name)
            change = SetParameter(parameter, value, user or self._bus.source)
            answer, now_s = await self._bus.ask(address, change, Parameters, within_s=REPLY_TIME_S), self._clock.now_s()
            self._show(Heard(now_s, change, address))
            self._show(Heard(now_s, answer, address))
            return True
        return False

    def _showing_failure(self) -> Answered:
        """Show a refusal or a missing answer that ends the block."""
        return Answered(lambda error: self._show(failed(self._clock.now_s(), error)))

    async def _stop(self, robot: str, reason: str, user: str) -> bool:
        self.unanswered.begin(robot)
        with self._showing_failure():
            try:
                stop = await stop_robot(self._bus, robot, reason, user, self._clock)
            except LinkError as error:
                self.unanswered.add(robot, reason, user)
                unsure = f"{robot} did not confirm the stop, which this console repeats while it runs"
                raise LinkError(f"{unsure}: {error}") from error
            except Refusal:
                self.unanswered.answered(robot)
                raise
            except asyncio.CancelledError:
                self.unanswered.gave_up(robot)
                raise
            self.unanswered.answered(robot)
            self._hear(stop)
            return stop.is_stopped and stop.is_confirmed  # it may be lifted already, or its radio was silent
        return False

    async def _resolve(self, name: str) -> str:
        resolved = await self._bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)
        return resolved.component.address

    async def _list_of(self, subsystem: Subsystem, again_within_s: float = 0.0) -> list[ComponentState] | None:
        """Return the components of a subsystem; None: the nameserver did not answer, also when asked again."""
        with self._showing_failure():
            question, bus, clock = ListComponents(subsystem=str(subsystem)), self._bus, self._clock
            listing = await ask_until_answered(
                bus, clock, NAMESERVER, question, Components, each_s=REPLY_TIME_S, within_s=again_within_s
            )
            return listing.components
        return None

    async def _list_when_due(self) -> None:
        self._listing.set()
        while True:
            await self._listing.wait()
            self._listing.clear()
            await asyncio.gather(self._list(), self._ask_schedule(), self._ask_types())
            self.listed.set()

    async def _list(self) -> None:
        with self._showing_failure():
            listing = await self._bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
            self._hear(listing)
            behaviors = [one.address for one in listing.components if is_behavior(one)]
            robots = [component_of(one.address) for one in listing.components if one.is_robot]
            await asyncio.gather(
                *map(self._ask_how_it_went, behaviors),
                *map(self._ask_robot, robots),
                self._ask_log(),
            )

    async def _ask_schedule(self) -> None:
        with self._showing_failure():
            self._hear(await self._bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S))

    async def _ask_how_it_went(self, behavior: str) -> None:
        """Show the end of a behavior that finished before this console subscribed."""
        with quietly(behavior, "did not answer with its story"):
            story = await self._bus.ask(behavior, AskStory(), Story, within_s=REPLY_TIME_S)
            for event in story.events:
                if event.what.startswith("finished: "):
                    self._hear(event)

    async def _ask_log(self) -> None:
        """Show the events from before this console subscribed, or from the time its link was down."""
        with quietly("the launcher", "did not answer with its log"):
            self._hear(await self._bus.ask(LAUNCHER, AskPeople(), PeopleKnown, within_s=REPLY_TIME_S))
            self._hear(await self._bus.ask(LAUNCHER, AskLog(most=LOG_KEPT), Log, within_s=REPLY_TIME_S))

    async def _ask_appeared(self) -> None:
        while True:
            address = await self._appeared.get()
            if address == COMPONENT_DATABASE:
                await self._ask_types()
            else:
                await self._ask_robot(component_of(address))

    async def _ask_types(self) -> None:
        """Show the reports of the kinds of robots, with units and ranges."""
        with quietly(COMPONENT_DATABASE, "did not answer with its types"):
            self._hear(await self._bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=REPLY_TIME_S))

    async def _ask_robot(self, robot: str) -> None:
        """Show stop and readings, which are published when they change."""
        with quietly(robot, "did not answer with its stop"):  # a robot of another make may know no such stop
            self._hear(await ask_stop(self._bus, robot))
        with quietly(robot, "did not answer with its readings"):
            readings = await ask_readings(self._bus, robot)
            if readings.at_s >= 0:
                self._hear(readings)

    async def _feel_link(self) -> None:
        while True:
            await self._measure_link()
            await self._clock.sleep_s(LINK_EVERY_S * self._clock.rate)

    async def _feel_pulse(self) -> None:
        while True:
            await self._clock.sleep_s(PULSE_S * self._clock.rate)
            await asyncio.gather(*map(self._count, sorted(self._radios)))

    async def _measure_link(self) -> None:
        asked_s = time.perf_counter()
        try:
            answer = await self._bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=LINK_FRESH_S)
        except LinkError as error:
            log.info("the hub did not answer: %s", error)
            self._show(LinkHeard(self._clock.now_s(), False))
        else:
            self._hear(answer)
            self._show_link(time.perf_counter() - asked_s)

    def _show_link(self, latency_s: float = -1.0) -> None:
        now_s = self._clock.now_s()
        self._show(LinkHeard(now_s, self._is_up, latency_s, now_s + LINK_FRESH_S * self._clock.rate))

    async def _count(self, radio: str) -> None:
        address = f"{Subsystem.RESOURCE_POOL}/{radio}"
        with quietly(radio, "did not answer with its counters"):
            self._hear(await self._bus.ask(address, AskStatistics(), Statistics, within_s=REPLY_TIME_S), address)

    def _heard_nameserver(self, envelope: Envelope[Message]) -> None:
        match envelope.body:
            case Appeared(component=component):
                self._hear(component)
                if component.is_robot or component.address == COMPONENT_DATABASE:
                    self._appeared.put_nowait(component.address)
            case Disappeared() as disappeared:
                self._hear(disappeared)

    def _heard(self, envelope: Envelope[Said]) -> None:
        match envelope.body:
            case Leases():  # ages count from the time of sending
                self._show(Heard(envelope.stamp_s, envelope.body))
            case OperatorActed():
                self._hear(envelope.body, envelope.source)
            case _:
                self._hear(envelope.body)

    def _hear(self, said: Said, source: str = "") -> None:
        """Subscribe to a component that a message names, and show the message."""
        match said:
            case ComponentState():
                self._meet(said)
            case Components():
                for component in said.components:
                    self._meet(component)
            case Schedule():
                self._radios = {rc.rc for rc in said.rcs if rc.sharable and rc.state != "down"}
                scheduled = {rc.rc for rc in said.rcs if rc.is_robot}
                self._robots = (self._robots - ((self._scheduled or set()) - scheduled)) | scheduled
                self._scheduled = scheduled
            case Disappeared(address=gone):  # a robot that crashed remains in the schedule, a removed one does not
                if self._scheduled is not None and component_of(gone) not in self._scheduled:
                    self._robots.discard(component_of(gone))
        self._show(Heard(self._clock.now_s(), said, source))

    def _meet(self, component: ComponentState) -> None:
        """Subscribe to creators, because they publish the load of their hosts and crashed processes."""
        address = component.address
        if component.type == CREATOR and address not in self._hosts:
            self._hosts[address] = [
                self._bus.subscribe(address, Conversation.TELEMETRY, HostLoad, self._heard, latest=True),
                self._bus.subscribe(address, Conversation.EVENTS, ProcessFell, self._heard),
            ]
        if component.is_robot:
            self._robots.add(component_of(address))

    def _heard_link(self, is_up: bool) -> None:
        came_back, self._is_up = is_up and not self._is_up, is_up
        self._show_link()
        if came_back:
            self._listing.set()
