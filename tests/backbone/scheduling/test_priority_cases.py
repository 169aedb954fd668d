"""Every question on the page about priorities, and tree priority against its definition in words."""

from __future__ import annotations

import random
import re
from dataclasses import dataclass, field
from pathlib import Path as File

import pytest
from test_priority_order import Tree, higher_by_walking_up, path

from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.priority import Path, higher
from backbone.scheduling.priority_tree import PriorityTree
from backbone.scheduling.requests import PathNode

PAGE = File(__file__).parents[3] / "docs" / "explanation" / "priorities.md"
SECTION = re.compile(
    r"^## (?P<title>\d+\. .*?)\n+```text\n(?P<tree>.*?)```\n(?P<questions>.*?)(?=^## |\Z)", re.M | re.S
)
NODE = re.compile(r"(?P<indent> *)(?P<console>console )?(?P<name>\w+) (?P<number>-?\d+)")
HIGHER = re.compile(
    r"(?:With `(?P<node>\w+)` set to (?P<number>-?\d+): is|Is) "
    r"`(?P<a>\w+)` higher than `(?P<b>\w+)`\? (?P<answer>Yes|No)\."
)
ORDER = re.compile(r"Waiting, the longest first: (?P<waiting>.*?)\. The order is: (?P<order>.*?)\.")


@dataclass
class Case:
    """One section of the page."""

    tree: PriorityTree
    nodes: dict[str, tuple[str, ...]]
    questions: list[str] = field(default_factory=list)

    def path(self, name: str) -> Path:
        return self.tree.path(self.nodes[name])


def case(title: str) -> Case:
    """Return the case as the RC manager would know it after requests of all its nodes."""
    found = SECTIONS[title]
    lines = [NODE.fullmatch(line) for line in found["tree"].splitlines()]
    mission = lines[0]
    assert mission is not None, title
    tree = PriorityTree(mission["name"], int(mission["number"]))
    nodes: dict[str, tuple[str, ...]] = {}
    way: list[PathNode] = []
    for line in lines:
        assert line is not None, title
        way = [*way[: len(line["indent"]) // 2], PathNode(line["name"], int(line["number"]))]
        nodes[line["name"]], _ = tree.place(way, console=bool(line["console"]))
    questions = [" ".join(part.split()) for part in re.split(r"^- ", found["questions"], flags=re.M)[1:]]
    return Case(tree, nodes, questions)


SECTIONS = {found["title"]: found for found in SECTION.finditer(PAGE.read_text(encoding="utf-8"))}


def names(listed: str) -> list[str]:
    return re.findall(r"`(\w+)`", listed)


def test_the_page_has_twenty_cases_in_order() -> None:
    assert [title.partition(".")[0] for title in SECTIONS] == [str(number) for number in range(1, 21)]


@pytest.mark.parametrize("title", SECTIONS)
def test_every_answer_on_the_page_is_the_codes_answer(title: str) -> None:
    assert case(title).questions
    for number, question in enumerate(case(title).questions):
        now = case(title)  # a change counts for its own question only
        if order := ORDER.match(question):
            waiting = names(order["waiting"])
            assert by_precedence(waiting, now.path, waiting.index) == names(order["order"]), (title, number)
            continue
        asked = HIGHER.match(question)
        assert asked is not None, f"{title}: {question} is no question this test can ask"
        if asked["node"]:
            now.tree.change(asked["node"], int(asked["number"]))
        assert higher(now.path(asked["a"]), now.path(asked["b"])) == (asked["answer"] == "Yes"), question


def random_tree(rng: random.Random) -> Tree:
    """Return up to a dozen nodes under one or more roots, with few different numbers."""
    tree: Tree = {"n0": (None, rng.randint(0, 2))}
    for number in range(1, rng.randint(2, 12)):
        parent = rng.choice([None, *tree]) if rng.random() < 0.9 else f"n{number - 1}"
        tree[f"n{number}"] = (parent, rng.randint(0, 2))
    return tree


def compare_random_trees(seed: int, count: int) -> int:
    """Return how many of the random pairs are not equal in priority."""
    rng = random.Random(seed)
    ordered = 0
    for _ in range(count):
        tree = random_tree(rng)
        a, b = rng.choice([*tree]), rng.choice([*tree])
        found = higher(path(tree, a), path(tree, b))
        assert found == higher_by_walking_up(tree, a, b), (tree, a, b)
        ordered += found
    return ordered


def test_random_pairs_of_random_trees_are_ordered_as_walking_up_says() -> None:
    assert 500 < compare_random_trees(seed=1, count=3000) < 2500


@pytest.mark.slow
def test_a_hundred_thousand_random_pairs_are_ordered_as_walking_up_says() -> None:
    assert 20_000 < compare_random_trees(seed=2, count=100_000) < 80_000
