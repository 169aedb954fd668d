from __future__ import annotations

from itertools import pairwise

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.priority import higher, rank, rank_of
from backbone.scheduling.priority_tree import PriorityTree
from backbone.scheduling.requests import PathNode, SchedulingRequest
from backbone.scheduling.state import ScheduleState

Tree = dict[str, tuple[str | None, int]]  # node → (parent, number)


@st.composite
def trees(draw: st.DrawFn) -> Tree:
    tree: Tree = {"root": (None, draw(st.integers(0, 3)))}
    for number in range(draw(st.integers(1, 12))):
        parent = draw(st.sampled_from([None, *tree]))
        tree[f"n{number}"] = (parent, draw(st.integers(0, 3)))
    return tree


def ancestors(tree: Tree, node: str) -> list[str]:
    """Return the node and all above it, the node first."""
    found = [node]
    while (parent := tree[found[-1]][0]) is not None:
        found.append(parent)
    return found


def path(tree: Tree, node: str) -> tuple[tuple[str, int], ...]:
    return tuple((name, tree[name][1]) for name in reversed(ancestors(tree, node)))


def higher_by_walking_up(tree: Tree, a: str, b: str) -> bool:
    """The papers' words: walk both up until they have a common parent, and compare these two."""
    if a == b:
        return False
    if a in ancestors(tree, b):
        return True
    if b in ancestors(tree, a):
        return False
    for above_a in ancestors(tree, a):
        for above_b in ancestors(tree, b):
            if tree[above_a][0] == tree[above_b][0]:
                return tree[above_a][1] > tree[above_b][1]
    raise AssertionError("all roots are siblings")


@settings(max_examples=share(100))
@given(trees())
def test_higher_is_what_walking_up_to_the_common_parent_says(tree):
    for a in tree:
        for b in tree:
            assert higher(path(tree, a), path(tree, b)) == higher_by_walking_up(tree, a, b)


@settings(max_examples=share(100))
@given(trees())
def test_ranks_of_arcs_are_those_of_their_owners_paths_also_when_they_are_known(tree):
    state = ScheduleState(discipline="turns", admission="exact", tolerance_s=0.05, exact_up_to=64)
    arcs = []
    for node in tree:
        way = path(tree, node)
        request = SchedulingRequest(node, node, [PathNode(*one) for one in way], False, [{}], 1.0)
        arcs.append(state.add_arc(request, {}, tuple(name for name, _ in way), way, 0.0, 0.0))
    for _again in range(2):
        for a in arcs:
            assert [rank_of(a, b) for b in arcs] == [rank(a.path, b.path) for b in arcs]


@settings(max_examples=share(100))
@given(trees(), st.randoms(use_true_random=False))
def test_nobody_comes_before_one_that_is_higher_and_else_the_smallest_key_comes_first(tree, rng):
    keys = {node: rng.randint(0, 5) for node in tree}
    order = by_precedence([*tree], lambda node: path(tree, node), lambda node: keys[node])
    assert sorted(order) == sorted(tree)
    for place, node in enumerate(order):
        remaining = order[place:]
        free = [one for one in remaining if not any(higher(path(tree, o), path(tree, one)) for o in remaining)]
        assert node in free
        assert keys[node] == min(keys[one] for one in free)


def test_equality_is_not_transitive():
    left, right = (("m", 0), ("a", 1), ("left", 2)), (("m", 0), ("a", 1), ("right", 1))
    other = (("m", 0), ("b", 1))
    assert higher(left, right)
    for one, two in pairwise([left, other, right]):
        assert not higher(one, two)
        assert not higher(two, one)


def test_a_number_set_by_the_operator_outlives_what_later_requests_say():
    tree = PriorityTree("m", 3)
    names, _ = tree.place([PathNode("m", 3), PathNode("a", 1)], console=False)
    tree.change("a", 9)
    assert tree.place([PathNode("m", 3), PathNode("a", 1)], console=False) == (names, False)
    assert tree.path(names) == (("m", 3), ("a", 9))


def test_a_console_is_no_node_of_the_tree_even_if_it_has_the_name_of_one():
    tree = PriorityTree("m", 3)
    console = tree.path(tree.place([PathNode("m", 5)], console=True)[0])
    behavior = tree.path(tree.place([PathNode("m", 3), PathNode("a", 1)], console=False)[0])
    assert higher(console, behavior)
    assert not higher(behavior, console)
