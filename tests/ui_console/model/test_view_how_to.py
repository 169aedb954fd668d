"""The example of the how-to on message views runs, found as an installed package's views are."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from ui_console.model.key_view import KeyView
from ui_console.model.message_views import GROUP, VIEWS, FieldRow, MessageView, Views, installed_views

PAGE = Path(__file__).parents[3] / "docs/how-to/show-a-message-otherwise.md"


def install(folder: Path, name: str, entry_points: str) -> None:
    """Write what pip leaves of an installed package."""
    about = folder / f"{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\n{entry_points}\n")


def views_with(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Views:
    """Return the views that are installed with the packages in this folder; their modules are forgotten again."""
    monkeypatch.syspath_prepend(folder)
    installed_views.cache_clear()
    try:
        return installed_views()
    finally:
        installed_views.cache_clear()
        own = [name for name, module in sys.modules.items() if str(folder) in str(getattr(module, "__file__", ""))]
        for name in own:
            del sys.modules[name]


def test_the_example_shows_its_message_once_its_package_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = dict(re.findall(r"```(python|toml)\n(.*?)```", PAGE.read_text(), re.DOTALL))
    views = tomllib.loads(blocks["toml"])["project"]["entry-points"][GROUP]
    (name, target), *_ = views.items()
    install(tmp_path, "arms", f"{name} = {target}\nmissing = arms.nothing:VIEWS")
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms/__init__.py").write_text("")
    (tmp_path / "arms/views.py").write_text(blocks["python"])
    found = views_with(tmp_path, monkeypatch)
    assert {"ArmTurned/1", "Frame/1"} <= found.keys(), "those of other packages stay"
    view = KeyView("ArmTurned/1", found)
    view.take({"turn_rad": 1.5707963267948966, "grip": "open"}, 1.0, 1)
    assert [(row.name, row.text) for row in view.rows] == [("turn", "90°"), ("grip", "open")]
    assert [row.name for row in view.rows if view.series(row.name)] == ["turn"]
    view.take({"grip": "open"}, 2.0, 2)
    assert view.trouble.startswith("TurnView cannot show it")


@pytest.mark.parametrize(
    "text",
    [
        "VIEWS = {",
        "raise RuntimeError('no library')",
        "raise SystemExit('run me as a program')",
        "VIEWS = [1]",
        "class VIEWS: ...",
        "VIEWS = {'A/1': int}",
        "class Wide:\n    def __init__(self, width): ...\nVIEWS = {'A/1': Wide}",
        "from ui_console.model.message_views import MessageView\nVIEWS = {'A': MessageView}",
    ],
)
def test_a_package_with_a_fault_in_its_views_is_left_out_and_named(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    install(tmp_path, "faulty", "faulty = faulty_views:VIEWS")
    (tmp_path / "faulty_views.py").write_text(text)
    assert VIEWS.items() <= views_with(tmp_path, monkeypatch).items()
    assert "the views of faulty are left out" in caplog.text


def test_of_two_packages_with_a_view_of_one_schema_the_first_counts_and_the_other_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Which of them was shown depended on the order of folders, and nothing named the other."""
    one = "from ui_console.model.message_views import MessageView\nclass Own(MessageView): ...\n"
    for name in ("zebra", "ant"):
        install(tmp_path, name, f"{name} = {name}_views:VIEWS")
        (tmp_path / f"{name}_views.py").write_text(f"{one}VIEWS = {{'Turned/1': Own, 'Frame/1': Own}}")
    found = views_with(tmp_path, monkeypatch)
    assert {found[schema].__module__ for schema in ("Turned/1", "Frame/1")} == {"ant_views"}
    assert "zebra has a view of Turned/1, too; that of ant is shown" in caplog.text


class Rowless(MessageView):
    def rows(self, fields: object) -> Any:
        return None


class Textless(MessageView):
    def rows(self, fields: object) -> Any:
        return [FieldRow("turn", 90)]  # type: ignore[arg-type]


class Pictureless(MessageView):
    def picture(self, fields: object) -> Any:
        return "a picture"


class Raising(MessageView):
    def rows(self, fields: object) -> Any:
        raise RuntimeError("no library")


class Ugly(Exception):
    def __str__(self) -> str:
        raise LookupError


class Unspeakable(MessageView):
    def rows(self, fields: object) -> Any:
        raise Ugly


class Leaving(MessageView):
    def rows(self, fields: object) -> Any:
        raise SystemExit


@pytest.mark.parametrize("kind", [Rowless, Textless, Pictureless, Raising, Unspeakable, Leaving])
def test_a_view_that_returns_no_rows_or_picture_leaves_the_table_and_says_so(kind: type[MessageView]) -> None:
    view = KeyView("Turned/1", {"Turned/1": kind})
    view.take({"turn": 1.5}, 1.0, 1)
    assert [(row.name, row.text) for row in view.rows] == [("turn", "1.5")]
    assert view.picture is None
    assert view.trouble.startswith(f"{kind.__name__} cannot show it")
