"""Course of an exchange: how far a new part of a running component has taken the place of the old one. Pure.

Modules, behaviors and drivers are exchanged by the same rules:

* While the new part *warms*, it runs beside the old one, which does the work. While it *proves* itself, it does the
  work, and the old one is kept. Afterwards one of the two is there alone.
* Whatever fails in the new part ends the exchange in favor of the old one. What the old one does wrong is a bug as
  without an exchange.
* Each phase has an end at a time.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from enum import StrEnum
from typing import TypeVar

import msgspec

from backbone.errors import complaint
from backbone.exchange import Swapped

T = TypeVar("T")
UNPROVED = (Exception, SystemExit, KeyboardInterrupt)
"""What code that has not proved itself may raise without an end of the component."""


class ExchangePhase(StrEnum):
    """How far an exchange is."""

    WARMING = "warming"  # the old one does the work, the new one runs beside it
    PROVING = "proving"  # the new one does the work, the old one is kept
    PROVED = "proved"  # the new one is there alone
    RETURNED = "returned"  # the old one is there alone


class ExchangeRules(msgspec.Struct, frozen=True):
    """Times of an exchange, see ``backbone.exchange.SwapModule``."""

    prove_s: float
    ready_within_s: float
    silent_s: float = 0.0


class ExchangeCourse:
    """One exchange.

    Args:
        changed: Called after each change of the phase.
        now_s: Time of its begin.

    Attributes:
        cause: Why the old one came back, or could not be kept; empty: neither is so.
        keeps_state: True if the new one goes on with the state of the old one.
        rounds: Rounds, commands or calls of the new one while it did the work, up to the end of the exchange.
        switched_s: Time of the switch; None: there was none.
        ended_s: Time of the end; None: it is not over.
    """

    unready = ""
    """What a person should know of a new one that did not become ready."""

    def __init__(self, rules: ExchangeRules, changed: Callable[[], None], now_s: float) -> None:
        self._rules, self._changed = rules, changed
        self.phase, self.cause, self.keeps_state, self.rounds = ExchangePhase.WARMING, "", False, 0
        self.began_s = now_s
        self.switched_s: float | None = None
        self.ended_s: float | None = None

    @property
    def is_over(self) -> bool:
        """True: only one of the two is there."""
        return self.phase in (ExchangePhase.PROVED, ExchangePhase.RETURNED)

    @property
    def new_works(self) -> bool:
        """True: the new one does the work."""
        return self.phase in (ExchangePhase.PROVING, ExchangePhase.PROVED)

    @property
    def due_s(self) -> float:
        """Time at which the present phase is over at the latest."""
        if self.switched_s is None:
            return self.began_s + self._rules.ready_within_s
        return self.switched_s + self._rules.prove_s

    def switch(self, now_s: float) -> None:
        """Let the new one do the work from now on, unless the exchange is over."""
        if self.phase is ExchangePhase.WARMING:
            self.phase, self.switched_s = ExchangePhase.PROVING, now_s
            self._changed()
            self.let_pass(now_s)

    def let_pass(self, now_s: float) -> None:
        """Note the time."""
        if self.is_over or now_s < self.due_s:
            return
        if self.phase is ExchangePhase.PROVING:
            self.end(ExchangePhase.PROVED, now_s)
            return
        self.fail(now_s, f"not ready within {self._rules.ready_within_s:g} s{self.unready}")

    def fail(self, now_s: float, cause: str) -> None:
        """End, because the new one failed: the old one does the work."""
        self.end(ExchangePhase.RETURNED, now_s, cause)

    def tried(self, now_s: float, act: Callable[[], T]) -> T | None:
        """Return what the new one returns; an exception ends the exchange."""
        try:
            return act()
        except UNPROVED as error:
            self.fail(now_s, complaint(error))
            return None

    def end(self, phase: ExchangePhase, now_s: float, cause: str = "") -> None:
        """End, if it is not over."""
        if not self.is_over:
            self.phase, self.cause, self.ended_s = phase, cause, now_s
            self._changed()

    def answer(self, now_s: float, remark: str = "") -> Swapped:
        """Return the answer to who asked for the exchange."""
        ended_s = now_s if self.ended_s is None else self.ended_s
        switched_s = ended_s if self.switched_s is None else self.switched_s
        is_proved = self.phase is ExchangePhase.PROVED
        times = switched_s - self.began_s, ended_s - switched_s
        return Swapped(is_proved, self.cause, self.keeps_state, *times, self.rounds, remark)

    def outcome(self, old: str, new: str) -> str:
        """Return for people how it ended.

        Args:
            old: Class path of the old one, as ``new`` of the new one.
        """
        if self.phase is ExchangePhase.RETURNED:
            stays = "goes on" if self.switched_s is None else "is back"
            return f"{old} {stays}, {new} failed: {self.cause}"
        after = f": {self.cause}" if self.cause else ""
        state = "with the state of" if self.keeps_state else "from a fresh state instead of"
        return f"{new} goes on {state} {old}{after}"


def remark_on_file(component: str, old: str, new: str) -> str:
    """Return what an operator should know of an old class that is back; empty if the file of the new one is another."""
    is_same = old.partition(":")[0] == new.partition(":")[0]
    return f"a new start of {component} reads the file as it is now" if is_same else ""


def class_path_of(one: object) -> str:
    """Return where the class of a part stands, as ``package.module:Class``."""
    return f"{type(one).__module__}:{type(one).__qualname__}"


def hand_over(old: object, new: object) -> bool:
    """Let the new one go on with the attributes that both classes name in ``hands_over``; return whether they do.

    A copy, because the old one may come back. Values of other classes than the new one has are not handed over.
    """
    names = frozenset[str](getattr(type(old), "hands_over", ()))
    if not names or names != getattr(type(new), "hands_over", None):
        return False
    values = {name: getattr(old, name) for name in sorted(names)}
    if any(_name_of(value) != _name_of(getattr(new, name)) for name, value in values.items()):
        return False
    for name, value in copy.deepcopy(values).items():  # in one go, so that what two attributes share stays shared
        setattr(new, name, value)
    return True


def _name_of(value: object) -> str:
    kind = type(value)
    return f"{kind.__module__}.{kind.__qualname__}"
