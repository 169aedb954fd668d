"""The live picture fits its terminal and shows components, holders, schedule, and what happens."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from backbone.component.messages import ComponentState, LifeState, StoryEvent
from backbone.picture.mission import MissionPicture
from backbone.picture.screen import live_screen, screen
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule

RUNNING = RequestView(
    "watch1-capture", "mission_control/watch1", RequestState.RUNNING, ["scout1"], 3.0, 8.0, -1.0, "", [], 5.0, "m:1", 1
)
WAITING = RequestView(
    "watch2-capture",
    "mission_control/watch2",
    RequestState.WAITING,
    ["scout1"],
    3.0,
    -1.0,
    8.5,
    "",
    ["watch1-capture"],
    5.0,
    "m:1",
    2,
)
SCHEDULE = Schedule(
    6.0,
    [
        RcView("scout1", "scout", "up", False, 1.0, [Holder("watch1-capture", 427, 3.0, 7.0)], 427, ["watch2-capture"]),
        RcView("scout2", "scout", "up", False, 1.0, [], 0, []),
    ],
    [RUNNING, WAITING],
    [["scout1"]],
)
EVENTS = [StoryEvent(float(n), "mission_control/watch1", f"motion seen {n}", "scout1", "") for n in range(30)]


def component(name: str, subsystem: str = "backbone", state: LifeState = LifeState.READY) -> ComponentState:
    return ComponentState(f"{subsystem}/{name}", "kind", "base", 4711, state, 0.0, f"{name} at work")


def picture(*components: ComponentState, problems: tuple[str, ...] = ()) -> MissionPicture:
    return MissionPicture("m", 6.0, {c.address: c for c in components}, {}, SCHEDULE, problems)


def drawn(shown: object, width: int = 120) -> str:
    console = Console(width=width)
    with console.capture() as captured:
        console.print(shown)
    return captured.get()


MANY = [component(f"part{number:02}") for number in range(40)]
FEW = [component("placer"), component("watch1", "mission_control"), component("late", state=LifeState.CONNECTING)]


@pytest.mark.parametrize("height", [24, 30, 40, 60])
@pytest.mark.parametrize("components", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("width", [80, 120])
def test_it_has_no_more_lines_than_the_terminal(height: int, components: list[ComponentState], width: int) -> None:
    shown = drawn(live_screen(picture(*components, problems=("rc_manager: silent",)), EVENTS, height), width)
    assert len(shown.splitlines()) <= height
    assert "motion seen 29" in shown


def test_it_shows_components_holders_turns_and_events() -> None:
    shown = drawn(live_screen(picture(*FEW), EVENTS, 40))
    for text in (
        "2 of 3 components ready",
        "placer at work",
        "connecting",
        "watch1-capture #427",
        "then watch2-capture",
        "at least 2.0 s more",
        "in 2.5 s",
        "for watch1-capture",
        "motion seen 29",
    ):
        assert text in shown


def test_a_terminal_of_80_columns_shows_when_each_arc_runs() -> None:
    """The time stood at the end of a line of padded columns, of which 'i…' was left."""
    shown = drawn(live_screen(picture(*FEW), EVENTS, 24), 80)
    assert "at least 2.0 s more" in shown
    assert "in 2.5 s, for watch1-capture" in shown


def test_components_that_do_not_fit_are_counted() -> None:
    assert "lines more" in drawn(live_screen(picture(*MANY), EVENTS, 30))


def test_a_mission_whose_rc_manager_is_away_is_shown_all_the_same() -> None:
    alone = MissionPicture("m", 6.0, {}, {}, None, ("backbone/rc_manager: no answer",))
    assert "backbone/rc_manager: no answer" in drawn(live_screen(alone, [], 24))


def test_who_does_not_listen_to_events_sees_no_place_for_them() -> None:
    assert "events" not in drawn(live_screen(picture(*FEW), None, 40))
    assert len(drawn(live_screen(picture(*MANY), None, 30)).splitlines()) <= 30


def test_the_whole_picture_names_what_the_fitted_one_leaves_out() -> None:
    shown = drawn(screen(picture(*MANY)), 160)
    assert all(f"part{number:02}" in shown for number in range(40))


@pytest.mark.parametrize("width", [40, 80])
def test_a_narrow_terminal_shows_every_cell_of_the_whole_picture(width: int) -> None:
    shown = " ".join(drawn(screen(picture(*FEW)), width).split())
    for text in (
        "backbone component late, type kind, host base, pid 4711, state connecting, doing late at work",
        "component placer, type kind, host base, pid 4711, state ready, doing placer at work",
        "scout1 kind scout, state up, holder watch1-capture, epoch 427, since 3.0 s",
        "watch2-capture state waiting, for 3.0 s, until / expected in 2.5 s, turns 2, priority m:1",
    ):
        assert text in shown
    assert "…" not in shown


def test_a_table_that_fits_is_a_table() -> None:
    shown = drawn(screen(picture(*FEW)), 120)
    assert "│                 │ placer    │ kind │ base │ 4711 │ ready " in shown


def test_the_whole_picture_tells_until_when_an_rc_is_held_who_follows_and_what_ends_a_wait_without_end() -> None:
    holder = Holder("guard-capture", 7, 3.0, 7.0)
    rc = RcView(
        "scout1", "scout", "up", False, 1.0, [holder], 7, ["tour-capture", *"abc"], [8.0], [8.5, 9.0, 9.5, 10.0]
    )
    starving = RequestView(
        "tour-capture",
        "mission_control/tour",
        RequestState.WAITING,
        ["scout1"],
        1.0,
        -1.0,
        -1.0,
        "it waits for guard-capture",
        ["guard-capture"],
        5.0,
        "m:1",
        2,
        "9",
        "guard-capture releases or idles",
        1,
    )
    shown = drawn(screen(MissionPicture("m", 6.0, {}, {}, Schedule(6.0, [rc], [starving], []), ())), width=220)
    assert "tour-capture at 8.5 s, a at 9.0 s, b at 9.5 s, 1 more" in shown
    assert "│ 8.0 s │" in shown
    assert "m:1 (risen by 1)" in shown
    assert "it waits for guard-capture (rule 9); until guard-capture releases or idles" in shown


@pytest.mark.parametrize("draw", [screen, lambda picture: live_screen(picture, [], 60)], ids=["whole", "live"])
def test_a_person_at_a_console_is_shown_by_name_wherever_the_console_holds_or_waits(draw: Any) -> None:
    arc, owner = "console-7-drive", "ui_console/console-7"
    console = ComponentState(owner, "console", "base", 7, LifeState.READY, 1.0, "drives scout1", user="anna")
    held = RcView("scout1", "scout", "up", False, 1.0, [Holder(arc, 3, 1.0, 2.0)], 3, [], [5.0], [])
    because = f"{arc} running: since 1.00 s"
    request = RequestView(
        arc, owner, RequestState.RUNNING, ["scout1"], 1.0, 5.0, -1.0, because, [], 5.0, "console-7:100", 1
    )
    picture = MissionPicture("m", 2.0, {owner: console}, schedule=Schedule(2.0, [held], [request], []))
    shown = drawn(draw(picture))
    assert arc not in shown
    assert "anna:100" in shown
    assert "anna drives scout1" in shown
    assert picture.to_json()["components"][0]["person"] == "anna"
