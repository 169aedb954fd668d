"""What a running mission looks like from outside: asked once, shown as a table, a line or JSON.

``look`` asks; everything else is pure.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec

from backbone.bus.interface import Bus
from backbone.component.messages import ComponentState
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import ListProcesses, Processes, ProcessState
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import ADDRESS as NAMESERVER
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import AskSchedule, RequestState, Schedule

LAUNCHER = "backbone/launcher"
LOOK_TIME_S = 1.0  # chosen: a person waits this long for a picture


@dataclass(frozen=True)
class MissionPicture:
    """A mission at one moment.

    Attributes:
        mission: Its name.
        at_s: Mission time.
        components: Who is registered, by address.
        processes: What creators and launcher say of their processes, by component name.
        schedule: The RC manager's; None if it did not answer.
        problems: Who did not answer, and why.
    """

    mission: str
    at_s: float
    components: Mapping[str, ComponentState]
    processes: Mapping[str, ProcessState] = field(default_factory=dict)
    schedule: Schedule | None = None
    problems: tuple[str, ...] = ()

    def of_subsystem(self, subsystem: Subsystem) -> list[ComponentState]:
        """Return the components of one of the four subsystems, sorted by name."""
        return [c for at, c in sorted(self.components.items()) if at.startswith(f"{subsystem}/")]

    def restarts(self, component: ComponentState) -> int:
        """Return how often the component was restarted."""
        process = self.processes.get(component_of(component.address))
        return process.restarts if process else 0

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
            }
            for _, c in sorted(self.components.items())
        ]
        schedule = (
            msgspec.to_builtins(_plain(self.schedule)) if self.schedule else {"rcs": [], "requests": [], "groups": []}
        )
        return {
            "mission": self.mission,
            "at_s": self.at_s,
            "components": components,
            "rcs": schedule["rcs"],
            "requests": schedule["requests"],
            "groups": schedule["groups"],
            "problems": list(self.problems),
        }


async def look(bus: Bus, now_s: float) -> MissionPicture:
    """Ask nameserver, RC manager and creators, and return what they say.

    Raises:
        LinkError: The nameserver did not answer: there is no mission to look at.
    """
    listing = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S)
    components = {component.address: component for component in listing.components}
    keepers = [at for at, c in components.items() if c.type == CREATOR or at == LAUNCHER]
    schedule, *processes = await asyncio.gather(
        _ask_or_problem(bus, RC_MANAGER, AskSchedule(), Schedule),
        *(_ask_or_problem(bus, keeper, ListProcesses(), Processes) for keeper in keepers),
    )
    answers = [answer for answer in processes if isinstance(answer, Processes)]
    problems = tuple(answer for answer in (schedule, *processes) if isinstance(answer, str))
    return MissionPicture(
        mission=bus.mission,
        at_s=now_s,
        components=components,
        processes={process.spawn.name: process for answer in answers for process in answer.processes},
        schedule=schedule if isinstance(schedule, Schedule) else None,
        problems=problems,
    )


async def _ask_or_problem(bus: Bus, address: str, question: Any, reply: type[Any]) -> Any:
    try:
        return await bus.ask(address, question, reply, within_s=LOOK_TIME_S)
    except (Refusal, LinkError) as error:
        return f"{address}: {error}"


def _plain(value: Any) -> Any:
    """Return structs as dictionaries of their fields, all the way down."""
    if isinstance(value, msgspec.Struct):
        return {name: _plain(getattr(value, name)) for name in value.__struct_fields__}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value


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
