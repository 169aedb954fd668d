"""Five traps into which other implementations of the same rules fell."""

from __future__ import annotations

from random import Random

import pytest
from random_missions import random_mission
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.scheduling.events import ConnectArc, RevokeArc
from backbone.scheduling.master_schedule import EXACT_UP_TO

P1_H = [("watch", 0), ("p1", 1), ("h", 1)]
P1_X = [("watch", 0), ("p1", 1), ("x", 2)]
P2_E = [("watch", 0), ("p2", 1), ("e", 9)]


def test_a_the_order_of_one_group_does_not_leak_into_another():
    """Ties are not transitive: an ARC of another group that is higher than one here must not hold it back here."""
    here = [ask("old", "v", path=P1_H, run_s=3.0), ask("young", "v", path=P2_E, run_s=3.0)]
    there = [ask("top", "w", path=P1_X), ask("rival", "w", path=[("watch", 0), ("p1", 1), ("r", 2)])]
    alone = Bench(manager(), unit("v"), unit("w"))
    both = Bench(manager(), unit("v"), unit("w"))
    for request in here:
        alone.tell(request)
    for request in (there[0], here[0], there[1], here[1]):
        both.tell(request)
    alone.run(30.0)
    both.run(30.0)
    for name in ("old", "young"):
        assert both.runs(name) == alone.runs(name)
    assert both.verdict() == []


def test_b_what_was_freed_by_force_goes_to_the_one_it_was_freed_for():
    """``e`` is equal to both and older than ``x``: but for the reservation it would take what ``x`` made free."""
    bench = Bench(manager(), unit("v", disconnect_s=0.25))
    bench.tell(ask("h", "v", path=P1_H))
    bench.at(1.0, ask("e", "v", path=P2_E))
    bench.at(2.0, ask("x", "v", path=P1_X, run_s=2.0))
    bench.run(12.0)
    assert bench.runs("h")[0] == (0, 2)
    assert bench.runs("x")[0] == (2.25, 4.25)
    assert bench.runs("e")[0][0] == 4.5
    assert bench.verdict() == []


def test_c_equals_on_a_radio_do_not_displace_each_other_again_and_again_at_one_instant():
    """``x`` beside ``a`` fits, ``y`` beside ``a`` fits, all three do not; ``y`` waits for ``h`` to be gone."""
    bench = Bench(manager(), sharable("r"), unit("u", disconnect_s=0.5))
    bench.tell(ask("h", "u"))
    bench.tell(ask("a", {"r": load(0.5)}))
    bench.run(6.0)
    bench.instructions.clear()
    bench.at(6.0, ask("y", {**ask("", "u").request.alternatives[0], "r": load(0.3)}))
    bench.at(6.0, ask("x", {"r": load(0.4)}))
    bench.run(6.0)
    switches = [instruction for _, instruction in bench.instructions if isinstance(instruction, ConnectArc | RevokeArc)]
    assert [type(switch).__name__ + " " + switch.arc for switch in switches] == [
        "RevokeArc h",
        "RevokeArc a",
        "ConnectArc x",
    ]
    bench.run(30.0)
    assert bench.runs("y")[0][0] == 6.5
    assert bench.verdict() == []


def test_d_hand_over_times_do_not_eat_an_exactly_fitting_gap():
    rng = Random(3)
    bench = Bench(
        manager(grace_s=0.2, tolerance_s=0.05),
        *(unit(name, connect_s=0.3, disconnect_s=0.05) for name in ("v", "r1", "r2")),
        pause_s=lambda deadline_s: rng.uniform(0.0, deadline_s),
        delay_s=lambda: rng.uniform(0.0, 0.01),
    )
    for request in (ask("h1", "v r1", priority=2), ask("h2", "v r2", priority=2), ask("l", "r2")):
        bench.tell(request)
    bench.run(100.0)
    assert len(bench.runs("h1")) >= 8
    assert len(bench.runs("l")) >= len(bench.runs("h1")) - 1
    assert bench.verdict() == []


@pytest.mark.parametrize("exact_up_to", [EXACT_UP_TO, 0], ids=["whole group", "large group"])
@pytest.mark.parametrize(("begin_s", "fits"), [(4.97, True), (4.99, False)])
def test_d_the_slack_of_a_gap_is_at_most_half_a_slice(begin_s, fits, exact_up_to):
    """A slice of 0.04 s is shorter than the tolerance: without a limit it would fit a gap of any length."""
    bench = Bench(manager(tolerance_s=0.05, exact_up_to=exact_up_to), unit("v"), unit("w"))
    bench.tell(ask("k", "w", priority=2))
    bench.tell(ask("h", "v w", priority=2))
    bench.at(begin_s, ask("l", "v", run_s=0.04))
    bench.run(6.0)
    assert bench.runs("h") == [(5.0, None)]
    assert bench.runs("l") == ([(begin_s, 5.0)] if fits else [])
    assert bench.verdict() == []


def test_e_an_arc_being_revoked_already_has_its_place_among_the_waiting():
    """``l`` would fit if ``h``, whose RCs are just being freed, were not to come back before ``l`` has done."""
    bench = Bench(manager(), unit("v", disconnect_s=0.5), unit("s", disconnect_s=0.5))
    bench.tell(ask("h", "v s", priority=2))
    bench.tell(ask("k", "v", priority=2))
    bench.at(5.2, ask("l", "s", priority=1, run_s=8.0))
    bench.run(30.0)
    assert bench.runs("l") == []
    assert bench.verdict() == []


def test_random_missions_are_the_same_every_time():
    def trace(seed: int) -> list[dict[str, object]]:
        bench, happens = random_mission(Random(seed))
        for time_s, event in happens:
            bench.at(time_s, event)
        return bench.run(30.0).trace

    assert trace(5) == trace(5)
