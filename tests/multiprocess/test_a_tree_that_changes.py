"""The behavior tree of a running mission is changed by commands, and its processes follow."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from running_mission import MISSION_XML, RunningMission, mission_up
from tutorial_commands import run_all

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

COMPOSED = MISSION_XML.parent / "docs" / "examples" / "composed.xml"
GUIDE = MISSION_XML.parent / "docs" / "how-to" / "change-a-running-mission.md"
WITHOUT_END = {
    '<parameter name="seconds" value="60"/>': '<parameter name="seconds" value="86400"/>',
    '<parameter name="rounds" value="2"/>': '<parameter name="rounds" value="0"/>',
}
LEAF = '<behavior type="surveillance" name="leaf" priority="2"/>'
WITHIN_S = 60.0


class Operator:
    """Types commands about the tree of one mission."""

    def __init__(self, mission: RunningMission, folder: Path) -> None:
        self.mission, self.folder = mission, folder

    def tree(self, *words: str, refused: str = "") -> str:
        """Run ``scout-backbone tree``; return what it prints, or says if it is refused."""
        done = self.mission.command("scout-backbone", "tree", *words, "--mission", self.mission.name)
        expected = 5 if refused else 0
        assert done.returncode == expected, done.stdout + done.stderr + self.mission.story()
        assert refused in done.stderr
        return done.stdout or done.stderr

    def branch(self, name: str, kind: str = "wait", inside: str = '<parameter name="seconds" value="600"/>') -> str:
        """Write a branch to a file and return the file's name."""
        file = self.folder / f"{name}.xml"
        file.write_text(f'<behavior type="{kind}" name="{name}" priority="1">\n  {inside}\n</behavior>\n')
        return str(file)

    def pids(self) -> dict[str, int]:
        """Return the process of each behavior of the tree that runs."""
        return {one["name"]: one["pid"] for one in walk(json.loads(self.tree("--json"))["tree"]) if one["pid"]}

    def shown(self, name: str) -> dict[str, Any]:
        """Return the parameters of a behavior that runs."""
        done = self.mission.command("scout-backbone", "set", name, "--json", "--mission", self.mission.name)
        assert done.returncode == 0, done.stderr + self.mission.story()
        parameters: dict[str, Any] = json.loads(done.stdout)["parameters"]
        return parameters

    def wait(self, what: str, holds: Callable[[dict[str, int]], bool]) -> dict[str, int]:
        """Return the processes as soon as they fulfil the condition."""
        deadline = time.monotonic() + WITHIN_S
        while not holds(pids := self.pids()):
            assert time.monotonic() < deadline, f"not within {WITHIN_S} s: {what}: {pids}\n{self.mission.story()}"
        return pids

    def kill(self, name: str) -> None:
        """SIGKILL a component, and return when its next life is there."""
        pid = self.mission.component(name)["pid"]
        os.kill(pid, signal.SIGKILL)
        deadline = time.monotonic() + WITHIN_S
        while not any(
            one["name"] == name and one["pid"] != pid and one["state"] == "ready"
            for one in self.mission.status()["components"]
        ):
            assert time.monotonic() < deadline, f"{name} does not come back\n{self.mission.story()}"


def walk(tree: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for one in tree:
        yield one
        yield from walk(one["children"])


@pytest.fixture
def operator(tmp_path: Path) -> Iterator[Operator]:
    with mission_up(mission_xml=COMPOSED, change=WITHOUT_END) as mission:
        found = Operator(mission, tmp_path)
        found.wait("the patrol runs", lambda pids: "patrol" in pids)
        yield found


@pytest.mark.thorough
def test_what_is_added_and_removed_follows_and_what_stays_keeps_its_process(operator: Operator, tmp_path: Path) -> None:
    before = operator.pids()
    operator.tree("add", operator.branch("spare"))
    operator.tree("add", operator.branch("moment2"), "--below", "look-around", "--place", "2")
    operator.tree("add", operator.branch("both", "parallel", LEAF))
    operator.tree("set", "patrol", "speed_m_s", "0.1")
    operator.tree("set", "patrol", "minimum_runtime_s", "6")
    operator.tree("set", "patrol", "priority", "-4")
    operator.tree("remove", "end-of-day")
    after = operator.wait("what is new runs", lambda pids: {"spare", "both", "leaf"} <= pids.keys())
    assert {name: after[name] for name in before} == before
    operator.tree("remove", "both")
    assert operator.pids().keys() == {*before, "spare"}

    operator.kill("look-around")  # a parent whose children were changed
    operator.kill("outing")  # its parent
    operator.kill("placer")
    operator.kill("rc_manager")
    again = operator.wait("all is back", lambda pids: pids.keys() == {*before, "spare"})
    assert {name for name in before if again[name] != before[name]} == {"look-around", "outing"}
    children = [child["name"] for child in operator.shown("look-around")["children"]]
    assert children == ["one-minute", "moment2", "a-moment"]

    operator.kill("patrol")
    patrol = operator.shown("patrol")
    assert (patrol["speed_m_s"], patrol["path"][-1]) == (0.1, ["patrol", -4])

    saved = tmp_path / "saved.xml"
    operator.tree("save", str(saved))
    assert "<!-- Two rounds, but no longer than a minute." in saved.read_text()
    check = operator.mission.command("scout-backbone", "check", str(saved))
    assert check.returncode == 0, check.stdout
    words = ("scout-backbone", "log", "--text", "behavior tree", "--mission", operator.mission.name)
    log = operator.mission.command(*words)
    assert "end-of-day" in log.stdout
    assert operator.mission.down() == 0
    with mission_up(mission_xml=saved) as mission:
        second = Operator(mission, tmp_path)
        second.wait("the saved tree runs", lambda pids: {"outing", "spare", "patrol"} <= pids.keys())


@pytest.mark.thorough
def test_a_branch_is_moved_and_replaced(operator: Operator) -> None:
    before = operator.pids()
    operator.tree("add", operator.branch("spare"))
    first = operator.wait("it runs", lambda pids: "spare" in pids)
    operator.tree("move", "spare", operator.mission.name, "1")
    assert operator.pids() == first, "another place below the same parent interrupts nothing"
    operator.tree("add", operator.branch("both", "parallel", LEAF))
    operator.tree("move", "spare", "both")
    moved = operator.wait("it runs there", lambda pids: pids.get("spare", first["spare"]) != first["spare"])
    operator.wait("all of it", lambda pids: "leaf" in pids)
    assert [step[0] for step in operator.shown("spare")["path"]] == [operator.mission.name, "both", "spare"]
    operator.tree("replace", "spare", operator.branch("spare", "surveillance", "<!-- another one -->"))
    operator.wait("another one runs", lambda pids: pids.get("spare", moved["spare"]) != moved["spare"])
    assert operator.mission.component("spare")["type"] == "surveillance"
    operator.tree("replace", "both", operator.branch("other"))
    after = operator.wait("the other runs", lambda pids: "other" in pids)
    assert after.keys() == {*before, "other"}
    assert {name: after[name] for name in before} == before


@pytest.mark.thorough
def test_a_refused_change_changes_nothing(operator: Operator) -> None:
    before, tree = operator.pids(), operator.tree("--json")
    bad = operator.branch("bad", "wait", '<parameter name="secondz" value="1"/>')
    assert f"{bad}:2:" in operator.tree("add", bad, refused="tree.invalid")
    operator.tree("add", operator.branch("patrol"), refused="a second behavior 'patrol'")
    operator.tree("add", operator.branch("x", "nothing"), refused="nothing")
    operator.tree("add", operator.branch("x"), "--below", "one-minute", refused="exactly one")
    operator.tree("remove", "patrol", refused="exactly one")
    operator.tree("remove", "patrul", refused="did you mean 'patrol'")
    operator.tree("move", "outing", "patrol", refused="cannot be moved into itself")
    operator.tree("set", "patrol", "speed_m_s", "7", refused="speed_m_s")
    operator.tree("set", "patrol", "priority", "high", refused="priority")
    operator.tree("set", "patrol", "minimum_runtime_s", "-1", refused="minimum-runtime-s")
    operator.tree("remove", "a-moment", "--seen", "7", refused="tree.changed_meanwhile")
    after = operator.tree("--json")
    assert json.loads(after)["version"] == json.loads(tree)["version"] == 0
    assert operator.pids() == before


@pytest.mark.thorough
def test_the_guides_commands_print_what_it_says(tmp_path: Path) -> None:
    (tmp_path / "composed.xml").write_text(COMPOSED.read_text())
    for name, text in re.findall(r"^`([\w.-]+)`:\n\n```xml\n(.*?)^```", GUIDE.read_text(), re.M | re.S):
        (tmp_path / name).write_text(text)
    run_all(GUIDE, tmp_path)


@pytest.mark.thorough
def test_without_the_missions_secret_nobody_changes_its_tree(operator: Operator, tmp_path: Path) -> None:
    wrong = tmp_path / "secret"
    wrong.write_text("0" * 64)
    wrong.chmod(0o600)
    words = ["scout-backbone", "tree", "remove", "a-moment", "--mission", operator.mission.name]
    words += ["--connect", operator.mission.endpoint, "--secret-file", str(wrong)]
    done = operator.mission.command(*words)
    assert done.returncode == 4, done.stdout + done.stderr
    assert json.loads(operator.tree("--json"))["version"] == 0
