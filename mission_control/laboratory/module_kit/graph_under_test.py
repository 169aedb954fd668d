"""Modules connected as in one unit of a mission, on virtual time; the rules of modules are checked for each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

from mission_control.laboratory.module_kit.module_under_test import watched
from mission_control.modules.execution_unit import UnitStatistics
from mission_control.modules.module import Module
from mission_control.modules.run import UNIT, connected


class GraphUnderTest:
    """Connected modules, and all values that they produced.

    Args:
        modules: Modules of different classes.
        given: Keys that the test feeds.
        frequency_hz: Rounds a second; 0: rounds only when a value is fed.

    Attributes:
        now_s: Virtual time, from 0.
        made: Key → all values that a module produced, the oldest first.

    Raises:
        GraphRefused: The modules cannot be connected; the error lists all faults.
    """

    def __init__(self, *modules: Module, given: Iterable[str] = (), frequency_hz: float = 0.0) -> None:
        types = {port.key: port.type for module in modules for port in module.ports().inputs}
        self._units = connected(
            *map(watched, modules),
            frequency_hz=frequency_hz,
            given={key: types.get(key, "taken by no module") for key in given},
        )
        self.now_s = 0.0
        self.made: dict[str, list[Any]] = {port.key: [] for module in modules for port in module.ports().outputs}
        for key, values in self.made.items():
            self._units.listen(key, values.append)

    def feed(self, key: str, value: object) -> None:
        """Feed a value from outside, and run every module that is due because of it.

        Raises:
            NotGiven: The key is none of ``given``, so no module would get the value.
        """
        self._units.feed(key, value, self.now_s)

    def advance(self, for_s: float) -> None:
        """Let virtual time pass, and run each round that begins in it."""
        until_s = self.now_s + for_s
        while self._units.next_s < until_s:
            self.now_s = self._units.next_s
            self._units.tick(self.now_s)
        self.now_s = until_s

    def statistics(self) -> UnitStatistics:
        """Return the number of rounds, and the number and duration of each module's runs."""
        return self._units.statistics()[UNIT]


class MakeGraph(Protocol):
    """Makes a ``GraphUnderTest``."""

    def __call__(self, *modules: Module, given: Iterable[str] = (), frequency_hz: float = 0.0) -> GraphUnderTest:
        """Return the modules, connected; see ``GraphUnderTest``."""
