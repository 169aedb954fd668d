"""The example of the how-to on message views runs, found as an installed package's views are."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from ui_console.model.key_view import KeyView
from ui_console.model.message_views import GROUP, installed_views

PAGE = Path(__file__).parents[3] / "docs/how-to/show-a-message-otherwise.md"


def test_the_example_shows_its_message_once_its_package_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = dict(re.findall(r"```(python|toml)\n(.*?)```", PAGE.read_text(), re.DOTALL))
    views = tomllib.loads(blocks["toml"])["project"]["entry-points"][GROUP]
    (name, target), *_ = views.items()
    about = tmp_path / "arms-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: arms\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\n{name} = {target}\nmissing = arms.nothing:VIEWS\n")
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms/__init__.py").write_text("")
    (tmp_path / "arms/views.py").write_text(blocks["python"])
    monkeypatch.syspath_prepend(tmp_path)
    installed_views.cache_clear()
    try:
        found = installed_views()
    finally:
        installed_views.cache_clear()
        for module in [one for one in sys.modules if one.partition(".")[0] == "arms"]:
            assert isinstance(sys.modules.pop(module), ModuleType)
    assert {"ArmTurned/1", "Frame/1"} <= found.keys(), "those of other packages stay"
    view = KeyView("ArmTurned/1", found)
    view.take({"turn_rad": 1.5707963267948966, "grip": "open"}, 1.0, 1)
    assert [(row.name, row.text) for row in view.rows] == [("turn", "90°"), ("grip", "open")]
    assert view.names() == ["turn"]
    view.take({"grip": "open"}, 2.0, 2)
    assert view.trouble.startswith("TurnView cannot show it")
