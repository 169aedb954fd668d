"""A node of the behavior tree can be put below another parent while its ARCs wait and run."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import Any

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import convert, to_builtins
from random_missions import play, random_mission
from simulated_switches import MISSION, Bench, ask, manager, unit

from backbone.scheduling.events import KeptTree, NodeMoved, PriorityChanged
from backbone.scheduling.priority import higher
from backbone.scheduling.priority_tree import PriorityTree
from backbone.scheduling.requests import NotMovable, PathNode, UnknownRequest

seeds = st.integers(0, 2**32)

Way = tuple[str, ...]


class PlainTree:
    """A plain behavior tree: each node has a parent and a number."""

    def __init__(self, rng: Random) -> None:
        self.parent: dict[str, str] = {}
        self.number = {"m": 0}
        for name in "abcdefgh":
            self.parent[name] = rng.choice(sorted(self.number))
            self.number[name] = rng.randint(0, 2)

    def way(self, node: str) -> list[str]:
        return [*self.way(self.parent[node]), node] if node in self.parent else [node]

    def nodes(self, node: str) -> list[PathNode]:
        return [PathNode(name, self.number[name]) for name in self.way(node)]

    def path(self, node: str) -> tuple[tuple[str, int], ...]:
        return tuple((name, self.number[name]) for name in self.way(node))


def restored(tree: PriorityTree) -> PriorityTree:
    """Return the tree of the next RC manager."""
    later = PriorityTree("m", 0)
    later.restore(convert(to_builtins(tree.kept()), KeptTree))
    return later


@settings(max_examples=share(200))
@given(seeds)
def test_after_any_moves_everybody_stands_where_a_plain_tree_has_them(seed):
    """However often requests repeat the ways their owners were started with, and whenever the RC manager restarts."""
    rng = Random(seed)
    plain = PlainTree(rng)
    tree = PriorityTree("m", 0)
    asked = {node: plain.nodes(node) for node in plain.number}
    for way in asked.values():
        tree.place(way, console=False)
    for _ in range(rng.randint(1, 8)):
        node, parent = rng.choice(sorted(plain.parent)), rng.choice(sorted(plain.number))
        if node in plain.way(parent):
            assert tree.obstacle(node, parent)
            continue
        assert tree.obstacle(node, parent) == ""
        tree.move(node, parent)
        plain.parent[node] = parent
        if rng.random() < 0.3:
            again = rng.choice(sorted(plain.number))
            plain.number[again] = rng.randint(0, 2)
            tree.change(again, plain.number[again])
        if rng.random() < 0.3:
            tree = restored(tree)
            for one in rng.sample(sorted(asked), len(asked)):
                tree.place(asked[one], console=False)
        for one in rng.sample(sorted(asked), 3):
            names, _ = tree.place(asked[one], console=False)
            assert list(names) == plain.way(one)
    paths = {one: tree.path(tree.place(asked[one], console=False)[0]) for one in asked}
    assert paths == {one: plain.path(one) for one in asked}


def a_tree(*ways: str) -> PriorityTree:
    tree = PriorityTree("m", 0)
    for way in ways:
        tree.place([PathNode(name, 1) for name in way.split("/")], console=False)
    return tree


@pytest.mark.parametrize(
    ("node", "parent", "why"),
    [
        ("m", "a", "is the root"),
        ("a", "a", "is a itself"),
        ("a", "leaf", "or below it"),
        ("nobody", "a", "'nobody' has asked"),
        ("a", "nobody", "'nobody' has asked"),
        ("pilot", "a", "is a console"),
        ("a", "pilot", "is a console"),
        ("twin", "m", "there are 2 nodes"),
    ],
)
def test_what_cannot_be_moved_is_said_and_stays(node: str, parent: str, why: str) -> None:
    tree = a_tree("m/a/leaf", "m/b", "m/a/twin", "m/b/twin")
    tree.place([PathNode("pilot", 5)], console=True)
    before = tree.path(("m", "a", "leaf"))
    assert why in tree.obstacle(node, parent)
    with pytest.raises(ValueError, match=why):
        tree.move(node, parent)
    assert tree.path(("m", "a", "leaf")) == before


def test_a_node_that_asks_below_a_moved_one_for_the_first_time_stands_below_it() -> None:
    tree = a_tree("m/a/n", "m/b")
    tree.move("n", "b")
    names, _ = tree.place([PathNode("m", 0), PathNode("a", 1), PathNode("n", 1), PathNode("late", 2)], console=False)
    assert names == ("m", "b", "n", "late")
    assert higher(tree.path(("m", "b", "n")), tree.path(names))


def two_branches(**rules: Any) -> Bench:
    """Return a mission in which a low branch and a high one each have an ARC for the same RC."""
    bench = Bench(manager(**rules), unit("v"))
    bench.tell(ask("high", "v", path=[(MISSION, 0), ("above", 5), ("h", 1)]))
    bench.tell(ask("low", "v", path=[(MISSION, 0), ("below", 1), ("l", 1)]))
    return bench


def test_a_branch_moved_below_a_higher_one_takes_turns_with_it() -> None:
    bench = two_branches()
    assert bench.run(20.0).runs("low") == []
    bench.at(22.0, NodeMoved("l", "above"))
    bench.run(40.0)
    assert bench.runs("low") == [(22.0, 27.0), (32.0, 37.0)]
    assert bench.runs("high") == [(0.0, 22.0), (27.0, 32.0), (37.0, None)]
    assert bench.verdict() == []


def test_a_branch_moved_to_where_it_is_higher_overrides_at_once() -> None:
    bench = two_branches()
    bench.tell(PriorityChanged("l", 9))
    bench.at(2.0, NodeMoved("l", "above"))
    bench.run(10.0)
    assert bench.runs("high") == [(0.0, 2.0)]
    assert bench.runs("low") == [(2.0, None)]
    assert bench.verdict() == []


def test_moving_a_parent_moves_all_that_stand_below_it() -> None:
    bench = two_branches()
    bench.at(7.0, NodeMoved("below", "above"))
    bench.run(9.0)
    [moved] = bench.answers.attributes("low").requests
    assert [node.name for node in moved.path] == [MISSION, "above", "below", "l"]
    assert {one.arc for one in bench.answers.attributes("above").requests} == {"high", "low"}
    assert bench.runs("low") == [(7.0, None)]  # 'below' and 'h' are equal siblings now
    assert bench.verdict() == []


def test_the_trace_tells_a_moved_node_by_its_old_id_with_its_new_parent() -> None:
    bench = two_branches()
    bench.tell(NodeMoved("l", "above"))
    [line] = [line for line in bench.trace if line["ev"] == "node" and line["id"].endswith("/l")][1:]
    assert line == {"ev": "node", "t": 0.0, "id": f"{MISSION}/below/l", "parent": f"{MISSION}/above", "prio": 1}


def test_a_repeated_request_finds_its_moved_place_again_and_loses_no_time() -> None:
    bench = two_branches()
    bench.at(22.0, NodeMoved("l", "above"))
    bench.at(24.0, ask("low", "v", path=[(MISSION, 0), ("below", 1), ("l", 1)]))
    bench.run(30.0)
    assert bench.runs("low") == [(22.0, 27.0)]


def test_a_move_that_is_impossible_changes_nothing() -> None:
    bench = two_branches()
    before = [*bench.trace]
    bench.tell(NodeMoved("above", "h"))
    bench.tell(NodeMoved("nobody", "above"))
    assert bench.trace == before
    with pytest.raises(NotMovable) as refused:
        bench.manager.require_movable("above", "h")
    assert (refused.value.code, refused.value.facts["node"]) == ("scheduling.not_movable", "above")


def test_attributes_say_what_is_asked_for_as_it_counts_now() -> None:
    bench = two_branches()
    bench.tell(PriorityChanged("above", 7))
    [high] = bench.answers.attributes("h").requests
    assert (high.arc, list(high.uses), high.minimum_runtime_s, high.console) == ("high", ["v"], 5.0, False)
    assert [(node.name, node.priority) for node in high.path] == [(MISSION, 0), ("above", 7), ("h", 1)]
    assert len(bench.answers.attributes(MISSION).requests) == 2
    with pytest.raises(UnknownRequest):
        bench.answers.attributes("nobody")


def test_attributes_show_what_was_set_not_what_waiting_adds() -> None:
    bench = two_branches(aging_s=3.0)
    bench.run(10.0)
    [low] = bench.answers.attributes("low").requests
    assert [node.priority for node in low.path] == [0, 1, 1]


def moves(rng: Random, bench: Bench, nodes: Iterable[str]) -> None:
    names = [MISSION, *nodes]
    for _ in range(4):
        bench.at(rng.randint(0, 200) / 4, NodeMoved(rng.choice(names), rng.choice(names)))
        bench.at(rng.randint(0, 200) / 4, PriorityChanged(rng.choice(names), rng.randint(0, 3)))


@settings(max_examples=share(80))
@given(seeds, st.sampled_from(["no_delay", "strict"]))
def test_the_checker_finds_nothing_when_branches_move(seed, policy):
    rng = Random(seed)
    bench, happens = random_mission(rng, policy=policy)
    moves(rng, bench, ["p0", "p1", "p2", "n0", "n1", "n2", "n3"])
    assert play(bench, happens).verdict() == []
