"""No constructor of a component sets a private attribute that a base class set: each would overwrite the other's."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator

from backbone.component.class_path import load_class
from backbone.component.component import Component
from backbone.mission.shipped_types import shipped_types


def set_by(kind: type) -> set[str]:
    """Return the private attributes that the class's own constructor sets."""
    init = vars(kind).get("__init__")
    if not inspect.isfunction(init):
        return set()
    tree = ast.parse(textwrap.dedent(inspect.getsource(init)))
    stored = (one for one in ast.walk(tree) if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store))
    return {one.attr for one in stored if one.attr.startswith("_") and ast.unparse(one.value) == "self"}


def clashes(kind: type) -> Iterator[str]:
    """Yield each private attribute of the class that the constructor of a base class sets, too."""
    for base in kind.__mro__[1:]:
        yield from (f"{kind.__name__} and {base.__name__}: {name}" for name in sorted(set_by(kind) & set_by(base)))


class Overwriting(Component):  # type: ignore[type-arg]
    def __init__(self, *given: object) -> None:
        super().__init__(*given)  # type: ignore[arg-type]
        self._since_s = 0.0


def test_a_clash_is_found() -> None:
    assert [*clashes(Overwriting)] == ["Overwriting and Component: _since_s"]


def test_no_shipped_component_overwrites_an_attribute_of_its_base() -> None:
    paths = {one.text("class") for one in shipped_types()}
    assert "mission_control.behaviors.give:Give" in paths
    found = [clash for path in sorted(paths) for one in load_class(path).__mro__ for clash in clashes(one)]
    assert found == []
