"""Units in one process: passes values between them, in an order that depends only on the inputs.

Pure: time is an argument. Units, too, exchange objects without copying.
"""

from __future__ import annotations

import time
from collections import defaultdict, deque
from collections.abc import Callable, Collection, Mapping
from typing import Any

from backbone.errors import Refusal
from backbone.naming import did_you_mean
from mission_control.modules.execution_unit import ExecutionUnit, Stopwatch, UnitStatistics
from mission_control.modules.graph import Graph
from mission_control.modules.module import Module
from mission_control.modules.unit_schedule import Trigger

Listener = Callable[[Any], None]
"""Called with each value of a key; it takes values of that key's class."""


class NothingToHear(Refusal):
    """A listener of a key that no module produces would never be called."""

    code = "module.listener"
    remedy = "Name the key of an output."


class NotGiven(Refusal):
    """A value of a key that does not come from outside would reach no module."""

    code = "module.feed"
    remedy = "Feed a key of 'given'."


def check_heard(key: str, produced: Collection[str]) -> None:
    """Return if values of this key are produced.

    Raises:
        NothingToHear: They are not.
    """
    if key not in produced:
        raise NothingToHear(f"nothing produces {key!r} for a listener{did_you_mean(key, produced)}")


class UnitsTogether:
    """All units of a graph.

    Args:
        graph: The modules and their connections.
        modules: Name → module.
        triggers: Unit → condition for its rounds; a unit left out has a round at any input.
        start_s: Time of the first ticks.
        stopwatch: Measures the run time of modules.
    """

    def __init__(
        self,
        graph: Graph,
        modules: Mapping[str, Module],
        triggers: Mapping[str, Trigger] | None = None,
        start_s: float = 0.0,
        stopwatch: Stopwatch = time.perf_counter,
    ) -> None:
        given = triggers or {}
        self._units = {
            name: ExecutionUnit(name, graph, modules, given.get(name, Trigger()), start_s, stopwatch)
            for name in graph.units
        }
        members = [member for of in graph.units.values() for member in of]
        self._given = graph.given
        self._produced = {key for member in members for key, _port in member.keyed_outputs}
        self._consumers: dict[str, list[ExecutionUnit]] = defaultdict(list)
        for one in graph.connections:
            self._consumers[one.key].append(self._units[one.consumer])
        self._listeners: dict[str, list[Listener]] = defaultdict(list)

    @property
    def next_s(self) -> float:
        """Time of the next round of any frequency; infinite without frequencies."""
        return min((unit.due_s for unit in self._units.values()), default=float("inf"))

    def listen(self, key: str, listener: Listener) -> None:
        """Call the listener with each produced value of this key.

        Raises:
            NothingToHear: No module produces it.
        """
        check_heard(key, self._produced)
        self._listeners[key].append(listener)

    def feed(self, key: str, value: object, now_s: float) -> None:
        """Store a value from outside, and run every unit that is due because of it.

        Raises:
            NotGiven: The graph names no such key as given.
        """
        if key not in self._given:
            raise NotGiven(f"{key!r} is not given from outside{did_you_mean(key, self._given)}")
        self._run([unit for unit in self._consumers[key] if unit.put(key, value)], now_s)

    def tick(self, now_s: float) -> None:
        """Run every unit that is due at this time, and all units that are due because of that."""
        for unit in self._units.values():
            if unit.tick(now_s):
                self._run([unit], now_s)

    def advance(self, until_s: float) -> None:
        """Let time pass up to and including this time; run each round of a frequency at its time."""
        while (now_s := self.next_s) <= until_s:
            self.tick(now_s)

    def statistics(self) -> dict[str, UnitStatistics]:
        """Return unit → its statistics."""
        return {name: unit.statistics() for name, unit in self._units.items()}

    def _run(self, due: list[ExecutionUnit], now_s: float) -> None:
        waiting = deque(due)
        while waiting:
            for key, value in waiting.popleft().run(now_s):
                for listener in self._listeners.get(key, ()):
                    listener(value)
                for unit in self._consumers.get(key, ()):
                    if unit.put(key, value) and unit not in waiting:
                        waiting.append(unit)
