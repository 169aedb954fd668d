"""The tree that the tutorial composes by mouse, played from many seeds: it ends as its composites say."""

from __future__ import annotations

import math
import re
from pathlib import Path
from random import Random

import pytest
from behaviors_at_work import EXAMPLES, at_work, pose

from backbone.bus.clock import run_virtual
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.mission.behavior_nodes import BehaviorNode
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus

EXAMPLE = EXAMPLES / "night.xml"
ROOT, MOST_S = "night-watch", 900.0  # the two minutes of hiding stand still while it has no grant
NEAR_M = 0.5  # dead reckoning over a round of patrol and the way there
SUCCESS, FAILURE = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE


def drawn(seed: int, folder: Path) -> MissionDescription:
    """Return the mission with battery, visitor and air of this seed; in one of four there is no time to get there."""
    dice = Random(seed)
    visitor = f'shape="pioneer" speed-m-s="{dice.uniform(0.3, 0.6):.2f}"'
    battery = f'battery-j="{dice.choice([8, 14, 20, 40, 80]) * dice.uniform(0.8, 1.2):.1f}"'
    y_m = dice.choice(["3.6", "4", "4.4"])
    text = EXAMPLE.read_text().replace('type="simulated_world"', f'type="simulated_world" seed="{seed}"')
    text = text.replace('shape="pioneer" speed-m-s="0.4"', visitor).replace('battery-j="40"', battery)
    text = text.replace('y-m="4"/>', f'y-m="{y_m}"/>')
    if dice.random() < 0.25:
        text = text.replace('<parameter name="within_s" value="60"/>', '<parameter name="within_s" value="3"/>', 1)
    if dice.random() < 0.25:
        text = re.sub(r'(name="return-home".*?within_s" value=")60', r"\g<1>2", text, flags=re.DOTALL)
    file = folder / f"night-{seed}.xml"
    file.write_text(text)
    return read_mission(file)


class Ends:
    """How behaviors ended: name → final statuses, in order."""

    def __init__(self, running: RunningMission) -> None:
        self.of: dict[str, list[BehaviorStatus]] = {}
        running.bus.subscribe("mission_control/*", Conversation.LOG, StoryEvent, lambda heard: self._hear(heard.body))

    def _hear(self, event: StoryEvent) -> None:
        if event.what.startswith("finished: "):
            self.of.setdefault(event.subject, []).append(BehaviorStatus(event.what.removeprefix("finished: ")))


def wanted(node: BehaviorNode, ends: Ends) -> BehaviorStatus | None:
    """Return what the node's children make of it, by the meaning of its type alone; None: it does not finish."""
    if not node.children:
        return next(iter(ends.of.get(node.name, [])), None)
    below = [wanted(child, ends) for child in node.children]
    match node.type:
        case "sequence":
            return next((one for one in below if one is not SUCCESS), SUCCESS)
        case "fallback":
            return next((one for one in below if one is not FAILURE), FAILURE)
        case "parallel" if SUCCESS in below:
            return SUCCESS
        case "timeout":
            return below[0] or FAILURE
    return None


def nodes(node: BehaviorNode) -> list[BehaviorNode]:
    return [node, *(one for child in node.children for one in nodes(child))]


def play(seed: int, folder: Path) -> str:
    """Play one night, and return the leaf by which it ended."""
    mission = drawn(seed, folder)
    root = next(one for one in mission.behaviors if one.name == ROOT)
    by = ""

    async def night() -> None:
        nonlocal by
        async with at_work(mission) as running:
            ends, home = Ends(running), await pose(running, "scout2")
            while True:
                state = await running.bus.ask(f"mission_control/{ROOT}", AskBehavior(), BehaviorState, within_s=1.0)
                if state.status.is_final:
                    break
                assert running.clock.now_s() < MOST_S, state.tree
                await running.clock.sleep_s(0.5)
            there = await pose(running, "scout2")
        assert state.status is wanted(root, ends), (ends.of, state.tree)
        for node in nodes(root):
            assert len(ends.of.get(node.name, [])) <= 1, "nothing runs twice in this tree"
            if node.name in ends.of:
                assert ends.of[node.name] == [wanted(node, ends)], (node.name, ends.of)
        by = next(name for name in ("timeout", "return-home", "wait") if ends.of.get(name))
        if ends.of.get("return-home") == [SUCCESS]:
            assert math.dist((there.x_m, there.y_m), (home.x_m, home.y_m)) < NEAR_M, "it is home"
        if by == "wait":
            assert math.dist((there.x_m, there.y_m), (2.5, 2.2)) < NEAR_M, "it is where motion was seen"

    run_virtual(night())
    return by


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(3))
def test_a_night_ends_as_its_tree_says(seed: int, tmp_path: Path) -> None:
    play(seed, tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_hundred_nights_end_as_their_tree_says_in_every_way_there_is(tmp_path: Path) -> None:
    ended = [play(seed, tmp_path) for seed in range(100)]
    counts = {by: ended.count(by) for by in sorted(set(ended))}
    print(f"100 nights ended by: {counts}")
    assert set(counts) == {"timeout", "return-home", "wait"}
