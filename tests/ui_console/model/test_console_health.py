"""Consoles show the mission's health in one word, absences as alarms, and a silent launcher."""

from __future__ import annotations

import json

import pytest

from backbone.component.messages import Absence
from backbone.picture.health import HealthWord, MissionHealth
from backbone.printable import printable_all
from ui_console.model.console import ConsoleModel
from ui_console.model.events import Heard, event_json
from ui_console.model.profile import Profile
from ui_console.model.views import AlarmKind, AlarmView, view_json
from ui_console.terminal.head import head

GRABBER = Absence("grabber", 4.0, "killed by SIGKILL", "starts again in 0.1 s")
PLACER = Absence("placer", 1.0, "no answer", "the launcher restarts it", "Nothing.", vital=True)


def heard(at_s: float, word: HealthWord = HealthWord.OK, *absent: Absence) -> Heard:
    return Heard(at_s, MissionHealth(word, list(absent)))


def model(*events: Heard) -> ConsoleModel:
    made = ConsoleModel("console-1")
    made.look(0.0)
    for event in events:
        made.apply(event)
    return made


def absent(shown: ConsoleModel, now_s: float) -> dict[str, AlarmView]:
    return {alarm.subject: alarm for alarm in shown.view(now_s).alarms if alarm.kind is AlarmKind.ABSENT}


def test_before_the_launcher_could_say_anything_there_is_no_word() -> None:
    assert model().view(1.9).health is None
    assert absent(model(), 1.9) == {}


@pytest.mark.parametrize("word", list(HealthWord))
def test_the_word_and_the_lines_of_the_launcher_are_shown(word: HealthWord) -> None:
    view = model(heard(5.0, word, PLACER, GRABBER)).view(6.0)
    assert view.health is not None
    assert view.health.word == word
    assert view.health.lines == [
        "placer is absent for 5.0 s: no answer; the launcher restarts it; Nothing.",
        "grabber is absent for 2.0 s: killed by SIGKILL; starts again in 0.1 s",
    ]
    assert f"mission {word}: placer is absent" in head(view, 400, Profile.MONITOR, 4.0).status.plain
    assert json.loads(view_json(view))["health"]["word"] == word


def test_what_is_absent_is_an_alarm_until_it_is_back() -> None:
    shown = model(heard(5.0, HealthWord.DEGRADED, PLACER, GRABBER))
    assert absent(shown, 5.0).keys() == {"placer", "grabber"}
    assert absent(shown, 5.0)["placer"].remedy == "Nothing."
    shown.apply(heard(5.5, HealthWord.DEGRADED, GRABBER))
    shown.apply(heard(6.0, HealthWord.DEGRADED, GRABBER))
    alarms = absent(shown, 6.0)
    assert {name: alarm.count for name, alarm in alarms.items()} == {"grabber": 1}


@pytest.mark.parametrize("last", [[], [heard(5.0)]], ids=["never heard", "silent since"])
def test_a_launcher_that_is_silent_makes_the_mission_degraded(last: list[Heard]) -> None:
    shown, since_s = model(*last), last[0].at_s if last else 0.0
    view = shown.view(since_s + 2.1)
    assert view.health is not None
    assert view.health.word == "degraded"
    assert view.health.lines[0].startswith(
        "launcher is absent for 2.1 s: it is silent, so what is shown may be old; Look"
    )
    assert absent(shown, since_s + 2.1)["launcher"].is_active
    shown.apply(heard(since_s + 3.0))
    again = shown.view(since_s + 3.1).health
    assert again is not None
    assert (again.word, again.lines) == ("ok", [])
    assert absent(shown, since_s + 3.1) == {}


def test_a_silent_launcher_makes_no_failed_mission_better_and_ends_no_alarm() -> None:
    shown = model(heard(5.0, HealthWord.FAILED, PLACER))
    view = shown.view(9.0)
    assert view.health is not None
    assert view.health.word == "failed"
    assert {name for name, alarm in absent(shown, 9.0).items() if alarm.is_active} == {"launcher", "placer"}


@pytest.mark.parametrize("text", ["\x1b]0;x\x07", "\x9b2J", "a\rb", "\u202eb", "x" * 1_000_000])
def test_nothing_that_a_console_hears_commands_its_terminal(text: str) -> None:
    event = printable_all(heard(5.0, HealthWord.FAILED, Absence(text, 1.0, text)))
    view = model(event).view(6.0)
    assert head(view, 400, Profile.MONITOR, 4.0).status.plain.isprintable()
    assert event_json(event).decode().isprintable()


def test_a_component_that_runs_and_does_not_work_is_not_called_absent() -> None:
    radio = Absence("radio", 4.0, "its antenna is off", "the RC manager tries it again", is_running=True)
    shown = model(heard(5.0, HealthWord.DEGRADED, radio))
    assert absent(shown, 6.0)["radio"].line == "radio does not work: its antenna is off; the RC manager tries it again"
    health = shown.view(6.0).health
    assert health is not None
    assert health.lines == ["radio has not worked for 2.0 s: its antenna is off; the RC manager tries it again"]


def test_a_component_that_works_at_times_is_not_said_to_have_worked_never() -> None:
    radio = Absence("radio", 4.0, "its antenna is off", "it is tried again", is_running=True, is_repeated=True)
    shown = model(heard(5.0, HealthWord.DEGRADED, radio))
    assert absent(shown, 6.0)["radio"].line == "radio fails again and again: its antenna is off; it is tried again"
    health = shown.view(6.0).health
    assert health is not None
    assert health.lines == ["radio has failed again and again for 2.0 s: its antenna is off; it is tried again"]
