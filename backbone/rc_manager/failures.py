"""Failures: RCs and ARCs that run and cannot do their work, since when, and why."""

from __future__ import annotations

from collections.abc import Callable, Collection

from backbone.bus.interface import Clock
from backbone.component.messages import Absence
from backbone.errors import LinkError, Refusal

Note = Callable[[str, str], object]


class Failures:
    """The RC manager's one record of failures; each lasts from ``begin`` to ``end``.

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

    def complain(self, name: str, what: str, error: Refusal | LinkError) -> None:
        """Add the failure of an RC or ARC to its story, and keep it as its last one."""
        self._note(name, f"{what}: {error}")
        self._complaints[name] = f"{what}: {error.detail if isinstance(error, Refusal) else error}"

    def begin(self, name: str) -> None:
        """Count the RC or ARC as failing from now on, unless it already does."""
        self._since_s.setdefault(name, self._clock.now_s())

    def end(self, name: str) -> None:
        """Count the RC or ARC as failing no longer."""
        self._since_s.pop(name, None)

    def absences(self, needed: Collection[str], doing: str, remedy: str = "") -> list[Absence]:
        """Return those of these RCs or ARCs that fail, sorted by name.

        Args:
            needed: RCs, or ARCs, whose failure matters now.
            doing: What the RC manager does about it.
            remedy: What an operator can do; ``{name}`` stands for the name.
        """
        return [
            Absence(name, self._since_s[name], self._why(name), doing, remedy.format(name=name), is_running=True)
            for name in sorted(self._since_s.keys() & needed)
        ]

    def _why(self, name: str) -> str:
        fault = self.put_aside.get(name)
        return f"it is put aside: {fault}" if fault else self._complaints.get(name, "")
