"""Load: the processor time of each robot, each module and each process of a mission, from two readings.

Rules of this file:

* Processor time is measured for processes. Each component of a process counts with an equal part of its time.
* A robot's time is the time of its RC, with the driver in it, and of the ARCs that hold the robot or wait for it. The
  time of an ARC for several robots counts in equal parts for each robot.
* A module's time is the duration of its ``update`` calls, as its unit measured it. It is part of the time of the unit's
  process.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from backbone.component.messages import PROCESSOR_S, ComponentState
from backbone.naming import component_of
from backbone.scheduling.views import Schedule

_RUNS, _BUSY_S, _LONGEST_S = "_runs", "_busy_s", "_longest_s"  # see ``ModuleTimes``

Numbers = Mapping[str, Mapping[str, float]]
"""Address → the component's statistics."""


@dataclass(frozen=True, slots=True)
class LoadReading:
    """The statistics of all components at about the same time.

    Attributes:
        at_s: Seconds of the machine's monotonic clock.
        numbers: Address → the component's statistics.
    """

    at_s: float
    numbers: Numbers


@dataclass(frozen=True, slots=True)
class ProcessLoad:
    """A process.

    Attributes:
        components: Names of its components, sorted.
        processor_s: Its processor time until now.
        cores: Cores that it kept busy between the readings; 1: one whole core.
    """

    host: str
    pid: int
    components: tuple[str, ...]
    processor_s: float
    cores: float


@dataclass(frozen=True, slots=True)
class RobotLoad:
    """A robot.

    Attributes:
        components: Its RC first, then its ARCs.
        processor_s: Processor time of these components for the robot until now.
        cores: Cores that they kept busy for the robot between the readings.
    """

    robot: str
    components: tuple[str, ...]
    processor_s: float
    cores: float


@dataclass(frozen=True, slots=True)
class ModuleLoad:
    """A module.

    Attributes:
        processor_s: Duration of all its updates until now.
        cores: Seconds of updates per second between the readings.
        rate_hz: Updates a second between the readings.
    """

    unit: str
    module: str
    processor_s: float
    cores: float
    rate_hz: float
    longest_s: float


@dataclass(frozen=True, slots=True)
class Loads:
    """All loads of a mission.

    Attributes:
        silent: Names of the components without a processor time in their statistics, sorted.
    """

    robots: list[RobotLoad]
    modules: list[ModuleLoad]
    processes: list[ProcessLoad]
    silent: list[str]


def loads(
    components: Iterable[ComponentState], schedule: Schedule | None, first: LoadReading, then: LoadReading
) -> Loads:
    """Return the loads between two readings; a component that started between them counts from its start."""
    present = list(components)
    processes = sorted(_processes(present, first, then), key=lambda one: (-one.cores, one.host, one.pid))
    silent = sorted(
        component_of(one.address) for one in present if PROCESSOR_S not in then.numbers.get(one.address, {})
    )
    return Loads(_robots(schedule, processes), list(_modules(first, then)), processes, silent)


def _processes(components: Iterable[ComponentState], first: LoadReading, then: LoadReading) -> Iterable[ProcessLoad]:
    members: dict[tuple[str, int], list[str]] = defaultdict(list)
    for one in components:
        if PROCESSOR_S in then.numbers.get(one.address, {}):
            members[one.host, one.pid].append(one.address)
    for (host, pid), addresses in members.items():
        processor_s = max(then.numbers[at][PROCESSOR_S] for at in addresses)
        before_s = max((first.numbers.get(at, {}).get(PROCESSOR_S, 0.0) for at in addresses), default=0.0)
        before_s = before_s if before_s <= processor_s else 0.0  # it was restarted
        cores = (processor_s - before_s) / (then.at_s - first.at_s)
        yield ProcessLoad(host, pid, tuple(sorted(map(component_of, addresses))), processor_s, cores)


def _robots(schedule: Schedule | None, processes: Iterable[ProcessLoad]) -> list[RobotLoad]:
    if schedule is None:
        return []
    robots = {one.rc for one in schedule.rcs if one.is_robot}
    parts = {robot: {robot: 1.0} for robot in sorted(robots)}
    for request in schedule.requests:
        asked = robots.intersection(request.rcs)
        for robot in asked:
            parts[robot][request.arc] = 1.0 / len(asked)
    process_of = {component: one for one in processes for component in one.components}
    return [_robot(robot, of, process_of) for robot, of in parts.items()]


def _robot(robot: str, parts: Mapping[str, float], process_of: Mapping[str, ProcessLoad]) -> RobotLoad:
    processor_s = cores = 0.0
    there = [name for name in parts if name in process_of]
    for name in there:
        process = process_of[name]
        part = parts[name] / len(process.components)
        processor_s, cores = processor_s + part * process.processor_s, cores + part * process.cores
    return RobotLoad(robot, tuple(there), processor_s, cores)


def _modules(first: LoadReading, then: LoadReading) -> Iterable[ModuleLoad]:
    took_s = then.at_s - first.at_s
    for address, numbers in sorted(then.numbers.items()):
        before = first.numbers.get(address, {})
        for name in numbers:
            module = name.removesuffix(_BUSY_S)
            if module == name or not {module + _RUNS, module + _LONGEST_S} <= numbers.keys():
                continue
            is_same = before.get(module + _RUNS, 0.0) <= numbers[module + _RUNS]  # else it was restarted
            busy_s, runs = (
                numbers[module + what] - (before.get(module + what, 0.0) if is_same else 0.0)
                for what in (_BUSY_S, _RUNS)
            )
            unit = component_of(address)
            yield ModuleLoad(unit, module, numbers[name], busy_s / took_s, runs / took_s, numbers[module + _LONGEST_S])
