"""The liveness law: broken by a story that breaks it, and by no other."""

from __future__ import annotations

from typing import Any

from mission_control.laboratory.simulation.audit import Happening
from mission_control.laboratory.simulation.liveness import first_unhealed

Entry = tuple[float, str, str, dict[str, Any]]


def broken_law(*entries: Entry) -> str | None:
    broken = first_unhealed([Happening(*one) for one in entries])
    return broken.law if broken is not None else None


def at_the_end(missing: dict[str, str], named: dict[str, str], word: str) -> Entry:
    return (60.0, "health", "at the end", {"missing": missing, "named": named, "word": word})


def fell(name: str, how: str) -> Entry:
    return (5.0, name, "fell", {"how": how})


def test_a_mission_that_is_whole_again_breaks_nothing() -> None:
    assert broken_law(fell("scout1", "killed by SIGKILL"), at_the_end({}, {}, "ok")) is None


def test_what_is_missing_and_named_by_nobody_breaks_liveness() -> None:
    assert broken_law(at_the_end({"scout1": "does not run"}, {}, "ok")) == "liveness"
    assert broken_law(at_the_end({"scout1": "does not run"}, {"scout1": "no host"}, "degraded")) is None


def test_one_that_is_named_does_not_excuse_another() -> None:
    assert broken_law(at_the_end({"a": "does not run", "b": "has no link"}, {"a": "no host"}, "degraded")) == "liveness"


def test_health_that_is_not_ok_although_all_runs_is_a_false_alarm() -> None:
    assert broken_law(at_the_end({}, {"scout1": "killed by SIGKILL"}, "degraded")) == "no-false-alarm"


def test_health_that_says_ok_while_something_is_missing_breaks_said() -> None:
    assert broken_law((7.0, "health", "says ok", {"missing": ["scout1"], "since_s": 4.0})) == "said"


def test_to_end_a_process_as_hung_that_was_never_paused_breaks_lives() -> None:
    hung = fell("scout1", "hung: no sign of life for 3.0 s")
    assert broken_law(hung) == "lives"
    assert broken_law((2.0, "scout1", "paused", {"lasts_s": 4.0}), hung) is None
    assert broken_law((2.0, "scout2", "paused", {"lasts_s": 4.0}), hung) == "lives"
