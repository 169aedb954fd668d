"""Failures: RCs and ARCs that run and cannot do their work, since when, and why.

The RC manager acts on each failure at once. The mission's health does not change with each packet that a link loses:

* Health names a failure with a reason, or a repeated one, at once, and one without an answer after ``NAMED_AFTER_S``.
* A failure that begins again within ``WORKS_AGAIN_S`` after its end is repeated. Health names it as one failure until
  the RC or ARC has worked for that time.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

from backbone.bus.interface import Clock
from backbone.component.messages import Absence
from backbone.errors import LinkError, Refusal

NAMED_AFTER_S = 1.0  # chosen: the RC was asked three times, so more than one packet was lost
WORKS_AGAIN_S = 20.0  # chosen: four of the papers' 5 s slices, so an RC that is shared was connected several times

Note = Callable[[str, str], object]


class Failures:
    """The RC manager's one record of failures; each lasts from ``begin`` to ``end``, or longer if it came repeatedly.

    Args:
        note: Adds an event to the story of a subject.

    Attributes:
        put_aside: RC → why it is not credible; the RC manager plans nothing on it.
    """

    def __init__(self, clock: Clock, note: Note) -> None:
        self._clock, self._note = clock, note
        self.put_aside: dict[str, str] = {}
        self._complaints: dict[str, str] = {}
        self._since_s: dict[str, float] = {}
        self._ended: dict[str, tuple[float, float]] = {}  # begin and end of the last failure, if not long ago
        self._repeated: set[str] = set()
        self._unanswered: set[str] = set()

    def complain(self, name: str, what: str, error: Refusal | LinkError) -> None:
        """Add the failure of an RC or ARC to its story, and keep it as its last one."""
        self._note(name, f"{what}: {error}")
        (self._unanswered.add if isinstance(error, LinkError) else self._unanswered.discard)(name)
        self._complaints[name] = f"{what}: {error.detail if isinstance(error, Refusal) else error}"

    def is_silent(self, name: str) -> bool:
        """Return whether the last failure of the RC or ARC was a missing answer."""
        return name in self._unanswered and name not in self.put_aside

    def begin(self, name: str) -> None:
        """Count the RC or ARC as failing from now on, unless it already does."""
        if name in self._since_s:
            return
        self._forget_old()
        now_s = self._clock.now_s()
        since_s, _ = self._ended.pop(name, (now_s, 0.0))
        if since_s < now_s:
            self._repeated.add(name)
        self._since_s[name] = since_s

    def end(self, name: str) -> None:
        """Count the RC or ARC as working."""
        since_s = self._since_s.pop(name, None)
        if since_s is not None:
            self._ended[name] = (since_s, self._clock.now_s())

    def forget(self, name: str) -> None:
        """Forget the failures of an RC or ARC that does not run."""
        self._since_s.pop(name, None)
        self._ended.pop(name, None)
        self._complaints.pop(name, None)
        self._repeated.discard(name)
        self._unanswered.discard(name)

    def repeated(self) -> set[str]:
        """Return the RCs and ARCs that fail repeatedly, also those that work at this moment."""
        self._forget_old()
        return {*self._repeated}

    def absences(
        self, needed: Collection[str], doing: str, remedy: Callable[[str], str] = lambda _name: ""
    ) -> list[Absence]:
        """Return the RCs or ARCs whose failure health names now, sorted by name.

        Args:
            needed: RCs, or ARCs, whose failure matters now.
            doing: What the RC manager does about it.
            remedy: Returns what an operator can do about the failure of this name.
        """
        since_s = {name: self._ended[name][0] for name in self.repeated() & self._ended.keys()} | self._since_s
        return [
            Absence(
                name,
                since_s[name],
                self._why(name),
                doing,
                remedy(name),
                is_running=True,
                is_repeated=name in self._repeated,
            )
            for name in sorted(since_s.keys() & needed)
            if self._is_named(name, since_s[name])
        ]

    def _is_named(self, name: str, since_s: float) -> bool:
        may_be_one_packet = self.is_silent(name) and name not in self._repeated
        return not may_be_one_packet or self._clock.now_s() - since_s >= NAMED_AFTER_S * self._clock.rate

    def _forget_old(self) -> None:
        long_ago_s = self._clock.now_s() - WORKS_AGAIN_S * self._clock.rate
        for name in [name for name, (_, ended_s) in self._ended.items() if ended_s <= long_ago_s]:
            del self._ended[name]
            self._repeated.discard(name)

    def _why(self, name: str) -> str:
        fault = self.put_aside.get(name)
        return f"it is put aside: {fault}" if fault else self._complaints.get(name, "")
