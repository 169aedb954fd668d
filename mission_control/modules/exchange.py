"""Exchange: decides which of two modules produces while one takes the place of the other.

Pure: time is an argument, and both modules are functions that run them once.

Rules of this file:

* In each round all outputs come from one of the two, so none is lost and none is doubled.
* While it *warms*, the new one gets the same inputs and its outputs are dropped; the old one produces. While the new
  one is *proving* itself, it produces, and the old one runs beside it.
* The old one runs until the exchange is over. That costs the time of both, but its state is that of a module that was
  never exchanged, and its outputs of the very round in which the new one fails are at hand.
* A failure of the new one ends the exchange; a failure of the old one is the bug that it would be without an exchange,
  unless the new one produces already.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import TypeVar

import msgspec

from mission_control.modules.module import Module
from mission_control.modules.ports import type_name

T = TypeVar("T")
Turned = Mapping[str, object] | None
"""Key → value that a module produced in a round; None: its inputs were not there, so it did not run."""
Turn = Callable[[], Turned]
"""Runs a module once, if its inputs are there."""
UNPROVED = (Exception, SystemExit)
"""What code that has not proved itself may raise without an end of the component."""


class ExchangePhase(StrEnum):
    """How far an exchange is."""

    WARMING = "warming"  # the old one produces, the new one runs beside it
    PROVING = "proving"  # the new one produces, the old one runs beside it
    PROVED = "proved"  # the new one is there alone
    RETURNED = "returned"  # the old one is there alone


class ExchangeRules(msgspec.Struct, frozen=True):
    """Times of an exchange, see ``backbone.exchange.SwapModule``."""

    prove_s: float
    ready_within_s: float
    silent_s: float


class Exchange:
    """One exchange.

    Args:
        is_ready: Returns whether the outputs of the new one can be used.
        changed: Called after each change of the phase, in the thread that made it.
        now_s: Time of its begin.

    Attributes:
        cause: Why the old one came back, or could not be kept; empty: neither is so.
        keeps_state: True if the new one began with the state of the old one.
        rounds: Rounds in which the new one produced, up to the end of the exchange.
        switched_s: Time of the switch; None: there was none.
        ended_s: Time of the end; None: it is not over.
    """

    def __init__(
        self, rules: ExchangeRules, is_ready: Callable[[], bool], changed: Callable[[], None], now_s: float
    ) -> None:
        self._rules, self._is_ready, self._changed = rules, is_ready, changed
        self.phase, self.cause, self.keeps_state, self.rounds = ExchangePhase.WARMING, "", False, 0
        self.began_s = now_s
        self.switched_s: float | None = None
        self.ended_s: float | None = None
        self._missing_since_s: dict[str, float] = {}
        self._has_run = False
        self._busy = threading.Lock()  # a round may run in a thread, and its time is over in the event loop

    @property
    def is_over(self) -> bool:
        """True: only one of the two is there."""
        return self.phase in (ExchangePhase.PROVED, ExchangePhase.RETURNED)

    @property
    def due_s(self) -> float:
        """Time at which the present phase is over, whatever happens."""
        if self.switched_s is None:
            return self.began_s + self._rules.ready_within_s
        return self.switched_s + self._rules.prove_s

    def begin(self, now_s: float, hand_over: Callable[[], bool]) -> None:
        """Let the new one have the state of the old one, if ``hand_over`` returns that it can."""
        self.keeps_state = bool(self._tried(now_s, hand_over))

    def round(self, now_s: float, old: Turn, new: Turn) -> Turned:
        """Run what is to run in this round; return the outputs of the one that produces."""
        with self._busy:
            self._let_pass(now_s)
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
        """Note the time, between rounds or during one, which then notes it itself."""
        if self._busy.acquire(blocking=False):
            try:
                self._let_pass(now_s)
            finally:
                self._busy.release()

    def fail(self, now_s: float, cause: str) -> None:
        """End: the old one produces. For failures of the new one before its first round."""
        self._end(ExchangePhase.RETURNED, now_s, cause)

    # ------------------------------------------------------------------ rounds
    def _warm(self, now_s: float, old: Turn, new: Turn) -> Turned:
        kept = old()
        turned = self._tried(now_s, new)
        if turned is None:
            return kept
        self._has_run = True
        if not set(kept or ()) - set(turned) and self._tried(now_s, self._is_ready):
            self.phase, self.switched_s = ExchangePhase.PROVING, now_s
            self._changed()
            self._let_pass(now_s)
        return kept

    def _prove(self, now_s: float, old: Turn, new: Turn) -> Turned:
        turned = self._tried(now_s, new)
        if self.phase is ExchangePhase.RETURNED:
            return old()
        try:
            kept = old()
        except Exception as error:
            self._end(ExchangePhase.PROVED, now_s, f"the old one failed beside it and is gone: {complaint(error)}")
            return turned
        if silent := self._silent(now_s, kept or {}, turned or {}):
            missing = ", ".join(silent)
            cause = f"no {missing} for {self._rules.silent_s:g} s, and the old one had it"
            self._end(ExchangePhase.RETURNED, now_s, cause)
            return kept
        self.rounds += turned is not None
        return turned

    def _silent(self, now_s: float, kept: Mapping[str, object], turned: Mapping[str, object]) -> list[str]:
        """Return the keys without an output for too long."""
        for key in turned:
            self._missing_since_s.pop(key, None)
        for key in set(kept) - set(turned):
            self._missing_since_s.setdefault(key, now_s)
        return sorted(key for key, at_s in self._missing_since_s.items() if now_s - at_s >= self._rules.silent_s)

    def _tried(self, now_s: float, act: Callable[[], T]) -> T | None:
        """Return what the new one returns; an exception ends the exchange."""
        try:
            return act()
        except UNPROVED as error:
            self._end(ExchangePhase.RETURNED, now_s, complaint(error))
            return None

    # ------------------------------------------------------------------ times
    def _let_pass(self, now_s: float) -> None:
        if self.is_over or now_s < self.due_s:
            return
        if self.phase is ExchangePhase.PROVING:
            self._end(ExchangePhase.PROVED, now_s)
            return
        why = "" if self._has_run else ": its inputs did not come together"
        self._end(ExchangePhase.RETURNED, now_s, f"not ready within {self._rules.ready_within_s:g} s{why}")

    def _end(self, phase: ExchangePhase, now_s: float, cause: str = "") -> None:
        if not self.is_over:
            self.phase, self.cause, self.ended_s = phase, cause, now_s
            self._changed()


def handed_over(old: Module, new: Module) -> bool:
    """Let the new module go on with a copy of the old one's state; return whether it has the same fields and types.

    A copy, because both run.
    """
    fields = _fields(old.State)
    if not fields or fields != _fields(new.State):
        return False
    new.state = new.State(**{name: copy.deepcopy(getattr(old.state, name)) for name in fields})
    return True


def _fields(state: type[msgspec.Struct]) -> dict[str, str]:
    return {one.name: type_name(one.type) for one in msgspec.structs.fields(state)}


def complaint(error: BaseException) -> str:
    """Return an exception as one line, with the place in the code if it has one.

    Example:
        >>> complaint(ValueError("no picture"))
        'ValueError: no picture'
    """
    told, trace = " ".join(f"{type(error).__name__}: {error}".split()), error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    where = "" if trace is None else f" ({trace.tb_frame.f_code.co_filename}, line {trace.tb_lineno})"
    return told + where
