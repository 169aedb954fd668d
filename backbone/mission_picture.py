"""What a running mission looks like from outside: asked once, shown as a table, a line or JSON.

``look`` asks; everything else is pure. A question without an answer never makes the picture look whole: the service
that did not answer is absent, and what the picture lacks because of it stands in ``problems``.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec

from backbone.bus.interface import Bus
from backbone.component.messages import Absence, AskTime, ComponentState, LifeState, MissionTime, StandingStop
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import ListProcesses, Processes, ProcessState
from backbone.errors import LinkError, Refusal
from backbone.health import Health, health
from backbone.nameserver.messages import ADDRESS as NAMESERVER
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of
from backbone.people import People
from backbone.placer.messages import ADDRESS as PLACER
from backbone.printable import printable_all
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule
from backbone.spoken import counted
from backbone.wire import plain

LAUNCHER = "backbone/launcher"
LOOK_TIME_S = 1.0  # chosen: a person waits this long for a picture
HUNG_AFTER_S = 1.0  # chosen: the aim for noticing a component that hangs; machine seconds
NAMES_SHOWN = 8  # chosen: a line of a terminal
_RESTARTS = "its creator restarts it"


@dataclass(frozen=True)
class MissionPicture:
    """A mission at one moment.

    Attributes:
        mission: Its name.
        at_s: Mission time.
        components: Who is registered, by address.
        processes: What creators and launcher say of their processes, by component name.
        schedule: The RC manager's; None if it did not answer.
        problems: Services that did not answer, and what the picture lacks.
        missed: What this observer misses: services that did not answer, components that failed, hang or ended.
        stale_since_s: Mission time at which the rest of the picture was true; None: now.
        rate: Mission seconds per second of the machine.
    """

    mission: str
    at_s: float
    components: Mapping[str, ComponentState]
    processes: Mapping[str, ProcessState] = field(default_factory=dict)
    schedule: Schedule | None = None
    problems: tuple[str, ...] = ()
    missed: tuple[Absence, ...] = ()
    stale_since_s: float | None = None
    rate: float = 1.0

    @property
    def health(self) -> Health:
        """How the mission is, and what it lacks."""
        return health(self.components, self.missed, self.at_s, self.rate)

    @property
    def stops(self) -> dict[str, StandingStop]:
        """The emergency stops in force, by the name of the component that was stopped."""
        return {component_of(at): c.stop for at, c in sorted(self.components.items()) if c.stop is not None}

    @property
    def people(self) -> People:
        """Who sits at which console."""
        return People(self.components.values())

    def stop_lines(self) -> list[str]:
        """Return one line for each emergency stop in force, for people."""
        return [self.people.named(stop_line(name, stop, self.at_s)) for name, stop in self.stops.items()]

    def remarks(self) -> list[str]:
        """Return the problems that are no absence, one line each."""
        told = tuple(f"{absence.name}: " for absence in self.health.absent)
        return [problem for problem in self.problems if not problem.startswith(told)]

    def of_subsystem(self, subsystem: Subsystem) -> list[ComponentState]:
        """Return the components of one of the four subsystems, sorted by name."""
        return [c for at, c in sorted(self.components.items()) if at.startswith(f"{subsystem}/")]

    def restarts(self, component: ComponentState) -> int:
        """Return how often the component was restarted."""
        process = self.processes.get(component_of(component.address))
        return process.restarts if process else 0

    def gone_stale(self, missed: Iterable[Absence], at_s: float) -> MissionPicture:
        """Return this picture at a later time at which the nameserver did not answer."""
        since_s = self.at_s if self.stale_since_s is None else self.stale_since_s
        new = tuple(missed)
        names = {absence.name for absence in new}
        found = (*new, *(absence for absence in self.missed if absence.name not in names))
        problems = tuple(f"{absence.name}: {absence.cause}" for absence in found)
        return dataclasses.replace(self, at_s=at_s, missed=found, stale_since_s=since_s, problems=problems)

    def to_json(self) -> dict[str, Any]:
        """Return the whole picture as plain data."""
        components = [
            {
                "name": component_of(c.address),
                "subsystem": c.address.partition("/")[0],
                "type": c.type,
                "host": c.host,
                "pid": c.pid,
                "state": str(c.state),
                "since_s": c.since_s,
                "restarts": self.restarts(c),
                "feedback": c.feedback,
                "requester": c.requester,
                "person": c.user,
            }
            for _, c in sorted(self.components.items())
        ]
        schedule = plain(self.schedule) if self.schedule else {"rcs": [], "requests": [], "groups": []}
        return {
            "mission": self.mission,
            "at_s": self.at_s,
            **self.health.to_json(),
            "stale_since_s": self.stale_since_s,
            "stops": [{"name": name, **plain(stop)} for name, stop in self.stops.items()],
            "components": components,
            "rcs": schedule["rcs"],
            "requests": schedule["requests"],
            "groups": schedule["groups"],
            "problems": list(self.problems),
        }


async def look(
    bus: Bus, now_s: float, *, before: MissionPicture | None = None, rate: float = 1.0, schedule: bool = True
) -> MissionPicture:
    """Ask nameserver, RC manager, placer, launcher and creators, and return what they say.

    Args:
        bus: To ask on.
        now_s: Mission time.
        before: The picture of an earlier look: an absence keeps its beginning, and a nameserver that does not answer
            leaves this picture, marked as stale.
        rate: Mission seconds per second of the machine.
        schedule: False: ask the RC manager only whether it lives.

    Raises:
        LinkError: The nameserver did not answer, and there is no earlier picture.
    """
    try:
        listing = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S)
    except (LinkError, Refusal) as error:
        if before is None:
            raise
        missed = [Absence("nameserver", now_s, f"no answer: {error}", "the launcher restarts it", vital=True)]
        return before.gone_stale(_remembered(missed, before), now_s)
    components = {component.address: component for component in listing.components}
    keepers = sorted({LAUNCHER, *(at for at, c in components.items() if c.type == CREATOR)})
    question, answer = (AskSchedule(), Schedule) if schedule else (AskTime(), MissionTime)
    planned, placing, *processes = await asyncio.gather(
        _ask_or_absence(bus, now_s, RC_MANAGER, question, answer),
        _ask_or_absence(bus, now_s, PLACER, AskTime(), MissionTime),
        *(_ask_or_absence(bus, now_s, keeper, ListProcesses(), Processes) for keeper in keepers),
    )
    silent = [absence for absence in (planned, placing, *processes) if isinstance(absence, Absence)]
    kept = {p.spawn.name: p for answer in processes if isinstance(answer, Processes) for p in answer.processes}
    missed = [*silent, *misses(components.values(), kept.values(), now_s, rate)]
    picture = MissionPicture(
        mission=bus.mission,
        at_s=now_s,
        components=components,
        processes=kept,
        schedule=planned if isinstance(planned, Schedule) else None,
        problems=(*(f"{absence.name}: {absence.cause}" for absence in silent), *_lacks(listing, kept)),
        missed=tuple(_remembered(missed, before)),
        rate=rate,
    )
    return printable_all(picture)


async def _ask_or_absence(bus: Bus, now_s: float, address: str, question: Any, reply: type[Any]) -> Any:
    """Return the answer, or that the one who should have answered is absent."""
    try:
        return await bus.ask(address, question, reply, within_s=LOOK_TIME_S)
    except (Refusal, LinkError) as error:
        launched = address != LAUNCHER
        doing = "the launcher restarts it" if launched else "it may answer again; nothing restarts a launcher"
        remedy = "" if launched else "If it stays silent: 'scout-backbone down', then 'up' again."
        return Absence(component_of(address), now_s, f"no answer: {error}", doing, remedy, vital=True)


def _remembered(missed: Iterable[Absence], before: MissionPicture | None) -> list[Absence]:
    """Return the absences, each since it was first missed."""
    since_s = {absence.name: absence.since_s for absence in before.missed} if before is not None else {}
    return [msgspec.structs.replace(each, since_s=since_s.get(each.name, each.since_s)) for each in missed]


def _lacks(listing: Components, processes: Mapping[str, ProcessState]) -> list[str]:
    """Return why the list of components is not whole, one line for each reason."""
    listed = {component_of(component.address) for component in listing.components}
    unknown = {component_of(address) for address in listing.unknown}
    running = {name for name, process in processes.items() if process.pid} - listed - unknown
    lines = []
    if unknown:
        lines.append(f"the list is incomplete: no word yet from {_count(unknown)}")
    if running:
        lines.append(f"the list is incomplete: running and not registered yet: {_count(running)}")
    elif not listing.complete and not unknown:
        lines.append("the list may be incomplete: the nameserver began a moment ago and components still come back")
    return lines


def _count(names: Iterable[str]) -> str:
    found = sorted(names)
    more = f" and {len(found) - NAMES_SHOWN} more" if len(found) > NAMES_SHOWN else ""
    return f"{counted(len(found), 'component')} ({', '.join(found[:NAMES_SHOWN])}{more})"


def misses(
    components: Iterable[ComponentState], processes: Iterable[ProcessState], now_s: float, rate: float = 1.0
) -> list[Absence]:
    """Return what an observer misses by what nameserver, launcher and creators say: what failed, hangs or fell.

    Args:
        components: Who is registered.
        processes: What is kept by launcher and creators.
        now_s: Mission time.
        rate: Mission seconds per second of the machine.
    """
    found = {
        component_of(c.address): Absence(component_of(c.address), c.since_s, c.feedback or "it failed", _RESTARTS)
        for c in components
        if c.state is LifeState.FAILED
    }
    listed = {component_of(c.address) for c in components}
    for process in processes:
        absence = _fallen(process, now_s, rate, listed)
        if absence is not None:
            found[absence.name] = absence
    return list(found.values())


def _fallen(process: ProcessState, now_s: float, rate: float, listed: set[str]) -> Absence | None:
    """Return what is wrong with a process; None: nothing is."""
    name, is_core = process.spawn.name, process.spawn.subsystem == Subsystem.BACKBONE
    if process.silent_s >= HUNG_AFTER_S:
        cause = f"it hangs: its event loop did not run for {process.silent_s:.1f} s"
        doing = "its creator ends and restarts it if it stays silent"
        return Absence(name, now_s - process.silent_s * rate, cause, doing, vital=is_core)
    if not process.pid and process.last_end:  # without an end before, it is being started for the first time
        return Absence(name, now_s, process.last_end, _RESTARTS, vital=is_core)
    if is_core and name not in listed:  # other components come and go; one that starts is no absence
        return Absence(
            name, now_s, f"its process {process.pid} is not registered", process.doing or "it starts", vital=True
        )
    return None


def stop_line(name: str, stop: StandingStop, now_s: float) -> str:
    """Return an emergency stop in force as a line for people.

    Example:
        >>> stop_line("scout1", StandingStop(1, "anna", "child in the room", 2.0), 5.0)
        'scout1 is STOPPED by anna for 3.0 s: child in the room; lift the stop at a console when it may move'
    """
    why = f": {stop.reason}" if stop.reason else ""
    unsure = "" if stop.is_confirmed else "; its radio did not confirm the stop"
    lasts_s = max(0.0, now_s - stop.since_s)
    return (
        f"{name} is STOPPED by {stop.by} for {lasts_s:.1f} s{why}{unsure}; lift the stop at a console when it may move"
    )


def holders_line(schedule: Schedule) -> str:
    """Return one line for a terminal that shows only lines: who runs, who waits.

    Example:
        >>> holders_line(Schedule(0.0, [], [], []))
        'nobody asks for anything'
    """
    running = [request.arc for request in schedule.requests if request.state is RequestState.RUNNING]
    waiting = [request.arc for request in schedule.requests if request.state is RequestState.WAITING]
    if not schedule.requests:
        return "nobody asks for anything"
    return f"runs: {', '.join(running) or 'nobody'}; waits: {', '.join(waiting) or 'nobody'}"
