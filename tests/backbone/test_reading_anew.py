"""A file that is read anew: what imports find afterwards, and after an undo."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from backbone.reading_anew import ReadAnew, ValuesChanged, WrongClass, read_anew
from mission_control.modules.module import Module
from mission_control.modules.orders import load_module_class

PATH = "read_anew_package.inside:One"
SOURCE = """
from __future__ import annotations
from enum import Enum
import msgspec
from mission_control.modules.module import Module


class Color(Enum):
    RED = "red"


class Spot(msgspec.Struct):
    color: Color = Color.RED
    sizes: list[int] = []


class One(Module):
    class Outputs(Module.Outputs):
        spot: Spot

    def update(self, inputs):
        return self.Outputs(Spot(Color.RED, [EDITION]))


EDITION = 1
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "read_anew_package"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "inside.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path)
    yield folder / "inside.py"
    for name in [name for name in sys.modules if name.startswith("read_anew_package")]:
        del sys.modules[name]


def test_what_was_never_imported_is_imported_and_after_an_undo_it_is_not(file: Path) -> None:
    read = ReadAnew(PATH, load_module_class)
    assert read.kind.__name__ == "One"
    read.undo()
    assert "read_anew_package.inside" not in sys.modules


def test_an_old_class_keeps_its_code_and_the_new_one_has_its_own(file: Path) -> None:
    old = ReadAnew(PATH, load_module_class).kind
    file.write_text(SOURCE.replace("EDITION = 1", "EDITION = 2"))
    read = ReadAnew(PATH, load_module_class)
    spots = [kind().update(kind.Inputs()).spot for kind in (old, read.kind)]
    assert [one.sizes for one in spots] == [[1], [2]]
    assert type(spots[0]) is type(spots[1]), "classes of values stay those that run"
    assert spots[0].color is spots[1].color
    assert sys.modules["read_anew_package"].inside.One is read.kind
    read.undo()
    assert sys.modules["read_anew_package"].inside.One is old
    assert sys.modules["read_anew_package.inside"].One is old


@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ('RED = "red"', 'RED = "rot"', "Color, Spot"),
        ("sizes: list[int] = []", "sizes: list[float] = []", "Spot"),
        ("class Spot(msgspec.Struct)", "class Spot(msgspec.Struct, frozen=True)", "Spot"),
        ("    sizes: list[int] = []\n", "", "Spot"),
    ],
)
def test_a_class_of_values_that_is_declared_differently_is_refused(file: Path, old: str, new: str, name: str) -> None:
    before = ReadAnew(PATH, load_module_class).kind
    file.write_text(SOURCE.replace(old, new).replace("[EDITION]", ""))
    with pytest.raises(ValuesChanged, match=f"declares {name} differently"):
        ReadAnew(PATH, load_module_class)
    assert sys.modules["read_anew_package.inside"].One is before


def test_what_has_no_file_is_refused() -> None:
    with pytest.raises(WrongClass, match="no file that can be read anew"):
        ReadAnew("sys:One", load_module_class)


def test_a_file_whose_import_never_ends_is_refused_and_found_as_before(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("backbone.reading_anew.READ_WITHIN_S", 0.2)
    threads = set(threading.enumerate())
    before = ReadAnew(PATH, load_module_class).kind
    file.write_text(SOURCE + "import sys, threading\nsys.never_set = threading.Event()\nsys.never_set.wait()\n")
    with pytest.raises(WrongClass, match=r"has not ended within 0\.2 s"):
        asyncio.run(read_anew(PATH, load_module_class))
    assert sys.modules["read_anew_package.inside"].One is before
    file.write_text(SOURCE.replace("EDITION = 1", "EDITION = 2"))
    assert asyncio.run(read_anew(PATH, load_module_class)).kind is not before
    sys.never_set.set()  # type: ignore[attr-defined]
    for thread in set(threading.enumerate()) - threads:
        thread.join()


def test_two_classes_of_one_file_that_are_read_at_once_are_both_of_the_present_file(file: Path) -> None:
    ReadAnew(PATH, load_module_class)
    text = SOURCE.replace("EDITION = 1", "class Two(One):\n    pass\n\n\nEDITION = 2")
    file.write_text(text.replace("import msgspec", "import msgspec, time\ntime.sleep(0.2)  # as a large library takes"))

    async def both() -> list[ReadAnew[type[Module]]]:
        paths = PATH, PATH.replace("One", "Two")
        return await asyncio.gather(*(read_anew(path, load_module_class) for path in paths))

    read = asyncio.run(both())
    assert [one.kind.__name__ for one in read] == ["One", "Two"]
    assert [one.kind().update(None).spot.sizes for one in read] == [[2], [2]]
