"""Last branch: decides whether an order to end runs the branch, ends the branch, or takes the mission down.

Pure: orders and ends go in with the time of the event, decisions come out. Times are mission seconds.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum, auto

from backbone.component.messages import StoryEvent
from backbone.component_database.messages import ComponentType
from backbone.mission.model import EXECUTION_UNIT, LastBranchDescription
from backbone.naming import Subsystem, component_of

_FINISHED = {"success": "succeeded", "failure": "failed"}


def ends_before(types: Iterable[ComponentType]) -> frozenset[str]:
    """Return the types whose components end before the last branch: behaviors, but not the units that it may need."""
    return frozenset(
        one.name for one in types if one.subsystem is Subsystem.MISSION_CONTROL and one.name != EXECUTION_UNIT
    )


class LastStage(Enum):
    """State of the last branch; it only moves downwards in this list."""

    WAITS = auto()  # no order to end was given
    FREES = auto()  # consoles and other behaviors are being stopped
    RUNS = auto()
    OVER = auto()  # the mission goes down


class LastBranch:
    """The decisions about the last branch of one mission.

    Args:
        declared: The branch; None: the mission has none.
    """

    def __init__(self, declared: LastBranchDescription | None) -> None:
        self._declared = declared
        self._began_s = 0.0
        self.stage = LastStage.WAITS
        self.how = ""
        """How the branch ended, as in *succeeded after 8.3 s*; empty before its end, and without a branch."""

    @property
    def name(self) -> str:
        """Name of the branch's root; empty: the mission has no last branch."""
        return self._declared.behavior.name if self._declared is not None else ""

    @property
    def within_s(self) -> float:
        """Longest run of the branch; 0: the mission has no last branch."""
        return self._declared.within_s if self._declared is not None else 0.0

    @property
    def told(self) -> str:
        """How the branch ended, as a whole line; empty before its end, and without a branch."""
        return f"last branch {self.name}: {self.how}" if self.how else ""

    @property
    def is_at_work(self) -> bool:
        """True from the order to end until the branch is over."""
        return self.stage in (LastStage.FREES, LastStage.RUNS)

    @property
    def doing(self) -> str:
        """State or result of the branch, one line; empty: no branch, or no order to end was given."""
        if self.is_at_work:
            return f"last branch {self.name} runs, for at most {self.within_s:g} s; a second order ends it at once"
        return self.told

    def ordered(self, now_s: float, *, is_up: bool, at_once: bool = False) -> bool:
        """Apply an order to end; return False if the branch runs first, True if the mission goes down now.

        Args:
            is_up: False: the mission is still coming up, so that no branch can run.
            at_once: True: the order skips the branch.
        """
        if self.stage is LastStage.WAITS and self._declared is not None and is_up and not at_once:
            self.stage, self._began_s = LastStage.FREES, now_s
            return False
        match self.stage:
            case LastStage.WAITS:
                self._end("skipped, as ordered" if at_once else "skipped, because the mission was not up")
            case LastStage.FREES | LastStage.RUNS:
                self.finished("ended by a second order", now_s)
        return True

    def began(self, now_s: float) -> float:
        """Record that all other components have stopped and the branch starts; return the time of its deadline."""
        if self.stage is LastStage.FREES:
            self.stage, self._began_s = LastStage.RUNS, now_s
        return self._began_s + self.within_s

    def finished(self, how: str, now_s: float) -> None:
        """Record the end of the branch; if it has ended already, change nothing.

        Args:
            how: As in *succeeded*, or *stopped by anna*.
        """
        self._end(f"{how} after {now_s - self._began_s:.1f} s")

    def not_started(self, why: str) -> None:
        """Record that the branch cannot start; if it has ended already, change nothing."""
        self._end(f"could not be started: {why}")

    def _end(self, how: str) -> None:
        if self.stage is not LastStage.OVER:
            self.stage = LastStage.OVER
            self.how = how if self.name else ""


def how_it_finished(events: Iterable[StoryEvent], name: str) -> str:
    """Return how a behavior finished according to its story, *succeeded* or *failed*; empty: not yet.

    Args:
        events: The behavior's story, oldest first.
        name: The behavior's name.
    """
    for event in events:
        head, _, status = event.what.partition(": ")
        is_its_own = component_of(event.where) == event.subject == name
        if is_its_own and head == "finished" and status in _FINISHED:
            return _FINISHED[status]
    return ""
