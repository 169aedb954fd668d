"""Every example on the page about waiting, played; the answers are compared word by word."""

from __future__ import annotations

import re
from pathlib import Path as File
from typing import Any

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.picture.reasons import Reasons
from backbone.scheduling.events import CapacityChanged, Departed, Idled, RcCameBack, RcKnown, RcWentDown
from backbone.scheduling.requests import RcUse, RequestState
from backbone.scheduling.views import Why

PAGE = File(__file__).parents[3] / "docs" / "explanation" / "why-do-i-wait.md"
SECTION = re.compile(
    r"^## (?P<title>\d+\. .*?)\n.*?```text\n(?P<story>.*?)```\n"
    r".*?```console\n\$ why (?P<name>[\w-]+)\n(?P<answer>.*?)```",
    re.M | re.S,
)
HAND_OVER_S = 2.0
SECTIONS = {found["title"]: found for found in SECTION.finditer(PAGE.read_text(encoding="utf-8"))}

RC = re.compile(r"(unit|radio) (\w+)")
RULE = re.compile(r"(policy|discipline|aging_s|grid_s|exact_up_to) (\S+)")
ASKS = re.compile(r"([\d.]+) s +(\w+) asks for (.+), ([\d.]+) s, priority (\d+)")
HAPPENS = re.compile(r"([\d.]+) s +(\w+) (idles|departs|goes down|comes back|can give ([\d.]+))")
QUESTION = re.compile(r"([\d.]+) s +\?")


def played(title: str) -> tuple[Bench, Why]:
    """Play the story of a section until its question; return the bench and the answer."""
    rcs: list[RcKnown] = []
    rules: dict[str, Any] = {}
    happens: list[tuple[float, Any]] = []
    asked_s = 0.0
    for line in SECTIONS[title]["story"].splitlines():
        if found := RC.fullmatch(line):
            make = unit if found[1] == "unit" else sharable
            rcs.append(make(found[2], connect_s=0.3, disconnect_s=0.1))
        elif found := RULE.fullmatch(line):
            rules[found[1]] = found[2] if found[1] in ("policy", "discipline") else float(found[2])
        elif found := ASKS.fullmatch(line):
            uses = dict(_use(part) for part in found[3].split(" and "))
            happens.append((float(found[1]), ask(found[2], uses, priority=int(found[5]), run_s=float(found[4]))))
        elif found := HAPPENS.fullmatch(line):
            happens.append((float(found[1]), _event(found[2], found[3], found[4])))
        else:
            question = QUESTION.fullmatch(line)
            assert question is not None, f"{title}: {line!r} is no line this test can play"
            asked_s = float(question[1])
    bench = Bench(manager(grace_s=0.2, **rules), *rcs)
    for time_s, event in happens:
        bench.at(time_s, event)
    bench.run(asked_s)
    return bench, bench.answers.why(SECTIONS[title]["name"], asked_s)


def _use(words: str) -> tuple[str, RcUse]:
    rc, _, share = words.partition(" by ")
    return rc, load(float(share.rstrip("%")) / 100) if share else RcUse()


def _event(name: str, what: str, capacity: str | None) -> Any:
    match what:
        case "idles":
            return Idled(name)
        case "departs":
            return Departed(name)
        case "goes down":
            return RcWentDown(name)
        case "comes back":
            return RcCameBack(name, 0)
    assert capacity is not None
    return CapacityChanged(name, float(capacity))


def test_the_page_has_its_examples_in_order() -> None:
    assert [title.partition(".")[0] for title in SECTIONS] == [str(number) for number in range(1, len(SECTIONS) + 1)]
    assert len(SECTIONS) >= 8


@pytest.mark.parametrize("title", SECTIONS)
def test_the_answer_on_the_page_is_what_why_says(title: str) -> None:
    bench, why = played(title)
    assert "\n".join(Reasons(why.name, why, None, None).lines(bench.now_s)) == SECTIONS[title]["answer"].rstrip()


@pytest.mark.parametrize("title", SECTIONS)
def test_without_those_the_page_names_the_wait_is_over(title: str) -> None:
    bench, why = played(title)
    if why.state != RequestState.WAITING:
        return
    granted = len(bench.runs(why.name))
    for name in why.blockers:
        bench.tell(Departed(name))
    for view in bench.answers.schedule(bench.now_s).rcs:
        if view.state == "down":
            bench.tell(RcCameBack(view.rc, 0))
    bench.run(bench.now_s + HAND_OVER_S)
    assert len(bench.runs(why.name)) == granted + 1
