"""The refusal of a class that cannot be imported: its path or its file is named, whichever is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from backbone.component.class_path import WrongClassPath, load_class
from backbone.errors import Refusal
from backbone.scheduling.own_planner import WrongPlanner, load_planner
from mission_control.modules.orders import WrongModule, load_at
from resource_pool.drivers.interface import UnknownDriver, driver_class

LOADERS: list[tuple[Callable[[str], object], type[Refusal]]] = [
    (load_class, WrongClassPath),
    (load_planner, WrongPlanner),
    (load_at, WrongModule),
    (lambda path: driver_class(path, "radio"), UnknownDriver),
]


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "wants_a_library.py").write_text("\nimport no_such_library\n")
    (tmp_path / "wants_an_attribute.py").write_text("\nimport math\n\nmath.no_such_attribute\n")
    (tmp_path / "is_empty.py").write_text("")
    return tmp_path


@pytest.mark.parametrize(("load", "kind"), LOADERS)
@pytest.mark.parametrize(("module", "line"), [("wants_a_library", 2), ("wants_an_attribute", 4)])
def test_a_file_that_cannot_be_imported_is_named_with_its_line(
    files: Path, load: Callable[[str], object], kind: type[Refusal], module: str, line: int
) -> None:
    with pytest.raises(kind) as refused:
        load(f"{module}:Own")
    assert f"({files / f'{module}.py'}, line {line})" in refused.value.detail
    assert "file" in refused.value.remedy
    assert refused.value.facts["class_path"] == f"{module}:Own"


@pytest.mark.parametrize(("load", "kind"), LOADERS)
@pytest.mark.parametrize("path", ["nowhere_at_all:Own", "is_empty:Own", "is_empty.below:Own"])
def test_a_path_that_leads_nowhere_is_to_be_corrected(
    load: Callable[[str], object], kind: type[Refusal], path: str
) -> None:
    with pytest.raises(kind) as refused:
        load(path)
    assert refused.value.remedy == kind.remedy


@pytest.mark.parametrize(("load", "kind"), LOADERS)
@pytest.mark.parametrize("text", ["{}", "{}:", ":{}", "{}:2nd", "{}:Own.", "{}:Own:Own", "../{}:Own", "{} :Own"])
def test_a_text_that_is_no_path_is_refused_and_imports_nothing(
    files: Path, load: Callable[[str], object], kind: type[Refusal], text: str
) -> None:
    (files / "says_that_it_is_imported.py").write_text("raise SystemExit('imported')")
    path = text.format("says_that_it_is_imported")
    with pytest.raises(kind, match=r"no path as package\.module:Class") as refused:
        load(path)
    assert path in refused.value.detail
