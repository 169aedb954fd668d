"""The RC manager's record of failures, on a clock that runs between any two lines, as a real one does."""

from __future__ import annotations

from backbone.bus.clock import MissionClock
from backbone.component.messages import Absence
from backbone.errors import NoResponder
from backbone.rc_manager.failures import Failures


class RunningClock(MissionClock):
    """Every reading of the time is a microsecond later than the last one."""

    _now_s = 0.0

    def now_s(self) -> float:
        self._now_s += 1e-6
        return self._now_s

    def pass_s(self, duration_s: float) -> None:
        self._now_s += duration_s


def absent(failures: Failures) -> list[Absence]:
    return failures.absences(["scout1"], "it is asked again")


def test_the_first_failure_is_no_repeated_one() -> None:
    """Each RC that was late with its first answer counted as failing again and again for twenty seconds."""
    clock = RunningClock(0.0)
    failures = Failures(clock, lambda _name, _what: None)
    failures.complain("scout1", "did not answer", NoResponder("no answer within 0.5 s"))
    failures.begin("scout1")
    assert failures.repeated() == set()
    assert absent(failures) == []
    clock.pass_s(2.0)
    assert [absence.is_repeated for absence in absent(failures)] == [False]
    failures.end("scout1")
    assert absent(failures) == []
    failures.begin("scout1")
    assert [absence.is_repeated for absence in absent(failures)] == [True]
