"""What is known of the whole mission: robots, behavior tree, schedule, alarms, links. The same for everybody who looks.

Rules of this file: no bus, no clock, no screen. Events go in, views come out; times are mission seconds, and *now* is
an argument. Several consoles in one process may share one model.

What only time can tell (a request that starves, a radio that is silent) is found by ``look``, which whoever shows the
model calls before it shows it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
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
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.mission_log import AskLog, Log, PeopleKnown
from backbone.nameserver.messages import Components, Disappeared
from backbone.naming import Subsystem, component_of
from backbone.operators import OperatorActed
from backbone.people import is_console, screens_of
from backbone.picture.health import MissionHealth
from backbone.picture.mission import LOG_KEPT, MissionPicture, is_older
from backbone.picture.words import because
from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule, Why
from backbone.spoken import counted, value_text
from resource_pool.arc_client import Stopper, StopState
from ui_console.model.alarms import AlarmBook, one_line_for_one_cause
from ui_console.model.events import LinkHeard, Said, TeamEvent
from ui_console.model.health_board import HealthBoard
from ui_console.model.lifting import author_name, authors, is_own, lift_line
from ui_console.model.needs import Needs
from ui_console.model.timeline import Timeline
from ui_console.model.tree_board import TreeBoard
from ui_console.model.views import (
    NONE_S,
    AlarmKind,
    AlarmView,
    HealthView,
    HostView,
    LinkView,
    NodeView,
    ParameterView,
    RobotView,
    Severity,
    StopView,
    TimelineView,
)

ROBOT_KIND = "scout"
STARVING_S = 30.0  # chosen: several turns of a mission whose turns take seconds
OVERLOAD_CPU = 0.95  # chosen: above it slices and pictures come late
PAST_S, NEXT_S = 60.0, 30.0  # chosen: what a person remembers, and what the schedule foresees
NO_LINK = "no link to the hub: what is shown is old, and nothing can be stopped from here"
LEAVING = (LifeState.DRAINING, LifeState.STOPPED)


class TeamModel:
    """All that a console knows of the mission.

    Args:
        mission: Its name.
        lift_remedy: What an operator of this console does about a stop.
    """

    def __init__(self, mission: str = "", lift_remedy: str = "Lift the stop when the robot may move.") -> None:
        self.picture = MissionPicture(mission)
        """What everybody knows of it who listens."""
        self._lift_remedy = lift_remedy
        self.alarms = AlarmBook()
        self.people = self.picture.people
        """Who sits at which console."""
        self._health = HealthBoard(self.alarms)
        self._timeline = Timeline(self.person)
        self._lost: dict[str, tuple[float, ComponentState]] = {}
        self._tree = TreeBoard(self.people)
        self._arcs: set[str] = set()
        self._leases: Leases | None = None
        self._leases_s = NONE_S
        self._renewed: dict[tuple[str, str, int], float] = {}
        self._stops: dict[str, StopState] = {}
        self._needs = Needs()
        self._left: set[str] = set()
        self._hosts: dict[str, tuple[float, HostLoad]] = {}
        self._overruns: dict[tuple[str, str], float] = {}
        self._radios: dict[str, Mapping[str, float]] = {}
        self._link = LinkHeard(0.0, True)
        self._link_heard_s = 0.0
        self._parameters: dict[tuple[str, str], ParameterView] = {}

    @property
    def schedule(self) -> Schedule | None:
        """As last heard."""
        return self.picture.schedule

    # ------------------------------------------------------------------ events in
    def apply(self, event: TeamEvent) -> None:
        """Take the event in."""
        if isinstance(event, LinkHeard):
            self._take_link(event)
        else:
            self._take(event.body, event.at_s, event.source)

    def _take(self, said: Said, at_s: float, source: str) -> None:
        picture = self.picture
        match said:
            case Schedule():
                self._take_schedule(said)
            case Leases():
                self._take_leases(said, at_s)
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
                self._take_load(said, at_s)
            case StopState():
                self._take_stop(said, at_s)
            case Statistics():
                self._take_counts(component_of(source), said.values, at_s)
            case MissionTime():
                self._health.rate = said.rate
            case MissionHealth():
                self._health.take(said, at_s)
            case Parameters():
                self._take_parameters(said, source, at_s)
            case SetParameter():
                self._take_change(said, source, at_s)
            case Why():
                """Of one console, which keeps it."""
            case _:
                assert_never(said)

    def look(self, now_s: float) -> None:
        """Find out what only time can tell."""
        self.alarms.look(now_s)
        self._health.look(now_s)
        owners = {request.arc: request.owner for request in self.schedule.requests} if self.schedule else {}
        self.alarms.hold(self.link_down_s(now_s) >= 0, AlarmKind.LINK, "hub", NO_LINK, now_s)
        for request in self.schedule.requests if self.schedule is not None else ():
            waits_s = now_s - request.since_s
            is_wanted = bool(request.blockers) and all(is_console(owners.get(arc, "")) for arc in request.blockers)
            is_endless = request.state is RequestState.WAITING and request.expected_start_s < 0
            starves = is_endless and not is_wanted and waits_s >= STARVING_S
            who = self.person(request.owner)
            line = f"{who} waits for {waits_s:.0f} s and no end is in sight: {because(request, self.people)}"
            self.alarms.hold(starves, AlarmKind.STARVING, request.arc, line, now_s, request.would_change)

    # ------------------------------------------------------------------ views out
    def robots(self, now_s: float) -> list[RobotView]:
        """Return the robots, sorted by name; none of them is anybody's own, and none has pictures."""
        if self.schedule is None:
            return []
        requests = {request.arc: request for request in self.schedule.requests}
        rcs = sorted((rc for rc in self.schedule.rcs if rc.kind == ROBOT_KIND), key=lambda rc: rc.rc)
        return [self._robot(rc, number, requests, now_s) for number, rc in enumerate(rcs, 1)]

    def person(self, console_name: str) -> str:
        """Return the name of the person at a console, also of one that has left; any other name stays as it is.

        Args:
            console_name: Name or address of a console, or of what it claims.
        """
        return self.people.person(console_name)

    def screens_of(self, user: str) -> list[ComponentState]:
        """Return the consoles at which this person sits now."""
        return screens_of(user, self.picture.components.values())

    def link_down_s(self, now_s: float) -> float:
        """Return since when nothing is heard from the mission's hub; negative: the link is up."""
        link = self._link
        return NONE_S if link.is_up and now_s <= link.until_s else self._link_heard_s

    def robot_names(self) -> list[str]:
        """Return every robot heard of, in the schedule or as a component."""
        in_schedule = {rc.rc for rc in self.schedule.rcs if rc.kind == ROBOT_KIND} if self.schedule else set()
        registered = {
            component_of(at) for at, component in self.picture.components.items() if component.type == ROBOT_KIND
        }
        return sorted(in_schedule | registered)

    def stop_of(self, robot: str) -> StopState | None:
        """Return the operator's stop in force on the robot."""
        stop = self._stops.get(robot)
        return stop if stop is not None and stop.is_stopped else None

    def stop_view(self, robot: str, now_s: float, user: str = "", console: str = "") -> StopView | None:
        """Return the same for a screen.

        Args:
            robot: Which.
            now_s: Mission time.
            user: Who looks at it; empty: nobody in particular.
            console: Address of their console.
        """
        stop = self.stop_of(robot)
        if stop is None:
            return None
        by_user, *also = dict.fromkeys(map(author_name, authors(stop)))
        return StopView(
            number=stop.number,
            reason=stop.reason,
            age_s=max(0.0, now_s - stop.at_s),
            is_confirmed=stop.is_confirmed,
            by_user=by_user,
            also=also,
            is_mine=is_own(stop, user, console),
            lift_line=lift_line(stop, user, console, self._is_there),
        )

    def tree(self) -> list[NodeView]:
        """Return the behavior tree, parents before children, siblings of higher priority first."""
        return self._tree.views(self._shown(), {at: since_s for at, (since_s, _) in self._lost.items()}, self.schedule)

    def requests(self) -> list[RequestView]:
        """Return the requests by the names of people, running ones first, then by predicted start."""
        rows = [self._request_row(request) for request in (self.schedule.requests if self.schedule else [])]
        return sorted(rows, key=_request_order)

    def timeline(self, now_s: float, past_s: float = PAST_S, next_s: float = NEXT_S) -> TimelineView:
        """Return who had which resource in the past seconds, who has it, and who gets it in the next."""
        return self._timeline.view(now_s, past_s, next_s)

    def health(self, now_s: float) -> HealthView | None:
        """Return how the mission is; None: not known yet."""
        return self._health.view(now_s)

    def hosts(self, now_s: float) -> list[HostView]:
        """Return the machines, sorted by name."""
        return [HostView(load, max(0.0, now_s - at_s)) for _, (at_s, load) in sorted(self._hosts.items())]

    def links(self, now_s: float) -> list[LinkView]:
        """Return the link to the hub, the RC manager's renewals, and the radios."""
        renewed = f"leases renewed {now_s - self._leases_s:.1f} s ago" if self._leases_s >= 0 else ""
        views = [LinkView("hub", self.link_down_s(now_s) < 0, self._link.latency_s, renewed)]
        for radio, values in sorted(self._radios.items()):
            sent, late = values.get("packets_sent", 0.0), values.get("overruns", 0.0)
            worst_ms = 1e3 * values.get("worst_packet_s", 0.0)
            feedback = f"{sent:.0f} packets sent, {late:.0f} late or lost, slowest {worst_ms:.1f} ms"
            views.append(LinkView(radio, not self._is_missing(radio), NONE_S, feedback))
        return views

    def parameters(self) -> list[ParameterView]:
        """Return the parameters of the components that were asked for theirs, by component and name."""
        return [view for _, view in sorted(self._parameters.items())]

    def components(self) -> list[ComponentState]:
        """Return the components that are there, by address, doing what they do by the names of people."""
        return [replace(component, feedback=self.people.doing(component)) for component in self._shown()]

    def component(self, name: str) -> ComponentState | None:
        """Return the component of this name, if it is there."""
        return next((one for one in self._shown() if component_of(one.address) == name), None)

    def log(
        self, count: int = LOG_KEPT, asked: AskLog | None = None, found: Sequence[StoryEvent] = ()
    ) -> list[StoryEvent]:
        """Return the newest that happened, oldest first.

        Args:
            count: At most so many.
            asked: Only what fits; None: all.
            found: What the launcher's log has of it; what was heard here since comes after that.
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
        """Return the alarms of the mission and of these books: one line for one cause, by the names of people."""
        views = [view for book in (self.alarms, *own) for view in book.views()]
        return [self._located(view) for view in one_line_for_one_cause(views, self._explained_by)]

    # ------------------------------------------------------------------ the schedule
    def _take_schedule(self, schedule: Schedule) -> None:
        before = {request.arc for request in self.schedule.requests} if self.schedule else set()
        self.picture.take(schedule)
        self._timeline.heard(schedule)
        now = {request.arc for request in schedule.requests}
        self._arcs |= now
        self._tree.scheduled(schedule)
        for arc in before - now:
            self.alarms.end(AlarmKind.STARVING, arc, schedule.at_s)
        for rc in schedule.rcs:
            is_down = rc.state == "down" and rc.rc not in self._left  # who was told to end is not missed
            self.alarms.hold(is_down, AlarmKind.RC_DOWN, rc.rc, f"{rc.rc} cannot be reached", schedule.at_s)
        self._renewed = {
            (rc.rc, holder.arc, holder.epoch): self._renewed.get((rc.rc, holder.arc, holder.epoch), holder.since_s)
            for rc in schedule.rcs
            for holder in rc.holders
        }

    def _take_leases(self, leases: Leases, at_s: float) -> None:
        self._leases, self._leases_s = leases, at_s
        for lease in leases.leases:
            self._renewed[lease.rc, lease.arc, lease.epoch] = at_s

    def _is_missing(self, rc: str) -> bool:
        return self._leases is not None and rc in self._leases.missing

    def _robot(self, rc: RcView, number: int, requests: Mapping[str, RequestView], now_s: float) -> RobotView:
        component = self.picture.components.get(f"{Subsystem.RESOURCE_POOL}/{rc.rc}")
        waiting = [self.person(requests[arc].owner) for arc in rc.next if arc in requests]
        free = RobotView(
            rc.rc,
            number,
            rc.state != "down" and not self._is_missing(rc.rc),
            waiting,
            self.stop_view(rc.rc, now_s),
            self.people.named(component.feedback) if component is not None else "",
        )
        if not rc.holders:
            return free
        holder = rc.holders[0]
        request = requests.get(holder.arc)
        renewed_s = self._renewed.get((rc.rc, holder.arc, holder.epoch), holder.since_s)
        lease_s = self._leases.lease_s if self._leases is not None else holder.lease_until_s - renewed_s
        age_s = max(0.0, now_s - renewed_s)
        return replace(
            free,
            holder=self.person(request.owner if request else holder.arc),
            arc=holder.arc,
            is_console=request is not None and is_console(request.owner),
            priority=self.people.named(request.priority) if request else "",
            epoch=holder.epoch,
            since_s=holder.since_s,
            until_s=request.until_s if request else NONE_S,
            lease_left_s=max(0.0, lease_s - age_s),
            lease_age_s=age_s,
            because=because(request, self.people) if request else "",
        )

    def _request_row(self, request: RequestView) -> RequestView:
        named = self.people.named
        return replace(
            request,
            owner=self.person(request.owner),
            priority=named(request.priority),
            because=because(request, self.people),
            would_change=named(request.would_change),
        )

    # ------------------------------------------------------------------ components
    def _shown(self) -> list[ComponentState]:
        """Return the components that are there, and the lost behaviors, whose place is kept until they are back."""
        behaviors = {at: one for at, (_, one) in self._lost.items() if _is_in(Subsystem.MISSION_CONTROL, at)}
        return [one for _, one in sorted({**behaviors, **self.picture.components}.items())]

    def _take_component(self, component: ComponentState, at_s: float) -> None:
        address, name = component.address, component_of(component.address)
        self._needs.heard(component)
        known = self.picture.components.get(address)
        if known is not None and is_older(component, known):
            return
        self.picture.take(component)
        (self._left.add if component.state in LEAVING else self._left.discard)(name)
        before = known or self._lost.get(address, (0.0, None))[1]
        if component.state is LifeState.STOPPED:
            self._lost.pop(address, None)
            if known is None:
                self.alarms.retract(AlarmKind.LOST, name)  # its last word came after the word that it is gone
            return
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
        self.alarms.end(AlarmKind.UNSAFE, name, at_s)
        if component is None or component.state in LEAVING:
            self._forget(name)
            return
        self.picture.take(StoryEvent(at_s, "", "is lost", name, "", LogLevel.WARNING))
        is_arc = name in self._arcs
        self._arcs.discard(name)
        if is_arc and is_console(component.requester):
            return  # it ends with its console, which is told of
        if is_arc or is_console(address):  # nobody restarts these by themselves, and nothing is left to be mended
            who = f"the console of {component.user}" if component.user else name
            line = f"{who} is lost: it ended without a word"
            self.alarms.happened(AlarmKind.LOST, name, line, at_s, severity=Severity.NOTICE)
            return
        self._lost[address] = at_s, component
        line = f"{name} ({component.type}) on {component.host} is lost"
        self.alarms.begin(AlarmKind.LOST, name, line, at_s)

    def _forget(self, name: str) -> None:
        """Forget what was known of one that left for good: consoles and their ARCs come and go all day."""
        self._arcs.discard(name)
        self._needs.forget(name)
        self._tree.forget(name)
        for key in [key for key in self._parameters if key[0] == name]:
            del self._parameters[key]

    def _take_load(self, load: HostLoad, at_s: float) -> None:
        self._hosts[load.host] = (at_s, load)
        line = f"{load.host} is busy at {load.cpu:.0%} of its {load.cores} cores"
        self.alarms.hold(load.cpu >= OVERLOAD_CPU, AlarmKind.OVERLOAD, load.host, line, at_s)

    # ------------------------------------------------------------------ what alarms are about
    def _explained_by(self, subject: str) -> frozenset[str]:
        return self._needs.of(subject, self.schedule)

    def _located(self, alarm: AlarmView) -> AlarmView:
        named, component = self.people.named, self.component(alarm.subject)
        where, uses = "", [alarm.subject, *self._explained_by(alarm.subject)]
        if component is not None:
            where = f"{component.type} on {component.host}, process {component.pid}"
        elif alarm.subject in self._hosts:
            where = "machine of the mission"
        robots = self.robot_names()
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

    def _is_there(self, author: Stopper) -> bool:
        """Return whether who stopped a robot is there; True as long as nothing was heard of who is."""
        there = self.picture.components
        at = {author.console, *(screen.address for screen in self.screens_of(author.by))} & there.keys()
        return any(there[one].state not in LEAVING for one in at) or not there

    # ------------------------------------------------------------------ what happened
    def _take_link(self, link: LinkHeard) -> None:
        if link.is_up:
            self._link_heard_s = link.at_s
            latency_s = link.latency_s if link.latency_s >= 0 else self._link.latency_s
            self._link = dataclasses.replace(link, latency_s=latency_s)
        else:
            self._link = link
        self.alarms.hold(not link.is_up, AlarmKind.LINK, "hub", NO_LINK, link.at_s)

    def _take_stop(self, stop: StopState, at_s: float) -> None:
        former = self._stops.get(stop.rc)
        if former is not None and (former.number, not former.is_stopped) > (stop.number, not stop.is_stopped):
            return
        self._stops[stop.rc] = stop
        unsure = "" if stop.is_confirmed else "; the radio did not take it, so the wheels turn for a moment more"
        line = f"{stop.rc} was stopped by {stop.by}{f': {stop.reason}' if stop.reason else ''}{unsure}"
        if stop.is_stopped:
            self.alarms.begin(AlarmKind.STOPPED, stop.rc, line, at_s, self._lift_remedy)
        else:
            self.alarms.retract(AlarmKind.STOPPED, stop.rc)  # who lifted it is in the log, and nothing is left to do

    def _take_counts(self, radio: str, values: Mapping[str, float], at_s: float) -> None:
        self._radios[radio] = values
        known = {(radio, name.removeprefix("overruns_")) for name in values}
        self._overruns = {key: count for key, count in self._overruns.items() if key[0] != radio or key in known}
        for name, count in values.items():
            arc = name.removeprefix("overruns_")
            if arc == name:
                continue
            before = self._overruns.get((radio, arc), 0.0)
            self._overruns[radio, arc] = count
            if count > before:
                late = int(count)
                line = f"{counted(late, 'packet')} of {arc} on {radio} {'was' if late == 1 else 'were'} late or lost"
                remedy = "Claim with a longer period, or use another radio."
                self.alarms.happened(AlarmKind.DEADLINE, arc, line, at_s, remedy, f"deadline:{radio}:{arc}")

    def _take_change(self, change: SetParameter, address: str, at_s: float) -> None:
        """Note who changed a parameter; its new value comes right after, at the same time."""
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
