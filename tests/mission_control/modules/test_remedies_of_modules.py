"""The remedy of a module that cannot be loaded fits the fault: its path, or its file."""

from __future__ import annotations

from pathlib import Path

import pytest

from mission_control.modules.orders import WrongModule, load_at

MEND, PATH = "Mend the file", "Write the class as package.module:Class, importable on the unit's host"


@pytest.mark.parametrize(
    ("class_path", "remedy"),
    [
        ("with_a_slip:Own", MEND),
        ("with_a_wish:Own", MEND),
        ("with_nothing:Own", PATH),
        ("nowhere_at_all:Own", PATH),
        ("with_nothing.below:Own", PATH),
    ],
)
def test_the_remedy_names_what_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, class_path: str, remedy: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "with_a_slip.py").write_text("class Own(object)\n    pass\n")
    (tmp_path / "with_a_wish.py").write_text("import no_such_library\n")
    (tmp_path / "with_nothing.py").write_text("")
    with pytest.raises(WrongModule) as refused:
        load_at(class_path)
    assert refused.value.remedy.startswith(remedy)
