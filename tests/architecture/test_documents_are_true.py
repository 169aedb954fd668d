"""Links in the documents lead somewhere, and the names they speak of exist where they say."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
LINK = re.compile(r"\[(?P<text>[^\]]*)\]\((?P<target>[^)\s]+)\)")
NAME = re.compile(r"`([A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)?)`")


def links(document: Path) -> list[tuple[str, Path]]:
    """Return text and target of every link to a file of this project."""
    found = []
    for match in LINK.finditer(document.read_text()):
        target = match["target"].partition("#")[0]
        if target and "://" not in target and not target.startswith("mailto:"):
            found.append((match["text"], (document.parent / target).resolve()))
    return found


def anchors(document: Path) -> list[tuple[Path, str]]:
    """Return file and heading of every link to a heading of this project."""
    found = []
    for match in LINK.finditer(document.read_text()):
        target, _, anchor = match["target"].partition("#")
        if anchor and "://" not in target:
            found.append(((document.parent / target).resolve() if target else document, anchor))
    return found


def slugs(document: Path) -> set[str]:
    """Return the headings of a document as links spell them."""
    titles = re.findall(r"^#+ (.+)$", document.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def names_of(module: Path) -> set[str]:
    """Return functions, classes and ``Class.member`` defined at the top of a module."""
    names = set()
    for node in ast.parse(module.read_text()).body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                names.add(name)
            case ast.ClassDef(name=name, body=body):
                names.add(name)
                members = (n for n in body if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef))
                names |= {f"{name}.{member.name}" for member in members}
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                names.add(name)
    return names


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_leads_to_a_file_of_the_project(document: Path) -> None:
    missing = [str(target) for _, target in links(document) if not target.exists()]
    assert not missing


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_to_a_heading_leads_to_one(document: Path) -> None:
    assert [anchor for target, anchor in anchors(document) if anchor not in slugs(target)] == []


def test_every_page_is_listed_in_the_table_of_contents() -> None:
    contents = ROOT / "docs/README.md"
    listed = {target for _, target in links(contents)} | {contents}
    assert {page for page in (ROOT / "docs").rglob("*.md") if not page.is_relative_to(ROOT / "docs/examples")} <= listed


def test_the_questions_people_ask_first_are_answered_two_clicks_from_the_readme() -> None:
    assert (ROOT / "docs/README.md", "the-questions-people-ask-first") in anchors(ROOT / "README.md")
    section = (ROOT / "docs/README.md").read_text().partition("## The questions people ask first")[2]
    rows = [row for row in section.partition("\n## ")[0].splitlines() if "?" in row]
    answers = {(row.split("|")[1].strip()): [target for _, target in LINK.findall(row)] for row in rows}
    assert {question: [target.partition("#")[0] for target in targets] for question, targets in answers.items()} == {
        "How do I write an RC and its ARC?": ["how-to/add-a-device.md"] * 2,  # test_the_guide_to_devices.py plays it
        "Why does my request wait?": ["explanation/why-do-i-wait.md"],  # test_wait_examples.py plays it
        "What does this word mean?": ["reference/glossary.md"],  # test_glossary.py compares it
        "Where is the decision made?": ["tour.md"],  # the test of the tour below
        "How do I run one test?": ["../CONTRIBUTING.md"],  # the test below
    }


def test_the_command_that_runs_one_test_runs_one() -> None:
    section = (ROOT / "CONTRIBUTING.md").read_text().partition("## Run one test")[2]
    command = re.search(r"`\.venv/bin/pytest (?P<file>\S+\.py) -k (?P<word>\w+)`", section)
    assert command
    tests = re.findall(r"^def (test_\w+)", (ROOT / command["file"]).read_text(), re.MULTILINE)
    assert [name for name in tests if command["word"] in name]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_name_linked_to_a_module_is_defined_there(document: Path) -> None:
    missing = []
    for text, target in links(document):
        name = NAME.fullmatch(text)
        if name and target.suffix == ".py" and target.exists() and name[1] not in names_of(target):
            missing.append(f"{name[1]} in {target.relative_to(ROOT)}")
    assert not missing


def test_the_tour_is_short_and_follows_one_grant() -> None:
    stops = [target.name for _, target in links(ROOT / "docs" / "tour.md")]
    assert stops[0] == "mission.xml"
    assert len(set(stops)) <= 25
    order = ["reader.py", "arc_client.py", "schedule_manager.py", "service.py", "holds.py", "scout.py", "world.py"]
    assert [stops.index(name) for name in order] == sorted(stops.index(name) for name in order)
