"""Course of an exchange: the phases in which a new part of a running component replaces the old one. Pure.

Modules, behaviors and drivers are exchanged by the same rules:

* While the new part *warms*, it runs beside the old one, which does the work. While it *proves* itself, it does the
  work, and the old one is kept. Afterwards only one of the two is left.
* If the new part fails, the exchange ends, and the old part does the work. If the old part fails, it is a bug as
  without an exchange.
* Each phase has a time limit.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import TypeVar

import msgspec

from backbone.errors import complaint
from backbone.exchange import Swapped
from backbone.handed_state import NotConverted, copy_for

T = TypeVar("T")
UNPROVED = (Exception, SystemExit, KeyboardInterrupt)
"""What code that has not proved itself may raise without an end of the component."""


class ExchangePhase(StrEnum):
    """Phase of an exchange."""

    WARMING = "warming"  # the old one does the work, the new one runs beside it
    PROVING = "proving"  # the new one does the work, the old one is kept
    PROVED = "proved"  # only the new one is left
    RETURNED = "returned"  # only the old one is left


class ExchangeRules(msgspec.Struct, frozen=True):
    """Times of an exchange, see ``backbone.exchange.SwapModule``."""

    prove_s: float
    ready_within_s: float
    silent_s: float = 0.0


class ExchangeCourse:
    """One exchange.

    Args:
        changed: Called after each change of the phase.
        now_s: Time of its start.

    Attributes:
        cause: Why the old one came back, or could not be kept; empty: neither happened.
        keeps_state: True if the new one goes on with the state of the old one.
        unconverted: Why the state could not be converted for the new one; empty: it could, or was not to be.
        rounds: Rounds, commands or calls of the new one while it did the work, up to the end of the exchange.
        switched_s: Time of the switch; None: there was none.
        ended_s: Time of the end; None: it is not over.
    """

    unready = ""
    """Appended to the cause if the new part did not become ready."""

    def __init__(self, rules: ExchangeRules, changed: Callable[[], None], now_s: float) -> None:
        self._rules, self._changed = rules, changed
        self.phase, self.cause, self.keeps_state, self.rounds = ExchangePhase.WARMING, "", False, 0
        self.began_s, self.unconverted = now_s, ""
        self.switched_s: float | None = None
        self.ended_s: float | None = None

    @property
    def is_over(self) -> bool:
        """True: only one of the two is left."""
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
        """End the present phase if its time is over."""
        if self.is_over or now_s < self.due_s:
            return
        if self.phase is ExchangePhase.PROVING:
            self.end(ExchangePhase.PROVED, now_s)
            return
        self.fail(now_s, f"not ready within {self._rules.ready_within_s:g} s{self.unready}")

    def fail(self, now_s: float, cause: str) -> None:
        """End the exchange because the new part failed; the old part does the work."""
        self.end(ExchangePhase.RETURNED, now_s, cause)

    def receive(self, now_s: float, hand_over: Callable[[], bool]) -> None:
        """Hand the state over by ``hand_over``, which returns whether it did; its bug ends the exchange."""

        def handed_over() -> bool:
            try:
                return hand_over()
            except NotConverted as refusal:
                self.unconverted = refusal.detail
                return False

        self.keeps_state = bool(self.tried(now_s, handed_over))

    def tried(self, now_s: float, act: Callable[[], T]) -> T | None:
        """Return the result of the new part; an exception ends the exchange."""
        try:
            return act()
        except UNPROVED as error:
            self.fail(now_s, complaint(error))
            return None

    def end(self, phase: ExchangePhase, now_s: float, cause: str = "") -> None:
        """End the exchange in this phase, if it is not over."""
        if not self.is_over:
            self.phase, self.cause, self.ended_s = phase, cause, now_s
            self._changed()

    def answer(self, now_s: float, remark: str = "") -> Swapped:
        """Return the answer to the request for this exchange."""
        ended_s = now_s if self.ended_s is None else self.ended_s
        switched_s = ended_s if self.switched_s is None else self.switched_s
        is_proved = self.phase is ExchangePhase.PROVED
        warming_s = max(0.0, switched_s - self.began_s)  # the round that began it may be older than the request
        if self.unconverted and is_proved:
            remark = f"its state is fresh, because {self.unconverted}" + (f"; {remark}" if remark else "")
        return Swapped(is_proved, self.cause, self.keeps_state, warming_s, ended_s - switched_s, self.rounds, remark)

    def outcome(self, old: str, new: str) -> str:
        """Return the outcome as a sentence for people.

        Args:
            old: Class path of the old part.
            new: Class path of the new part.
        """
        if self.phase is ExchangePhase.RETURNED:
            stays = "goes on" if self.switched_s is None else "is back"
            return f"{old} {stays}, {new} failed: {self.cause}"
        after = f": {self.cause}" if self.cause else ""
        state = "with the state of" if self.keeps_state else "from a fresh state instead of"
        why = f" ({self.unconverted})" if self.unconverted else ""
        return f"{new} goes on {state} {old}{why}{after}"


def remark_on_file(component: str, old: str, new: str) -> str:
    """Return a remark on the file of an old class that is back; empty if the new class is in another file."""
    is_same = old.partition(":")[0] == new.partition(":")[0]
    return f"the next start of {component} uses the present file" if is_same else ""


def class_path_of(one: object) -> str:
    """Return the class path of a part: ``package.module:Class``."""
    return f"{type(one).__module__}:{type(one).__qualname__}"


def hand_over(old: object, new: object) -> bool:
    """Copy the attributes that both classes name in ``hands_over`` to the new part; return whether it was done.

    They are copied because the old part may come back. If a value has another class than in the new part, none is
    copied; None fits any class.

    Raises:
        NotConverted: A class of the values was changed in a file that was read anew.
    """
    names = frozenset[str](getattr(type(old), "hands_over", ()))
    if not names or names != getattr(type(new), "hands_over", None):
        return False
    values = {name: getattr(old, name) for name in sorted(names)}
    if any(not _fits(value, getattr(new, name)) for name, value in values.items()):
        return False
    for name, value in copy_for(type(new), values).items():  # one copy, so that two attributes share objects
        setattr(new, name, value)
    return True


def _fits(old: object, new: object) -> bool:
    return old is None or new is None or _name_of(old) == _name_of(new)


def _name_of(value: object) -> str:
    kind = type(value)
    return f"{kind.__module__}.{kind.__qualname__}"
