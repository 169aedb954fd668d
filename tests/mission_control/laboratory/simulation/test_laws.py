"""The laws themselves: each is broken by a story that breaks it, and by no other."""

from __future__ import annotations

from typing import Any

import pytest

from backbone.dependency_database.messages import Resource
from backbone.scheduling.requests import Usage
from mission_control.laboratory.simulation.audit import Happening
from mission_control.laboratory.simulation.laws import Broken, first_broken, story_of
from mission_control.laboratory.simulation.shape import MissionShape, OwnerShape, draw_shape

Entry = tuple[float, str, str, dict[str, Any]]


def shape_of(*owners: OwnerShape) -> MissionShape:
    resources = (
        Resource("scout1", "scout", parameters={"network_id": 1}),
        Resource("radio1", "command_radio", sharable=True),
    )
    return MissionShape(0, resources, frozenset(), owners, 10, 0.1, "no_delay", 10.0, 20.0)


def owner(name: str, priority: int) -> OwnerShape:
    path = (("simulated", 10), (name, priority))
    return OwnerShape(name, "drive", path, False, 1.0, 1.0, {}, Usage(0.2, 0.02), 0.0, False)


A, B = owner("a", 2), owner("b", 1)


def judged(*entries: Entry) -> Broken | None:
    return first_broken(shape_of(A, B), [Happening(*one) for one in entries])


def held(at_s: float, rc: str, arc: str, epoch: int) -> Entry:
    return (at_s, rc, "held", {"arc": arc, "epoch": epoch})


def let_go(at_s: float, rc: str, arc: str, epoch: int) -> Entry:
    return (at_s, rc, "let go", {"arc": arc, "epoch": epoch})


def packet(at_s: float, command: str, arc: str, epoch: int) -> Entry:
    return (at_s, "radio1", "packet", {"robot": 1, "command": command, "arc": arc, "epoch": epoch})


def broken_law(*entries: Entry) -> str:
    broken = judged(*entries)
    assert broken is not None
    return broken.law


def test_a_unit_rc_that_changes_hands_in_order_breaks_nothing() -> None:
    assert (
        judged(held(1, "scout1", "a-drive", 1), let_go(2, "scout1", "a-drive", 1), held(2, "scout1", "b-drive", 2))
        is None
    )


def test_two_holders_of_a_unit_rc_break_one_holder() -> None:
    assert broken_law(held(1, "scout1", "a-drive", 1), held(2, "scout1", "b-drive", 2)) == "one-holder"


def test_two_holders_of_a_radio_break_nothing() -> None:
    assert judged(held(1, "radio1", "a-drive", 1), held(2, "radio1", "b-drive", 2)) is None


def test_an_epoch_that_does_not_grow_over_a_restart_breaks_epochs_grow() -> None:
    restart: list[Entry] = [(2, "scout1", "killed", {}), (3, "scout1", "begins", {})]
    assert judged(held(1, "scout1", "a-drive", 5), *restart, held(4, "scout1", "a-drive", 6)) is None
    assert broken_law(held(1, "scout1", "a-drive", 5), *restart, held(4, "scout1", "a-drive", 5)) == "epochs-grow"


def test_a_command_of_an_older_epoch_after_the_robot_was_given_on_breaks_fenced() -> None:
    both = (held(1, "scout1", "a-drive", 1), held(1, "radio1", "a-drive", 1), packet(1.1, "D", "a-drive", 1))
    given_on = (let_go(2, "scout1", "a-drive", 1), held(2, "scout1", "b-drive", 2))
    assert judged(*both, *given_on, packet(2.1, "S", "a-drive", 1)) is None
    assert broken_law(*both, *given_on, packet(2.1, "D", "a-drive", 1)) == "fenced"


def test_even_a_safe_packet_of_an_older_epoch_after_the_next_ones_command_breaks_fenced() -> None:
    two = (held(1, "scout1", "a-drive", 1), held(1, "radio1", "a-drive", 1), held(1, "radio1", "b-drive", 2))
    given_on = (let_go(2, "scout1", "a-drive", 1), held(2, "scout1", "b-drive", 2), packet(2.1, "D", "b-drive", 2))
    assert broken_law(*two, *given_on, packet(2.2, "S", "a-drive", 1)) == "fenced"


def test_a_packet_for_an_arc_that_does_not_hold_the_radio_breaks_fenced() -> None:
    assert broken_law(held(1, "scout1", "a-drive", 1), packet(1.1, "D", "a-drive", 1)) == "fenced"


def test_a_radio_that_calls_itself_safe_after_a_drive_packet_breaks_safe() -> None:
    begun = (held(1, "radio1", "a-drive", 1), packet(1.1, "D", "a-drive", 1), let_go(2, "radio1", "a-drive", 1))
    safe: Entry = (2.1, "radio1", "safe", {"arc": "a-drive", "epoch": 1})
    assert broken_law(*begun, safe) == "safe"
    assert judged(*begun, packet(2.05, "S", "a-drive", 1), safe) is None


def test_an_arc_that_is_called_free_and_goes_on_holding_breaks_freed() -> None:
    free: Entry = (2, "rc_manager", "free", {"arc": "a-drive"})
    later: Entry = (3, "mission", "calm", {})
    assert broken_law(held(1, "scout1", "a-drive", 1), free, later) == "freed"
    assert judged(held(1, "scout1", "a-drive", 1), free, let_go(2.1, "scout1", "a-drive", 1), later) is None


def test_an_rc_that_is_up_again_and_still_held_by_an_arc_that_is_called_free_breaks_freed() -> None:
    free: Entry = (2, "rc_manager", "free", {"arc": "a-drive"})
    down: Entry = (1.9, "rc_manager", "rc_state", {"id": "scout1", "state": "down"})
    up: Entry = (5, "rc_manager", "rc_state", {"id": "scout1", "state": "up"})
    later: Entry = (6, "mission", "calm", {})
    begun = (held(1, "scout1", "a-drive", 1), down, free)
    assert judged(*begun, later) is None
    assert broken_law(*begun, up, later) == "freed"
    assert judged(*begun, let_go(4.9, "scout1", "a-drive", 1), up, later) is None


def test_a_gate_that_opens_over_what_was_never_connected_breaks_whole_set() -> None:
    opened: Entry = (2, "a-drive", "open", {"epochs": {"scout1": 1, "radio1": 1}})
    assert broken_law(held(1, "scout1", "a-drive", 1), opened) == "whole-set"


def test_an_owner_that_believes_for_too_long_what_is_not_so_breaks_true() -> None:
    resumed: Entry = (1, "a", "resumed", {"arc": "a-drive", "epochs": {"scout1": 1}})
    assert judged(resumed, (5, "mission", "storm", {})) is None
    assert broken_law(resumed, (30, "mission", "storm", {})) == "true"
    assert broken_law(resumed, (2, "mission", "calm", {}), (11, "mission", "over", {})) == "true"


def test_who_wants_and_never_gets_breaks_progress_unless_somebody_is_above_it() -> None:
    calm: Entry = (1, "mission", "calm", {})
    over: Entry = (20, "mission", "over", {})
    wants: list[Entry] = [(2, "a", "wants", {}), (2, "b", "wants", {})]
    run: list[Entry] = [
        held(3, "scout1", "a-drive", 1),
        (3, "a-drive", "open", {"epochs": {"scout1": 1}}),
        (3, "a", "resumed", {"arc": "a-drive", "epochs": {"scout1": 1}}),
    ]
    assert broken_law(calm, *wants, over) == "progress"
    assert judged(calm, *wants, *run, over) is None


@pytest.mark.parametrize(("is_confirmed", "moves_until_s"), [(True, 2.0), (False, 3.0)])
def test_a_packet_that_moves_a_stopped_robot_breaks_stopped(is_confirmed: bool, moves_until_s: float) -> None:
    holds = [held(1, "scout1", "a-drive", 1), held(1, "radio1", "a-drive", 1)]
    stop: Entry = (2, "operator", "stops", {"robot": "scout1", "is_confirmed": is_confirmed})
    lift: Entry = (5, "operator", "lifts", {"robot": "scout1"})
    for command in "DJ":
        late = packet(moves_until_s + 0.1, command, "a-drive", 1)
        assert broken_law(*holds, stop, late) == "stopped"
        assert judged(*holds, stop, packet(moves_until_s, command, "a-drive", 1)) is None
        assert judged(*holds, stop, lift, packet(5, command, "a-drive", 1)) is None
    assert judged(*holds, stop, packet(4, "H", "a-drive", 1), packet(4, "V", "a-drive", 1)) is None


def numbered(at_s: float, name: str, number: int) -> Entry:
    return (at_s, "rc_manager", "node", {"id": f"simulated/{name}", "parent": "simulated", "prio": number})


def asked(at_s: float, name: str) -> Entry:
    return (at_s, "rc_manager", "request", {"arc": f"{name}-drive", "owner": f"simulated/{name}"})


ROOT: Entry = (1, "rc_manager", "node", {"id": "simulated", "parent": None, "prio": 10})


def test_a_confirmed_priority_that_does_not_hold_breaks_obeyed() -> None:
    done: Entry = (2, "operator", "changed", {"target": "a", "value": 7})
    over: Entry = (30, "mission", "over", {})
    began: list[Entry] = [ROOT, numbered(1, "a", 2), asked(1, "a"), done]
    again: list[Entry] = [(9, "rc_manager", "begins", {}), (9, *ROOT[1:]), numbered(9, "a", 2), asked(9, "a")]
    assert broken_law(*began, over) == "obeyed"
    assert judged(*began, numbered(2, "a", 7), over) is None
    assert broken_law(*began, *again, over) == "obeyed"
    assert judged(*began, *again, (10, "rc_manager", "depart", {"arc": "a-drive"}), over) is None
    assert judged(*began, (3, "operator", "unconfirmed", {"target": "a", "value": 7}), over) is None
    soon: Entry = (7.9, "operator", "changed", {"target": "a", "value": 7})
    assert judged(*began[:-1], soon, *again, over) is None, "the launcher may not have it yet"


def test_progress_is_judged_by_the_priorities_that_an_operator_set() -> None:
    """``a`` began as the higher one."""
    calm: Entry = (10, "mission", "calm", {})
    over: Entry = (30, "mission", "over", {})
    tree = [ROOT, numbered(1, "a", 2), numbered(1, "b", 1), asked(1, "a"), asked(1, "b")]
    wants: list[Entry] = [(10, name, "wants", {"arc": f"{name}-drive"}) for name in "ab"]
    found = judged(*tree, numbered(2, "b", 3), calm, *wants, over)
    assert found is not None
    assert (found.law, found.names) == ("progress", ("b", "b-drive"))


@pytest.mark.parametrize(
    ("what", "values", "law"), [("fails", {"error": "x"}, "no-bug"), ("promise broken", {"promise": "x"}, "schedule")]
)
def test_bugs_and_broken_invariants_are_reported(what: str, values: dict[str, str], law: str) -> None:
    assert broken_law((1, "rc_manager", what, values)) == law


def test_a_story_is_about_those_concerned_and_ends_with_the_breach() -> None:
    entries = [held(1, "scout1", "a-drive", 1), held(1, "radio1", "c-drive", 1), held(2, "scout1", "b-drive", 2)]
    happenings = [Happening(*one) for one in [*entries, let_go(3, "scout1", "b-drive", 2)]]
    broken = first_broken(shape_of(A, B), happenings)
    assert broken is not None
    assert story_of(broken, happenings) == [happenings[0], happenings[2]]


def test_a_seed_means_one_mission() -> None:
    assert draw_shape(7) == draw_shape(7)
    shapes = [draw_shape(seed) for seed in range(200)]
    assert {len(shape.owners) for shape in shapes} == set(range(1, 9))
    assert max(shape.active_s + shape.calm_s for shape in shapes) < 60


def test_what_is_taken_undecided_after_the_rc_managers_death_breaks_kept() -> None:
    running: list[Entry] = [
        held(1, "scout1", "a-drive", 1),
        (1, "a-drive", "open", {"epochs": {"scout1": 1}}),
        (1, "a", "resumed", {"arc": "a-drive", "epochs": {"scout1": 1}}),
        (5, "rc_manager", "killed", {}),
    ]
    back: Entry = (5.3, "rc_manager", "begins", {})
    end = let_go(6, "scout1", "a-drive", 1)

    def law_of(*entries: Entry) -> str:
        broken = first_broken(shape_of(A, B), [Happening(*one) for one in entries], all_arrived=True)
        return broken.law if broken is not None else ""

    assert law_of(*running, back, end) == "kept"
    assert not law_of(*running, back, (5.9, "rc_manager", "revoke", {"arc": "a-drive"}), end)
    assert not law_of(*running, (6.0, "rc_manager", "begins", {}), end)
    assert not law_of((4.9, "b", "killed", {}), *running, back, end)
    assert judged(*running, back, end) is None
