"""The feed of a console: listens to what exists on the bus and hands it to the pure model as events.

One feed serves any number of views in a process. It claims nothing, asks little (who is there, once; what a round trip
takes every ``LINK_EVERY_S``, what the radios counted every ``PULSE_S``), and carries out an operator's verbs that need
no grant.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Iterable
from typing import Any

from backbone.bus.interface import Bus, Clock, Subscription
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
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.errors import LinkError, Refusal
from backbone.health import SILENT_AFTER_S, MissionHealth
from backbone.keys import Conversation
from backbone.mission_log import AskLog, AskPeople, Log, PeopleKnown
from backbone.mission_picture import LAUNCHER
from backbone.nameserver.messages import ADDRESS as NAMESERVER
from backbone.nameserver.messages import (
    Appeared,
    Components,
    Disappeared,
    ListComponents,
    Resolve,
    Resolved,
)
from backbone.naming import Subsystem, component_of
from backbone.operators import OperatorActed
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import AskSchedule, Leases
from backbone.reasons import reasons_for
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope
from resource_pool.arc_client import StopState, ask_stop, lift_stop, stop_robot, watch_stops
from ui_console.console_events import (
    ActHeard,
    CommandRefused,
    ComponentGone,
    ComponentHeard,
    ComponentsListed,
    HealthHeard,
    LeasesHeard,
    LinkHeard,
    LinkTrouble,
    LoadHeard,
    LogHeard,
    ParametersHeard,
    ProcessFallen,
    RadioCounted,
    ScheduleHeard,
    StopHeard,
    StoryHeard,
    TeamEvent,
)
from ui_console.log_board import LOG_KEPT
from ui_console.team_model import ROBOT_KIND

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: a person waits this long for a picture
LINK_FRESH_S = 0.8  # chosen: what is older than a second says so, and drawing that takes a moment; machine seconds
LINK_EVERY_S = 0.3  # chosen: an answer may be lost before what is shown counts as old; machine seconds
PULSE_S = 2.0  # chosen: a link that got slow is seen soon, and asking costs nothing to speak of; machine seconds

LOG_WITHIN_S = 5.0  # chosen: ten thousand events on a slow link; machine seconds

FeedEvent = TeamEvent | LinkTrouble | CommandRefused


class LogAway(Refusal):
    """The mission's log cannot be searched now."""

    code = "console.log_away"
    remedy = "Search again in a moment; the table without a search shows what this console heard."


class ConsoleFeed:
    """Tells what happens in a mission.

    Args:
        bus: Of the component it belongs to.
        clock: The mission's time.
        show: Called in the event loop with each event, in order.
    """

    def __init__(self, bus: Bus, clock: Clock, show: Callable[[FeedEvent], None]) -> None:
        self._bus, self._clock, self._show = bus, clock, show
        self._hosts: dict[str, list[Subscription]] = {}
        self._radios: set[str] = set()
        self._robots: set[str] = set()
        self._listing = asyncio.Event()
        self.listed = asyncio.Event()
        """Set once all were asked how things are, and answered or did not."""
        self._is_up = True

    # ------------------------------------------------------------------ listening
    def listen(self) -> None:
        """Begin to listen; once, before ``run``."""
        bus = self._bus
        bus.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, self._heard_schedule, latest=True)
        bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard_leases, latest=True)
        bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard_story)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard_act)
        bus.subscribe("*/*", Conversation.STATUS, ComponentState, self._heard_status, latest=True)
        bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard_life)
        bus.subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, self._heard_health, latest=True)
        self._show_health(None)
        watch_stops(bus, lambda stop: self._show(StopHeard(self._clock.now_s(), stop)))
        bus.watch_link(self._heard_link)

    async def run(self) -> None:
        """Ask for how things are, now and whenever the link is back, and feel the mission's pulse; until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._list_when_due(), name="feed:list")
            group.create_task(self._feel_link(), name="feed:link")
            group.create_task(self._feel_pulse(), name="feed:pulse")

    # ------------------------------------------------------------------ verbs of an operator
    async def stop_robots(self, robots: Iterable[str], reason: str = "", user: str = "") -> list[str]:
        """Stop these robots, all at once, whoever holds them; return those that did not confirm it."""
        wanted = sorted(set(robots))
        answers = await asyncio.gather(*(self._stop(robot, reason, user) for robot in wanted))
        return [robot for robot, is_stopped in zip(wanted, answers, strict=True) if not is_stopped]

    @property
    def robots(self) -> frozenset[str]:
        """Every robot heard of so far."""
        return frozenset(self._robots)

    async def find_robots(self) -> frozenset[str]:
        """Return every robot of the mission, also those not heard of yet."""
        try:
            question = ListComponents(subsystem=str(Subsystem.RESOURCE_POOL), type=ROBOT_KIND)
            listing = await self._bus.ask(NAMESERVER, question, Components, within_s=REPLY_TIME_S)
        except LinkError as error:
            self._trouble(error)
            return self.robots
        return self.robots | {component_of(component.address) for component in listing.components}

    async def ask_stop(self, robot: str) -> StopState | None:
        """Return whether an operator's stop keeps the robot from moving; None: its RC did not say."""
        try:
            stop = await ask_stop(self._bus, robot)
        except Refusal as refusal:
            self._refused(refusal)
            return None
        except LinkError as error:
            self._trouble(error)
            return None
        self._show(StopHeard(self._clock.now_s(), stop))
        return stop

    async def consoles(self) -> list[str]:
        """Return the addresses of all consoles of the mission; none if the nameserver did not answer."""
        try:
            question = ListComponents(subsystem=str(Subsystem.UI_CONSOLE))
            listing = await self._bus.ask(NAMESERVER, question, Components, within_s=REPLY_TIME_S)
        except LinkError as error:
            self._trouble(error)
            return []
        return [component.address for component in listing.components]

    async def lift(self, stop: StopState, user: str = "") -> bool:
        """Let a robot move again; return whether it may."""
        try:
            self._show(StopHeard(self._clock.now_s(), await lift_stop(self._bus, stop, user)))
        except Refusal as refusal:
            self._refused(refusal)
            return False
        except LinkError as error:
            self._trouble(error)
            return False
        return True

    async def why(self, name: str) -> list[str]:
        """Return for people why this robot, ARC, behavior, console or component is as it is."""
        try:
            return (await reasons_for(self._bus, name, self._clock)).lines(self._clock.now_s())
        except Refusal as refusal:
            return [refusal.detail, refusal.remedy]
        except LinkError as error:
            return [f"nobody answers: {error}"]

    async def search_log(self, asked: AskLog) -> Log:
        """Return what the mission's log has of this, as far back as the launcher keeps it.

        Raises:
            LogAway: The launcher did not answer.
            Refusal: It refused the question.
        """
        try:
            return await self._bus.ask(LAUNCHER, asked, Log, within_s=LOG_WITHIN_S)
        except LinkError as error:
            raise LogAway(f"the launcher, which keeps the log, did not answer: {error}") from error

    async def ask_parameters(self, name: str) -> bool:
        """Have a component tell its parameters; return whether it did."""
        try:
            address = await self._resolve(name)
            answer = await self._bus.ask(address, AskParameters(), Parameters, within_s=REPLY_TIME_S)
        except Refusal as refusal:
            self._refused(refusal)
            return False
        except LinkError as error:
            self._trouble(error)
            return False
        self._show(ParametersHeard(self._clock.now_s(), address, answer.values))
        return True

    async def set_parameter(self, name: str, parameter: str, value: Any, user: str = "") -> bool:
        """Have a component run with another value; return whether it does."""
        try:
            address = await self._resolve(name)
            change = SetParameter(parameter, value, user)
            answer = await self._bus.ask(address, change, Parameters, within_s=REPLY_TIME_S)
        except Refusal as refusal:
            self._refused(refusal)
            return False
        except LinkError as error:
            self._trouble(error)
            return False
        self._show(ParametersHeard(self._clock.now_s(), address, answer.values, parameter, user or self._bus.source))
        return True

    # ------------------------------------------------------------------ within
    async def _stop(self, robot: str, reason: str, user: str) -> bool:
        try:
            self._show(StopHeard(self._clock.now_s(), await stop_robot(self._bus, robot, reason, user)))
        except Refusal as refusal:
            self._refused(refusal)
            return False
        except LinkError as error:
            self._show(LinkTrouble(self._clock.now_s(), f"{robot} did not confirm the stop: {error}"))
            return False
        return True

    async def _resolve(self, name: str) -> str:
        resolved = await self._bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)
        return resolved.component.address

    async def _list_when_due(self) -> None:
        self._listing.set()
        while True:
            await self._listing.wait()
            self._listing.clear()
            await asyncio.gather(self._list(), self._ask_schedule())
            self.listed.set()

    async def _list(self) -> None:
        try:
            listing = await self._bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
        except LinkError as error:
            self._trouble(error)
            return
        for component in listing.components:
            self._meet(component)
        self._show(ComponentsListed(self._clock.now_s(), listing.components, listing.complete))
        behaviors = [at for c in listing.components if (at := c.address).startswith(f"{Subsystem.MISSION_CONTROL}/")]
        robots = [component_of(c.address) for c in listing.components if c.type == ROBOT_KIND]
        await asyncio.gather(*map(self._ask_how_it_went, behaviors), *map(self._ask_stop, robots), self._ask_log())

    async def _ask_schedule(self) -> None:
        try:
            schedule = await self._bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
        except LinkError as error:
            self._trouble(error)
        else:
            self._take_schedule(schedule)

    async def _ask_how_it_went(self, behavior: str) -> None:
        """Hear of what a behavior finished before this console listened."""
        try:
            story = await self._bus.ask(behavior, AskStory(), Story, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s did not tell its story: %s", behavior, error)
            return
        for event in story.events:
            if event.what.startswith("finished: "):
                self._show(StoryHeard(self._clock.now_s(), event))

    async def _ask_log(self) -> None:
        """Hear of what happened before this console listened, or while its link was away."""
        try:
            known = await self._bus.ask(LAUNCHER, AskPeople(), PeopleKnown, within_s=REPLY_TIME_S)
            told = await self._bus.ask(LAUNCHER, AskLog(most=LOG_KEPT), Log, within_s=REPLY_TIME_S)
        except (Refusal, LinkError) as error:
            log.info("the launcher did not tell what happened: %s", error)
        else:
            self._show(LogHeard(self._clock.now_s(), told.events, known.consoles))

    async def _ask_stop(self, robot: str) -> None:
        try:
            stop = await ask_stop(self._bus, robot)
        except (Refusal, LinkError) as error:  # a robot of another make may know no such stop
            log.info("%s did not say whether it is stopped: %s", robot, error)
        else:
            self._show(StopHeard(self._clock.now_s(), stop))

    async def _feel_link(self) -> None:
        while True:
            await self._clock.sleep_s(LINK_EVERY_S * self._clock.rate)
            await self._measure_link()

    async def _feel_pulse(self) -> None:
        while True:
            await self._clock.sleep_s(PULSE_S * self._clock.rate)
            await asyncio.gather(*map(self._count, sorted(self._radios)))

    async def _measure_link(self) -> None:
        asked_s = time.perf_counter()
        try:
            await self._bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=LINK_FRESH_S)
        except LinkError as error:
            log.info("the hub did not answer: %s", error)
            self._show(LinkHeard(self._clock.now_s(), False))
        else:
            self._show_link(time.perf_counter() - asked_s)

    def _show_link(self, latency_s: float = -1.0) -> None:
        now_s = self._clock.now_s()
        self._show(LinkHeard(now_s, self._is_up, latency_s, now_s + LINK_FRESH_S * self._clock.rate))

    async def _count(self, radio: str) -> None:
        address = f"{Subsystem.RESOURCE_POOL}/{radio}"
        try:
            counted = await self._bus.ask(address, AskStatistics(), Statistics, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s did not tell its counters: %s", radio, error)
        else:
            self._show(RadioCounted(self._clock.now_s(), radio, counted.values))

    def _meet(self, component: ComponentState) -> None:
        """Listen to creators, which tell of their hosts and of what fell."""
        address = component.address
        if component.type == CREATOR and address not in self._hosts:
            self._hosts[address] = [
                self._bus.subscribe(address, Conversation.TELEMETRY, HostLoad, self._heard_load, latest=True),
                self._bus.subscribe(address, Conversation.EVENTS, ProcessFell, self._heard_fall),
            ]
        if component.type == ROBOT_KIND:
            self._robots.add(component_of(address))

    def _take_schedule(self, schedule: Schedule) -> None:
        self._radios = {rc.rc for rc in schedule.rcs if rc.sharable and rc.state != "down"}
        self._robots |= {rc.rc for rc in schedule.rcs if rc.kind == ROBOT_KIND}
        self._show(ScheduleHeard(self._clock.now_s(), schedule))

    def _heard_schedule(self, envelope: Envelope[Any]) -> None:
        self._take_schedule(envelope.body)

    def _heard_leases(self, envelope: Envelope[Any]) -> None:
        self._show(LeasesHeard(envelope.stamp_s, envelope.body))

    def _heard_story(self, envelope: Envelope[Any]) -> None:
        self._show(StoryHeard(self._clock.now_s(), envelope.body))

    def _heard_act(self, envelope: Envelope[Any]) -> None:
        self._show(ActHeard(self._clock.now_s(), envelope.body, envelope.source))

    def _heard_status(self, envelope: Envelope[Any]) -> None:
        self._meet(envelope.body)
        self._show(ComponentHeard(self._clock.now_s(), envelope.body))

    def _heard_life(self, envelope: Envelope[Any]) -> None:
        match envelope.body:
            case Appeared(component=component):
                self._meet(component)
                self._show(ComponentHeard(self._clock.now_s(), component))
            case Disappeared(address=address):
                self._show(ComponentGone(self._clock.now_s(), address))

    def _heard_load(self, envelope: Envelope[Any]) -> None:
        self._show(LoadHeard(self._clock.now_s(), envelope.body))

    def _heard_fall(self, envelope: Envelope[Any]) -> None:
        self._show(ProcessFallen(self._clock.now_s(), envelope.body))

    def _heard_health(self, envelope: Envelope[Any]) -> None:
        self._show_health(envelope.body)

    def _show_health(self, health: MissionHealth | None) -> None:
        now_s = self._clock.now_s()
        self._show(HealthHeard(now_s, health, now_s + SILENT_AFTER_S * self._clock.rate))

    def _heard_link(self, is_up: bool) -> None:
        came_back, self._is_up = is_up and not self._is_up, is_up
        self._show_link()
        if came_back:
            self._listing.set()

    def _refused(self, refusal: Refusal) -> None:
        self._show(CommandRefused(self._clock.now_s(), refusal.code, refusal.detail, refusal.remedy))

    def _trouble(self, error: LinkError) -> None:
        self._show(LinkTrouble(self._clock.now_s(), str(error)))
