"""Model of the whole mission: robots, behavior tree, schedule, alarms, links. The same for every operator.

Rules of this file: no bus, no clock, no screen. Events go in, views come out; times are mission seconds, and *now* is
an argument. Several consoles in one process may share one model.

``look`` raises the alarms that depend on time (a request that starves, a silent radio); a screen calls it before it
takes a view.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

from msgspec.structs import replace

from backbone.component.messages import (
    ComponentState,
    LifeState,
    LogLevel,
    MissionTime,
    Parameters,
    SetParameter,
    Statistics,
    StoryEvent,
)
from backbone.component_database.messages import Types
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.mission_log.log import AskLog, Log, PeopleKnown
from backbone.mission_log.operators import OperatorActed
from backbone.mission_log.people import is_console, screens_of
from backbone.nameserver.messages import Components, Disappeared
from backbone.naming import Subsystem, component_of
from backbone.picture.health import MissionHealth
from backbone.picture.mission import LOG_KEPT, MissionPicture, is_older
from backbone.picture.words import because
from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule, Why
from backbone.spoken import value_text
from resource_pool.arc_client import FloorPlan, Pose, Readings, StopState, Suspended
from ui_console.model.alarms import AlarmBook, one_line_for_one_cause
from ui_console.model.events import LinkHeard, Said, TeamEvent
from ui_console.model.health_board import HealthBoard
from ui_console.model.link_board import LinkBoard
from ui_console.model.map import MapBoard
from ui_console.model.needs import Needs
from ui_console.model.robot_board import RobotBoard
from ui_console.model.timeline import Timeline, TimelineView
from ui_console.model.tree_board import TreeBoard
from ui_console.model.views import LEAVING, AlarmKind, AlarmView, HealthView, NodeView, ParameterView, Severity

STARVING_S = 30.0  # chosen: several turns, if turns take seconds
PAST_S, NEXT_S = 60.0, 30.0  # chosen: a person's memory, and the range of the schedule's prediction


class TeamModel:
    """The state of the mission as known to a console.

    Args:
        lift_remedy: Remedy for a stop, for an operator of this console.
    """

    def __init__(self, mission: str = "", lift_remedy: str = "Lift the stop when the robot may move.") -> None:
        self.picture = MissionPicture(mission)
        """The model of the mission that all observers share."""
        self.alarms = AlarmBook()
        self.people = self.picture.people
        """The person at each console."""
        self.links = LinkBoard(self.alarms)
        """Links and machines."""
        self.robots = RobotBoard(self.picture, self.alarms, self.links, lift_remedy)
        """The holder of each robot, and its stop in force."""
        self.map = MapBoard(self.picture, self.links)
        """The plan of the floor, and the places of robots and other bodies."""
        self._health = HealthBoard(self.alarms)
        self._timeline = Timeline(self.person)
        self._lost: dict[str, tuple[float, ComponentState]] = {}
        self._tree = TreeBoard(self.people)
        self._arcs: set[str] = set()
        self._needs = Needs()
        self._left: set[str] = set()
        self._parameters: dict[tuple[str, str], ParameterView] = {}

    @property
    def schedule(self) -> Schedule | None:
        """The newest schedule."""
        return self.picture.schedule

    def apply(self, event: TeamEvent) -> None:
        """Apply the event."""
        if isinstance(event, LinkHeard):
            self.links.take_link(event)
        else:
            self._take(event.body, event.at_s, event.source)

    def _take(self, said: Said, at_s: float, source: str) -> None:
        picture = self.picture
        match said:
            case Schedule():
                self._take_schedule(said)
            case Leases():
                self.links.take_leases(said, at_s)
                self.robots.take_leases(said, at_s)
            case StoryEvent():
                picture.take(said)
                self._tree.told(said)
            case Log() | PeopleKnown() | OperatorActed():
                picture.take(said, source)
            case ComponentState():
                self._take_component(said, at_s)
            case Components():
                for change in picture.changes(said):
                    self._take(change, at_s, source)
            case Disappeared():
                self._gone(said, at_s)
            case ProcessFell():
                self._take_fall(said, at_s)
            case HostLoad():
                self.links.take_load(said, at_s)
            case StopState():
                self.robots.take_stop(said, at_s)
            case Readings():
                self.robots.take_readings(said, at_s)
            case Types():
                self.robots.take_types(said)
                self.map.take_types(said)
            case Statistics():
                self.links.take_counts(component_of(source), said.values, at_s)
            case MissionTime():
                self._health.rate = said.rate
            case MissionHealth():
                self._health.take(said, at_s)
            case Parameters():
                self._take_parameters(said, source, at_s)
            case SetParameter():
                self._take_change(said, source, at_s)
            case Pose():
                self.map.take_pose(said)
            case FloorPlan():
                self.map.take_plan(said)
            case Why() | Suspended():
                """Type of an event for one console only."""
            case _:
                assert_never(said)

    def look(self, now_s: float) -> None:
        """Raise and end the alarms that depend on time."""
        self.alarms.look(now_s)
        self._health.look(now_s)
        self.links.look(now_s)
        owners = {request.arc: request.owner for request in self.schedule.requests} if self.schedule else {}
        for request in self.schedule.requests if self.schedule is not None else ():
            waits_s = now_s - request.since_s
            is_wanted = bool(request.blockers) and all(is_console(owners.get(arc, "")) for arc in request.blockers)
            is_endless = request.state is RequestState.WAITING and request.expected_start_s < 0
            starves = is_endless and not is_wanted and waits_s >= STARVING_S
            who = self.person(request.owner)
            line = f"{who} waits for {waits_s:.0f} s and no end is in sight: {because(request, self.people)}"
            self.alarms.hold(starves, AlarmKind.STARVING, request.arc, line, now_s, request.would_change)

    def person(self, console_name: str) -> str:
        """Return the name of the person at a console, even if the console has left; return any other name unchanged.

        Args:
            console_name: Name or address of a console, or of its ARC.
        """
        return self.people.person(console_name)

    def screens_of(self, user: str) -> list[ComponentState]:
        """Return the consoles that this person uses now."""
        return screens_of(user, self.picture.components.values())

    def tree(self) -> list[NodeView]:
        """Return the behavior tree, parents before children, siblings of higher priority first."""
        return self._tree.views(self._shown(), {at: since_s for at, (since_s, _) in self._lost.items()}, self.schedule)

    def requests(self) -> list[RequestView]:
        """Return the requests with people's names, running ones first, then by predicted start."""
        rows = [self._request_row(request) for request in (self.schedule.requests if self.schedule else [])]
        return sorted(rows, key=_request_order)

    def timeline(self, now_s: float) -> TimelineView:
        """Return the past, present and predicted holders of each resource."""
        return self._timeline.view(now_s, PAST_S, NEXT_S)

    def health(self, now_s: float) -> HealthView | None:
        """Return the mission's health; None: not known yet."""
        return self._health.view(now_s)

    def parameters(self) -> list[ParameterView]:
        """Return the known parameters of components, by component and name."""
        return [view for _, view in sorted(self._parameters.items())]

    def components(self) -> list[ComponentState]:
        """Return the running components, by address; their feedback names people."""
        return [replace(component, feedback=self.people.doing(component)) for component in self._shown()]

    def component(self, name: str) -> ComponentState | None:
        """Return the component of this name, if it runs."""
        return next((one for one in self._shown() if component_of(one.address) == name), None)

    def log(
        self, count: int = LOG_KEPT, asked: AskLog | None = None, found: Sequence[StoryEvent] = ()
    ) -> list[StoryEvent]:
        """Return the newest events, oldest first.

        Args:
            count: Largest number of events.
            asked: Search; None: all events.
            found: Matching events of the launcher's log; newer events of this console follow them.
        """
        log = self.picture.log
        if asked is None:
            return log.newest(count)
        known = found[-count:] if count else []
        told = {(event.at_s, event.where) for event in known}
        since_s = known[-1].at_s if known else 0.0
        news = [one for one in log.answer(asked).events if one.at_s >= since_s and (one.at_s, one.where) not in told]
        return [*known, *news][-count:] if count else []

    def alarm_views(self, *own: AlarmBook) -> list[AlarmView]:
        """Return the alarms of the mission and of these books: one line for each cause, with people's names."""
        views = [view for book in (self.alarms, *own) for view in book.views()]
        return [self._located(view) for view in one_line_for_one_cause(views, self._explained_by)]

    def _take_schedule(self, schedule: Schedule) -> None:
        before = {request.arc for request in self.schedule.requests} if self.schedule else set()
        self.picture.take(schedule)
        self._timeline.heard(schedule)
        now = {request.arc for request in schedule.requests}
        there = {component_of(address) for address in (*self.picture.components, *self._lost)}
        self._arcs = (self._arcs & there) | now
        self._tree.scheduled(schedule, there)
        self._left &= {rc.rc for rc in schedule.rcs}
        for arc in before - now:
            self.alarms.end(AlarmKind.STARVING, arc, schedule.at_s)
        for rc in schedule.rcs:
            is_down = rc.state == "down" and rc.rc not in self._left  # an RC that was stopped by request is not missing
            self.alarms.hold(is_down, AlarmKind.RC_DOWN, rc.rc, f"{rc.rc} cannot be reached", schedule.at_s)
        self.robots.take_schedule(schedule)

    def _request_row(self, request: RequestView) -> RequestView:
        named = self.people.named
        return replace(
            request,
            owner=self.person(request.owner),
            priority=named(request.priority),
            because=because(request, self.people),
            would_change=named(request.would_change),
        )

    def _shown(self) -> list[ComponentState]:
        """Return the running components, and the lost behaviors, whose place is kept until they are back."""
        behaviors = {at: one for at, (_, one) in self._lost.items() if _is_in(Subsystem.MISSION_CONTROL, at)}
        return [one for _, one in sorted({**behaviors, **self.picture.components}.items())]

    def _take_component(self, component: ComponentState, at_s: float) -> None:
        address, name = component.address, component_of(component.address)
        known = self.picture.components.get(address)
        if known is not None and is_older(component, known):
            return
        self.picture.take(component)
        (self._left.add if component.state in LEAVING else self._left.discard)(name)
        before = known or self._lost.get(address, (0.0, None))[1]
        if component.state is LifeState.STOPPED:
            self._lost.pop(address, None)
            if known is None:
                self.alarms.retract(AlarmKind.LOST, name)  # its last state arrived after the message of its loss
            return
        self._needs.heard(component)
        if component.state is LifeState.FAILED:
            self.alarms.happened(AlarmKind.LOST, name, f"{name} failed: {component.feedback}", at_s)
            return
        self._lost.pop(address, None)
        if before is None or before.pid != component.pid:
            self._tree.begins(name)
        self.alarms.end(AlarmKind.LOST, name, at_s)
        is_unsafe = "not safe after" in component.feedback and _is_in(Subsystem.RESOURCE_POOL, address)
        self.alarms.hold(is_unsafe, AlarmKind.UNSAFE, name, component.feedback, at_s)
        has_no_trace = "the trace of the schedule stopped" in component.feedback
        self.alarms.hold(has_no_trace, AlarmKind.NOT_RECORDED, name, component.feedback, at_s)

    def _gone(self, gone: Disappeared, at_s: float) -> None:
        address, name = gone.address, component_of(gone.address)
        component = self.picture.components.get(address)
        self.picture.take(gone)
        self.robots.take_gone(name)
        self.alarms.end(AlarmKind.UNSAFE, name, at_s)
        if component is None or component.state in LEAVING:
            self._forget(name)
            return
        self.picture.take(StoryEvent(at_s, "", "is lost", name, "", LogLevel.WARNING))
        is_arc = name in self._arcs
        self._arcs.discard(name)
        if is_arc and is_console(component.requester):
            return  # it ends with its console, which has its own alarm
        if is_arc or is_console(address):  # no component restarts these, and no action is left
            who = f"the console of {component.user}" if component.user else name
            line = f"{who} is lost: it ended without a word"
            self.alarms.happened(AlarmKind.LOST, name, line, at_s, severity=Severity.NOTICE)
            return
        self._lost[address] = at_s, component
        line = f"{name} ({component.type}) on {component.host} is lost"
        self.alarms.begin(AlarmKind.LOST, name, line, at_s)

    def _forget(self, name: str) -> None:
        """Remove a component that left for good, because consoles and their ARCs come and go all day."""
        self._arcs.discard(name)
        self._needs.forget(name)
        self._tree.forget(name)
        for key in [key for key in self._parameters if key[0] == name]:
            del self._parameters[key]

    def _explained_by(self, subject: str) -> frozenset[str]:
        return self._needs.of(subject, self.schedule)

    def _located(self, alarm: AlarmView) -> AlarmView:
        named, component = self.people.named, self.component(alarm.subject)
        where, uses = "", [alarm.subject, *self._explained_by(alarm.subject)]
        if component is not None:
            where = f"{component.type} on {component.host}, process {component.pid}"
        elif self.links.is_host(alarm.subject):
            where = "machine of the mission"
        robots = self.robots.names()
        return replace(
            alarm,
            line=named(alarm.line),
            also=[named(line) for line in alarm.also],
            where=where,
            robot=next((name for name in uses if name in robots), ""),
        )

    def _take_fall(self, fell: ProcessFell, at_s: float) -> None:
        is_over = fell.restart_in_s < 0
        again = "given up" if is_over else f"again in {fell.restart_in_s:.1f} s"
        said = f" (it said: {fell.last_lines[-1]})" if fell.last_lines else ""
        severity = Severity.ALARM if is_over else Severity.WARNING
        line = f"{fell.name} fell: {fell.how}; {again}{said}"
        self.alarms.happened(AlarmKind.LOST, fell.name, line, at_s, key=f"fell:{fell.name}", severity=severity)

    def _take_change(self, change: SetParameter, address: str, at_s: float) -> None:
        """Record the author of a parameter's change; the new value arrives right afterwards, with the same time."""
        key = (component_of(address), change.name)
        before = self._parameters[key].value if key in self._parameters else ""
        self._parameters[key] = ParameterView(key[0], address, change.name, "", before, change.user, at_s)

    def _take_parameters(self, now: Parameters, address: str, at_s: float) -> None:
        name = component_of(address)
        for parameter, value in now.values.items():
            key, shown = (name, parameter), value_text(value)
            former = self._parameters.get(key)
            if former is not None and former.changed_s == at_s:
                self._parameters[key] = replace(former, value=shown)
            elif former is None or former.value != shown:
                self._parameters[key] = ParameterView(name, address, parameter, shown)


def _is_in(subsystem: Subsystem, address: str) -> bool:
    return address.startswith(f"{subsystem}/")


def _request_order(row: RequestView) -> tuple[bool, bool, float, str]:
    return row.state != RequestState.RUNNING, row.expected_start_s < 0, row.expected_start_s, row.arc
