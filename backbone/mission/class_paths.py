"""Checks whether a class path leads to a class, without running any of its code."""

from __future__ import annotations

import ast
import re
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path

from backbone.errors import complaint

CLASS_PATH = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")

_BROKEN = "its module cannot be imported"


def class_path_fault(class_path: str) -> tuple[str, list[str]] | None:
    """Return the fault of ``package.module:Class`` on this machine, and the names that exist instead.

    No module is imported; only its source is read. A module without source counts as correct.

    Returns:
        None if no fault is found.
    """
    module, _, name = class_path.partition(":")
    top, *below = module.split(".")
    spec, found, folders = _find_top(top), top, list[str]()
    for part in below:
        if spec is None:
            break
        found, folders = f"{found}.{part}", list(spec.submodule_search_locations or ())
        spec = PathFinder.find_spec(found, folders)
    if spec is None:
        return f"no module {found}", _modules(folders)
    if spec.origin is None or not spec.origin.endswith(".py"):
        return None
    source = Path(spec.origin).read_text("utf-8", errors="replace")
    if re.search(rf"\b{name}\b", source):
        return None
    try:
        ast.parse(source, spec.origin)
    except (SyntaxError, ValueError) as error:  # ValueError: it has a null character
        return f"{_BROKEN}: {complaint(error)}", []
    return f"no class {name} in {module}", re.findall(r"^class (\w+)", source, re.MULTILINE)


def class_path_remedy(class_path: str, fault: str) -> str:
    """Return the remedy for a fault that ``class_path_fault`` found."""
    if fault == f"no module {class_path.partition(':')[0].partition('.')[0]}":
        return "Correct the name, or put its folder on PYTHONPATH"
    return "Mend its module" if fault.startswith(_BROKEN) else "Write the class as package.module:Class"


def _find_top(name: str) -> ModuleSpec | None:
    try:
        return find_spec(name)
    except ValueError:  # a module that runs as a program has no spec
        return None


def _modules(folders: list[str]) -> list[str]:
    return sorted(file.stem for folder in folders for file in Path(folder).glob("*.py") if file.stem != "__init__")
