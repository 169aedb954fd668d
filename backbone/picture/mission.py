"""A mission as its observers know it: messages in; lines, tables and plain data out.

Rules of this file: no bus, no clock, no screen; times are mission seconds and arguments. Command line, launcher and
consoles keep the same picture: some ask for all of it repeatedly (``look``), others subscribe to its messages.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import assert_never

from backbone.component.messages import Absence, ComponentState, LifeState, MissionTime, StandingStop, StoryEvent
from backbone.creator.messages import Processes, ProcessState
from backbone.mission_log.log import Log, MissionLog, PeopleKnown
from backbone.mission_log.operators import OperatorActed
from backbone.mission_log.people import People
from backbone.nameserver.messages import Components, Disappeared
from backbone.naming import Subsystem, component_of, reading_order
from backbone.picture.health import MissionHealth, health
from backbone.picture.words import stop_lines
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule
from backbone.wire import plain

LOG_KEPT = 500  # chosen: some minutes of a busy mission; the launcher keeps more
HUNG_AFTER_S = 1.0  # chosen: the aim for noticing a component that hangs; machine seconds
_RESTARTS = "its creator restarts it"
_LIFE = list(LifeState)


Said = (
    Schedule
    | StoryEvent
    | Log
    | PeopleKnown
    | OperatorActed
    | ComponentState
    | Components
    | Disappeared
    | Processes
    | MissionTime
)
"""Messages that make up a picture."""


@dataclass
class MissionPicture:
    """A mission as an observer knows it.

    Attributes:
        at_s: Mission time of the last look.
        components: The present components, by address.
        processes: Reports of creators and launcher on their processes, by component name.
        schedule: The RC manager's schedule; None if it did not answer.
        problems: Services that did not answer, and gaps of the picture.
        missed: Absences this observer found: services that did not answer, components that failed, hang or ended.
        stale_since_s: Mission time at which the rest of the picture was true; None: now.
        log: The newest events, and the persons at the consoles.
    """

    mission: str
    at_s: float = 0.0
    components: dict[str, ComponentState] = field(default_factory=dict)
    processes: dict[str, ProcessState] = field(default_factory=dict)
    schedule: Schedule | None = None
    problems: tuple[str, ...] = ()
    missed: tuple[Absence, ...] = ()
    stale_since_s: float | None = None
    rate: float = 1.0
    log: MissionLog = field(default_factory=lambda: MissionLog(LOG_KEPT))

    def __post_init__(self) -> None:
        for component in self.components.values():
            self.people.heard(component)

    def take(self, said: Said, source: str = "") -> None:
        """Update the picture with a message.

        Args:
            source: Address of the sender.
        """
        match said:
            case Schedule():
                self.schedule = said
            case ComponentState():
                self._meet(said)
            case StoryEvent() | OperatorActed() | Log() | PeopleKnown():
                self.log.take(said, source)
            case Components():
                for one in self.changes(said):
                    self.take(one)
            case Disappeared():
                self.components.pop(said.address, None)
            case Processes():
                self.processes |= {process.spawn.name: process for process in said.processes}
            case MissionTime():
                self.rate = said.rate
            case _:
                assert_never(said)

    def changes(self, listed: Components) -> list[ComponentState | Disappeared]:
        """Return the present components of a list and, if the list is complete, the components that left."""
        gone = self.components.keys() - {component.address for component in listed.components}
        return [*listed.components, *(Disappeared(address) for address in sorted(gone) if listed.complete)]

    def _meet(self, component: ComponentState) -> None:
        self.people.heard(component)
        known = self.components.get(component.address)
        is_over = known is None and component.state is LifeState.STOPPED  # it came after the message of its end
        if not is_over and (known is None or not is_older(component, known)):
            self.components[component.address] = component

    @property
    def health(self) -> MissionHealth:
        """The mission's health, with absences."""
        return health(self.components, self.missed, self.at_s, self.rate)

    @property
    def stops(self) -> dict[str, StandingStop]:
        """The emergency stops in force, by the name of the stopped component."""
        stopped = {component_of(at): c.stop for at, c in self.components.items() if c.stop is not None}
        return {name: stopped[name] for name in sorted(stopped, key=reading_order)}

    @property
    def people(self) -> People:
        """The person at each console."""
        return self.log.people

    def stop_lines(self) -> list[str]:
        """Return the lines about the emergency stops in force, for people; one for all that are alike, if many."""
        return [self.people.named(line) for line in stop_lines(self.stops, self.at_s)]

    def remarks(self) -> list[str]:
        """Return the problems that are no absence, one line each."""
        told = tuple(f"{absence.name}: " for absence in self.health.absent)
        return [problem for problem in self.problems if not problem.startswith(told)]

    def of_subsystem(self, subsystem: Subsystem) -> list[ComponentState]:
        """Return the components of one of the four subsystems, sorted by name."""
        there = (at for at in self.components if at.startswith(f"{subsystem}/"))
        return [self.components[at] for at in sorted(there, key=reading_order)]

    def restarts(self, component: ComponentState) -> int:
        """Return how often the component was restarted."""
        process = self.processes.get(component_of(component.address))
        return process.restarts if process else 0

    def to_json(self) -> dict[str, object]:
        """Return the whole picture as plain data."""
        shown = ("type", "host", "pid", "state", "since_s", "feedback", "requester")
        components = [
            {"name": component_of(at), "subsystem": at.partition("/")[0], "person": one.user}
            | {field: getattr(one, field) for field in shown}
            | {"restarts": self.restarts(one)}
            for at, one in sorted(self.components.items())
        ]
        schedule = self.schedule or Schedule(self.at_s, [], [], [])
        return {
            "mission": self.mission,
            "at_s": self.at_s,
            **self.health.to_json(),
            "stale_since_s": self.stale_since_s,
            "stops": [{"name": name, **plain(stop)} for name, stop in self.stops.items()],
            "components": components,
            "rcs": plain(schedule.rcs),
            "requests": plain(schedule.requests),
            "groups": schedule.groups,
            "problems": list(self.problems),
        }


def misses(
    components: Iterable[ComponentState], processes: Iterable[ProcessState], now_s: float, rate: float = 1.0
) -> list[Absence]:
    """Return the absences by the reports of nameserver, launcher and creators: failed, hung or fallen components.

    Args:
        components: The registered components.
        processes: The processes of launcher and creators.
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
    """Return the absence that the report of a process means; None: it means none."""
    name, is_core = process.spawn.name, process.spawn.subsystem == Subsystem.BACKBONE
    if process.silent_s >= HUNG_AFTER_S:
        cause = f"it hangs: its event loop did not run for {process.silent_s:.1f} s"
        doing = "its creator ends and restarts it if it stays silent"
        return Absence(name, now_s - process.silent_s * rate, cause, doing, vital=is_core)
    if not process.pid and process.last_end:  # without an earlier end, it is being started for the first time
        return Absence(name, now_s, process.last_end, _RESTARTS, vital=is_core)
    if is_core and name not in listed:  # other components come and go; a starting one is no absence
        return Absence(
            name, now_s, f"its process {process.pid} is not registered", process.doing or "it starts", vital=True
        )
    return None


def is_older(one: ComponentState, other: ComponentState) -> bool:
    """Return whether the same process sent one state before the other, by the order of its life cycle.

    Their times cannot decide, because the nameserver dates a readiness by its own observation.
    """
    return one.pid == other.pid and _LIFE.index(one.state) < _LIFE.index(other.state)


def holders_line(schedule: Schedule) -> str:
    """Return one line for a terminal that shows only lines: running and waiting ARCs.

    Example:
        >>> holders_line(Schedule(0.0, [], [], []))
        'no ARC has a request'
    """
    running = [request.arc for request in schedule.requests if request.state is RequestState.RUNNING]
    waiting = [request.arc for request in schedule.requests if request.state is RequestState.WAITING]
    if not schedule.requests:
        return "no ARC has a request"
    return f"runs: {', '.join(running) or 'none'}; waits: {', '.join(waiting) or 'none'}"
