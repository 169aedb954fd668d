"""The table of stops has a place for every screen, dialog and control that the consoles' own code has."""

from __future__ import annotations

import ast
import re
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType

import pytest
from web_browser import SIZES

from ui_console.terminal import keys
from ui_console.terminal.tables import PanelName

HERE = Path(__file__)
BENCH = HERE.parents[2] / "bench"
TERMINAL = HERE.parents[2] / "ui_console" / "terminal"
PAGE = HERE.parents[2] / "ui_console" / "web" / "page"


@pytest.fixture
def places(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCH))
    import stops_places

    return stops_places


def openers() -> set[str]:
    """Return the methods of the terminal console that open a dialog; nothing in a recording can be stopped."""
    found = set()
    for file in {*TERMINAL.glob("*.py")} - {TERMINAL / "recorded_app.py"}:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                called = {one.func.attr for one in ast.walk(node) if isinstance(one, ast.Call) and _is_own(one.func)}
                found |= {node.name} if "_open" in called else set()
    return found


def _is_own(function: ast.expr) -> bool:
    return isinstance(function, ast.Attribute) and ast.unparse(function.value) == "self"


def action(of: str) -> str:
    """Return the action that leads to a place of the terminal console."""
    return "panel" if of.startswith("panel:") else of.removeprefix("action_").removeprefix("_")


def test_every_table_of_the_terminal_has_a_place(places: ModuleType) -> None:
    assert list(places.TABLES) == [str(name) for name in PanelName]


def test_every_dialog_of_the_terminal_has_a_place(places: ModuleType) -> None:
    shown = {place.of for place in places.TERMINAL if not place.of.startswith("panel:")}
    assert shown - {"action_bare"} == openers()


@pytest.mark.parametrize("profile", [keys.Profile.MONITOR, keys.Profile.PENDANT])
def test_every_profile_has_the_places_that_its_keys_lead_to(places: ModuleType, profile: keys.Profile) -> None:
    own = {place.of for place in getattr(places, profile.name)} - {"screen"}
    assert own == {place.of for place in places.TERMINAL if keys.has(profile, action(place.of))}


def test_every_profile_and_every_size_of_the_page_is_a_console_of_the_table(places: ModuleType) -> None:
    assert {str(profile) for profile in keys.Profile} <= places.KINDS.keys()
    assert {f"page {size}" for size in SIZES} <= places.KINDS.keys()


class Controls(HTMLParser):
    """Finds the controls that can have the focus; a control without an id has the name of its parent.

    Those that play a recording are none of these: the page of a mission does not show them, and nothing in a recording
    can be stopped.
    """

    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()
        self._around: list[str] = []
        self._plays = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self._plays = self._plays or given.get("id") == "playback"
        if self._plays:
            return
        if tag in ("form", "dialog") and "id" in given:
            self._around.append(f"#{given['id']}")
            self.found |= {f"#{given['id']}"} if tag == "dialog" else set()
        elif (tag in ("button", "input", "select", "textarea", "a") or "tabindex" in given) and not self._in_a_dialog:
            around = self._around[-1] if self._around else ""
            named = f"{around} [name={given['name']}]" if "name" in given else f"{around} [type={given.get('type')}]"
            self.found.add(f"#{given['id']}" if "id" in given else named)

    def handle_endtag(self, tag: str) -> None:
        self._plays = self._plays and tag != "section"
        if tag in ("form", "dialog") and self._around and (tag == "dialog" or not self._in_a_dialog):
            self._around.pop()

    @property
    def _in_a_dialog(self) -> bool:
        return "#reading" in self._around


def test_every_control_and_dialog_of_the_page_has_a_place(places: ModuleType) -> None:
    page = Controls()
    page.feed((PAGE / "index.html").read_text())
    drawn = {"#alarm-bar", "#commands"}  # their buttons come and go
    assert page.found == {place.of for place in places.PAGE if place.of.startswith("#")} - drawn
    assert drawn <= {place.of for place in places.PAGE}


def test_every_table_of_the_page_has_a_place(places: ModuleType) -> None:
    told = re.search(r"const NAMES = \[(.*?)\]", (PAGE / "tables.js").read_text(), re.DOTALL)
    assert told is not None
    names = re.findall(r'"(\w+)"', told[1])
    assert sorted(names) == sorted(place.of.removeprefix("tab:") for place in places.PAGE if place.of[:4] == "tab:")


def test_every_button_of_a_robots_card_has_a_place(places: ModuleType) -> None:
    told = (PAGE / "cards.js").read_text()
    buttons = set(re.findall(r'this\.button\("[^"]*", "(\w+)"\)', told)) | {"lift"}
    assert buttons == places.CARD.keys() == {place.of for place in places.PAGE if place.of in places.CARD}


def test_every_console_has_cells_with_and_without_a_link_for_one_robot_and_for_all(places: ModuleType) -> None:
    for console in places.KINDS:
        cells = places.cells(console)
        found = {(cell.link, cell.gesture.is_for_all) for cell in cells if cell.link is not places.Link.UP}
        assert found == {(link, is_all) for link in places.Link for is_all in (False, True) if link != "up"}
        assert len({(cell.place, cell.gesture, cell.link) for cell in cells}) == len(cells)
