"""Modules connected as in one unit of a mission, on virtual time; the rules of modules are checked for each."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Protocol

from backbone.naming import did_you_mean
from mission_control.laboratory.module_kit.module_under_test import ModuleRuleBroken, check_value, watched
from mission_control.modules.execution_unit import UnitStatistics
from mission_control.modules.module import Module, default_name
from mission_control.modules.ports import kinds_of_ports
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
        ModuleRuleBroken: No module takes one of the given keys.
    """

    def __init__(self, *modules: Module, given: Iterable[str] = (), frequency_hz: float = 0.0) -> None:
        watching = [watched(module) for module in modules]
        self._takers = {port.key: (module, port) for module in watching for port in module.ports().inputs}
        fed = {key: self._taken(key) for key in given}
        self._units = connected(*watching, frequency_hz=frequency_hz, given=fed)
        self.now_s = 0.0
        self.made: dict[str, list[Any]] = {port.key: [] for module in modules for port in module.ports().outputs}
        for key, values in self.made.items():
            self._units.listen(key, values.append)

    def feed(self, key: str, value: object) -> None:
        """Feed a value from outside, and run every module that is due because of it.

        Raises:
            NotGiven: The key is none of ``given``, so no module would get the value.
            ModuleRuleBroken: The value is not of the class that the modules take, or a module broke a rule.
        """
        if key in self._takers:
            module, port = self._takers[key]
            kind = kinds_of_ports(module.Inputs)[port.name]
            check_value(f"input {port.name} of {default_name(type(module))}", port, kind, value)
        self._units.feed(key, value, self.now_s)

    def _taken(self, key: str) -> str:
        """Return the type of a key that the test feeds.

        Raises:
            ModuleRuleBroken: No module takes it.
        """
        if key not in self._takers:
            known = f"The modules take {', '.join(self._takers) or 'nothing'}."
            raise ModuleRuleBroken(f"no module takes {key!r}{did_you_mean(key, self._takers)}", remedy=known)
        return self._takers[key][1].type

    def advance(self, for_s: float) -> None:
        """Let virtual time pass, and run each round that begins in it.

        Args:
            for_s: Seconds, 0 or more, and finite.

        Raises:
            ModuleRuleBroken: Time cannot pass so; or a module broke a rule.
        """
        if not 0.0 <= for_s < math.inf:
            remedy = "Give the seconds that pass, 0 or more."
            raise ModuleRuleBroken(f"time cannot advance by {for_s} s", remedy=remedy)
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
