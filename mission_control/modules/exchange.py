"""Exchange: decides which of two modules produces outputs while one replaces the other.

Pure: time is an argument, and each module is given as a function that runs it once.

Rules of this file:

* In each round all outputs come from one of the two modules, so no output is lost or doubled.
* *Warming*: the old one produces; the new one gets the same inputs, and its outputs are dropped. *Proving*: the new one
produces, and the old one runs beside it.
* The old one runs until the exchange is over. That costs the run time of both. But the old one's state is that of a
module that was never exchanged, and its outputs are available even in the round in which the new one fails.
* A failure of the new one ends the exchange. A failure of the old one counts as without an exchange, unless the new one
already produces.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

import msgspec

from backbone.errors import complaint
from backbone.exchange_course import UNPROVED, ExchangeCourse, ExchangePhase, ExchangeRules
from backbone.handed_state import copy_for
from mission_control.modules.module import Module
from mission_control.modules.ports import type_name

Turned = Mapping[str, object] | None
"""Key → value that a module produced in a round; None: inputs were missing, so it did not run."""
Turn = Callable[[], Turned]
"""Runs a module once, if no input is missing."""


class Exchange(ExchangeCourse):
    """The course of one exchange, and its rounds.

    Args:
        is_ready: Returns whether the outputs of the new one can be used.
        changed: Called after each change of the phase, in the thread that changed it.
        now_s: Time of its begin.
    """

    unready = ": its unit had no round"

    def __init__(
        self, rules: ExchangeRules, is_ready: Callable[[], bool], changed: Callable[[], None], now_s: float
    ) -> None:
        super().__init__(rules, changed, now_s)
        self._is_ready = is_ready
        self._missing_since_s: dict[str, float] = {}
        self._busy = threading.Lock()  # a round may run in a thread, while the event loop ends its time

    def round(self, now_s: float, old: Turn, new: Turn) -> Turned:
        """Run the modules in this round; return the outputs of the producing one."""
        with self._busy:
            self.let_pass(now_s)
            match self.phase:
                case ExchangePhase.WARMING:
                    return self._warm(now_s, old, new)
                case ExchangePhase.PROVING:
                    return self._prove(now_s, old, new)
                case ExchangePhase.PROVED:
                    return new()
                case ExchangePhase.RETURNED:
                    return old()

    def pass_time(self, now_s: float) -> None:
        """Apply the passing of time; during a round, the round applies it."""
        if self._busy.acquire(blocking=False):
            try:
                self.let_pass(now_s)
            finally:
                self._busy.release()

    def _warm(self, now_s: float, old: Turn, new: Turn) -> Turned:
        kept = old()
        turned = self.tried(now_s, new)
        if turned is None:
            self.unready = self.unready and ": its inputs did not come together"  # unless they did in an earlier round
            return kept
        self.unready = ""
        if not set(kept or ()) - set(turned) and self.tried(now_s, lambda: bool(self._is_ready())):
            self.switch(now_s)
        return kept

    def _prove(self, now_s: float, old: Turn, new: Turn) -> Turned:
        turned = self.tried(now_s, new)
        if self.phase is ExchangePhase.RETURNED:
            return old()
        try:
            kept = old()
        except UNPROVED as error:
            self.end(ExchangePhase.PROVED, now_s, f"the old one failed beside it and is gone: {complaint(error)}")
            return turned
        if silent := self._silent(now_s, kept or {}, turned or {}):
            missing = ", ".join(silent)
            cause = f"no {missing} for {self._rules.silent_s:g} s, and the old one had it"
            self.fail(now_s, cause)
            return kept
        self.rounds += turned is not None
        return turned

    def _silent(self, now_s: float, kept: Mapping[str, object], turned: Mapping[str, object]) -> list[str]:
        """Return the keys that have had no output for too long."""
        for key in turned:
            self._missing_since_s.pop(key, None)
        for key in set(kept) - set(turned):
            self._missing_since_s.setdefault(key, now_s)
        return sorted(key for key, at_s in self._missing_since_s.items() if now_s - at_s >= self._rules.silent_s)


def handed_over(old: Module, new: Module) -> bool:
    """Give the new module a copy of the old one's state; return whether both states have the same fields and types.

    A copy is needed because both modules run.

    Raises:
        NotConverted: A class of the values was changed in a file that was read anew.
    """
    fields = _fields(old.State)
    if not fields or fields != _fields(new.State):
        return False
    values = {name: getattr(old.state, name) for name in fields}
    new.state = new.State(**copy_for(type(new), values))  # one copy, so that two fields still share objects
    return True


def _fields(state: type[msgspec.Struct]) -> dict[str, str]:
    return {one.name: type_name(one.type) for one in msgspec.structs.fields(state)}
