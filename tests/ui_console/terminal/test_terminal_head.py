"""The first and the last line: facts that fit, facts left out first, and facts never cut."""

from __future__ import annotations

import msgspec
import pytest
from console_scenes import SCHEDULE, STOP, TEAM_EVENTS, held_model, model

from ui_console.model.events import Heard, LinkTrouble
from ui_console.model.profile import Profile
from ui_console.model.views import ConsentView, ConsoleView, HealthView, LostView
from ui_console.terminal.head import Head, head
from ui_console.terminal.keys import has, hints, key_lines, keys_help

WIDTHS = [20, 40, 50, 80, 120, 200]
NOW_S = 12.0


def busy() -> ConsoleView:
    """Return a view with something of everything."""
    shown = held_model()
    shown.apply(LinkTrouble(9.0, "nobody answers at resource_pool/scout2"))
    view = shown.view(NOW_S)
    health = HealthView("degraded", ["scout2 is wanted and absent since 12 s: its host is full; it is started again"])
    return msgspec.structs.replace(view, health=health)


def own(view: ConsoleView, **changes: object) -> ConsoleView:
    return msgspec.structs.replace(view, own=msgspec.structs.replace(view.own, **changes))


def shown_at(view: ConsoleView, columns: int, profile: Profile = Profile.TERMINAL) -> Head:
    return head(view, columns, profile, 0.25)


@pytest.mark.parametrize("columns", WIDTHS)
def test_the_first_line_fits_whatever_there_is_to_tell(columns: int) -> None:
    for view in (busy(), own(busy(), status="waiting for scout3: " + "a long reason " * 20), model().view(NOW_S)):
        assert shown_at(view, columns).status.cell_len <= columns


def test_at_80_columns_the_first_line_says_who_holds_what_how_the_mission_is_and_how_many_alarms() -> None:
    told = shown_at(busy(), 80).status.plain
    assert "you hold scout1" in told
    assert "mission degraded" in told
    assert "1 alarm" in told
    assert "picture" in shown_at(busy(), 120).status.plain


def test_where_there_is_room_the_first_line_says_why_the_mission_is_degraded() -> None:
    assert "its host is full" in shown_at(busy(), 200).status.plain
    assert "its host is full" not in shown_at(busy(), 80).status.plain


def test_a_reason_that_does_not_fit_stands_below_whole() -> None:
    status = "waiting for scout3: watch1 has its minimum run time for another 12 s, then console-2 is before you"
    waiting = own(busy(), status=status, is_held=False)
    assert status in shown_at(waiting, 200).status.plain
    assert [one.plain for one in shown_at(waiting, 200).says] == []
    narrow = shown_at(waiting, 80)
    assert "waiting for scout3…" in narrow.status.plain
    assert [one.plain for one in narrow.says] == [status]


@pytest.mark.parametrize("columns", WIDTHS)
def test_a_question_and_its_answer_are_never_cut(columns: int) -> None:
    asked = ConsentView("ben", "scout1", "mine is stuck", 6.0, 1, "take", "ben asks for scout1: mine is stuck", 1)
    view = own(busy(), consent=asked, asked="cleo keeps scout2: nearly done")
    says = [one.plain for one in shown_at(view, columns).says]
    assert "ben asks for scout1: mine is stuck [g: yes, n: no; 6 s, 1 more]" in says
    assert "cleo keeps scout2: nearly done" in says


def test_one_is_not_many() -> None:
    assert "1 alarm " in shown_at(busy(), 200).status.plain + " "


def test_a_console_without_a_link_says_first_that_it_stops_nothing_and_what_else_does() -> None:
    cut = own(busy(), link_down_s=9.0, is_held=False, status="NO LINK to the mission for 3 s: nothing can be stopped")
    told = shown_at(cut, 80)
    assert "NO LINK" in told.status.plain
    first = next(one.plain for one in told.says if "reach no robot" in one.plain)
    assert "another console" in first


@pytest.mark.parametrize(
    ("profile", "may_retake", "keys"),
    [
        (Profile.TERMINAL, True, "[t: take it again, k: seen]"),
        (Profile.TERMINAL, False, "[k: seen]"),
        (Profile.PENDANT, True, "[enter: take it again]"),
        (Profile.PENDANT, False, ""),
    ],
)
def test_a_robot_that_was_lost_is_named_with_why_and_the_key_that_takes_it_again(
    profile: Profile, may_retake: bool, keys: str
) -> None:
    lost = own(busy(), lost=LostView("scout1", "the link to it was away for too long", 4.0, may_retake), is_held=False)
    (told,) = [one.plain for one in shown_at(lost, 80, profile).says]
    assert told == f"you lost scout1 8 s ago: the link to it was away for too long {keys}".rstrip()


def test_what_is_held_down_and_moves_nothing_is_explained() -> None:
    assert "let go, then press anew" in [one.plain for one in shown_at(own(busy(), must_let_go=True), 80).says]


def test_robots_that_others_stopped_are_on_the_first_line_of_every_console() -> None:
    shown = model(*TEAM_EVENTS, Heard(11.0, STOP))
    for profile in Profile:
        assert "STOPPED: scout1" in shown_at(shown.view(NOW_S), 80, profile).status.plain


@pytest.mark.parametrize("profile", list(Profile))
@pytest.mark.parametrize("columns", WIDTHS)
def test_the_last_line_fits_and_always_names_the_keys_that_stop(profile: Profile, columns: int) -> None:
    shown = held_model()
    shown.apply(Heard(11.0, STOP))
    lines = key_lines(hints(shown.view(NOW_S), profile, "scout1"), columns, 2).plain.split("\n")
    assert all(len(line) <= columns for line in lines)
    told = " ".join(lines)
    assert "STOP scout1" in told
    if columns >= 40:
        assert "STOP ALL" in told


@pytest.mark.parametrize("profile", list(Profile))
def test_at_80_columns_the_last_line_names_help_and_quit_in_every_state(profile: Profile) -> None:
    held, watching = held_model(), model(Heard(8.0, SCHEDULE))
    held.apply(Heard(11.0, STOP))
    for view in (held.view(NOW_S), watching.view(NOW_S), own(busy(), is_held=False)):
        told = key_lines(hints(view, profile, "scout1"), 80, 1).plain
        assert "? " in told
        assert "keys" in told
        assert "quit" in told


def test_the_last_line_names_what_a_key_does_now() -> None:
    def told(view: ConsoleView) -> str:
        return key_lines(hints(view, Profile.TERMINAL, "scout1"), 300, 1).plain

    assert "give back" in told(held_model().view(NOW_S))
    assert "may I?" in told(own(busy(), is_held=False, is_asked=True))
    assert "lift a stop" not in told(held_model().view(NOW_S))
    watching = own(busy(), is_held=False, is_asked=False)
    assert " t take " in told(watching)
    lost = LostView("scout1", "the link was away", 4.0, True)
    assert " t take it again " in told(own(watching, lost=lost))


def test_the_keys_of_a_profile_are_listed_once_each_those_that_stop_first() -> None:
    for profile in Profile:
        listed = keys_help(profile, lambda binding: binding.key)
        assert "EMERGENCY STOP" in listed[0]
        assert "EMERGENCY STOP" in listed[1]
        assert len(listed) == len(set(listed))
        assert not [line for line in listed if "Quit" in line or "alt+" in line]
        assert has(profile, "lift")


def test_one_person_at_two_screens_is_told_so() -> None:
    screens = ["your other screen on lab drives scout2"]
    for is_asked in (True, False):
        told = [one.plain for one in shown_at(own(busy(), other_screens=screens, is_asked=is_asked), 80).says]
        assert (screens[0] in told) is is_asked, "once: here, or in the first line of one that watches"
