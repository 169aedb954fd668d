"""A state is handed over to the present version of its classes, or not at all."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from backbone.handed_state import NotConverted, copy_for
from backbone.reading_anew import ReadAnew

SOURCE = """
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class Mark:
    number: int

    def told(self):
        return f"first {self.number}"


@dataclass
class Marks:
    newest: Mark
    all: list
    at: dict

    class Kind(Enum):
        SMALL = "small"


class Place(NamedTuple):
    x_m: float

    def told(self):
        return "first place"


class Search:
    def told(self):
        return "first search"


def chosen():
    return "first"


def local():
    class Hidden:
        def told(self):
            return "first hidden"
    return Hidden()


class Part:
    def act(self):
        return Mark(1)
"""


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., ModuleType]]:
    """Write the file, with this edit, and give its module as it is imported or read anew."""
    name = "state_of_a_part"
    monkeypatch.syspath_prepend(tmp_path)

    def edit(old: str = "", new: str = "") -> ModuleType:
        (tmp_path / f"{name}.py").write_text(SOURCE.replace(old, new) if old else SOURCE)
        ReadAnew(f"{name}:Part", lambda _path: __import__(name).Part)
        return sys.modules[name]

    yield edit
    sys.modules.pop(name, None)


def test_each_object_gets_the_present_class_and_what_is_shared_stays_shared(edited: Any) -> None:
    old = edited()
    mark = old.Mark(7)
    marks = old.Marks(mark, [mark, old.Place(1.5)], {mark: {old.Marks.Kind.SMALL, old.Mark}, "by": old.chosen})
    new = edited("first", "second")
    copied: Any = copy_for(new.Part, {"marks": marks, "same": mark})
    mine = copied["marks"]
    assert type(mine) is new.Marks
    assert (mine.newest.told(), mine.all[1].told(), mine.at["by"]()) == ("second 7", "second place", "second")
    assert mine.at[mine.newest] == {new.Marks.Kind.SMALL, new.Mark}
    assert mine.newest is mine.all[0] is copied["same"]
    assert mark.told() == "first 7", "the old one may come back"


@pytest.mark.parametrize(
    ("made", "old", "new", "cause"),
    [
        ("Mark(7)", "number: int", "number: int\n    weight: float = 0.0", "Mark declares other fields than before"),
        ("Mark(7)", "number: int", "number: float", "Mark declares other fields than before"),
        ("Place(1.5)", "x_m: float", "x_m: int", "Place declares other fields than before"),
        ("Place(1.5)", "class Place(", "class Spot(", "Place is no longer in its file"),
        ("Search()", "first", "second", "Search was read anew and declares no fields"),
        ("local()", "first", "second", r"local.<locals>.Hidden is no longer in its file"),
    ],
)
def test_what_cannot_be_converted_is_refused_and_named(edited: Any, made: str, old: str, new: str, cause: str) -> None:
    value = eval(f"module.{made}", {"module": edited()})  # noqa: S307  an example of this file
    part = edited(old, new).Part
    with pytest.raises(NotConverted, match=cause):
        copy_for(part, {"value": [value]})


def test_a_file_that_was_not_read_anew_changes_no_class(edited: Any) -> None:
    module = edited()
    values = {"search": module.Search(), "hidden": module.local(), "by": lambda: 3}
    copied: Any = copy_for(module.Part, values)
    assert type(copied["search"]) is module.Search
    assert type(copied["hidden"]) is type(values["hidden"])
    assert copied["search"] is not values["search"]
    assert copied["by"] is values["by"]


@pytest.mark.parametrize("derived", [False, True])
def test_the_end_of_another_exchange_of_the_file_changes_no_class(edited: Any, derived: bool) -> None:
    old = edited()
    new = edited("first", "second")
    kind = type("Derived", (new.Part,), {}) if derived else new.Part
    sys.modules[old.__name__] = old  # as the failure of an exchange that began earlier does
    copied: Any = copy_for(kind, {"mark": old.Mark(7), "by": old.chosen})
    assert (copied["mark"].told(), copied["by"]()) == ("second 7", "second")
