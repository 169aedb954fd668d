"""Checks the import contracts of pyproject.toml with nothing but the standard library.

Looks at direct imports only; ``lint-imports`` (development extra) follows chains as well. Both read
the same contracts.
"""

from __future__ import annotations

import ast
import contextlib
import gc
import graphlib
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

Import = tuple[str, str]


def modules(top: Path, packages: list[str]) -> dict[str, Path]:
    """Return the file of each module of the packages under ``top``."""
    found = {}
    for package in packages:
        for file in (top / package).rglob("*.py"):
            parts = file.relative_to(top).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


@cache
def nodes(file: Path) -> list[ast.AST]:
    """Return all nodes of a file that no test changes."""
    return [*ast.walk(ast.parse(file.read_bytes(), str(file)))]


@contextlib.contextmanager
def kept_trees() -> Iterator[None]:
    """Keep parsed files to the end of the block; garbage collection would visit a million nodes again and again."""
    gc.disable()
    try:
        yield
    finally:
        nodes.cache_clear()
        gc.enable()


def imports(found: dict[str, Path], importers: Iterable[str]) -> set[Import]:
    """Return what these of the modules import, also inside functions and for types only."""
    edges = set()
    for name in importers:
        file = found[name]
        for node in nodes(file):
            match node:
                case ast.Import(names=names):
                    edges.update((name, alias.name) for alias in names)
                case ast.ImportFrom(module=str(base), names=names, level=0):
                    for alias in names:
                        submodule = f"{base}.{alias.name}"
                        edges.add((name, submodule if submodule in found else base))
                case ast.ImportFrom(level=level) if level:
                    raise ValueError(f"{file}: relative imports are not used here")
    return edges


def contracts(top: Path) -> tuple[list[str], list[dict[str, Any]]]:
    """Return the packages and the contracts of ``top``'s pyproject.toml."""
    settings = tomllib.loads((top / "pyproject.toml").read_text())["tool"]["importlinter"]
    return settings["root_packages"], settings["contracts"]


def broken(agreed: list[dict[str, Any]], edges: set[Import]) -> dict[str, list[Import]]:
    """Return for each broken contract, by id, the direct imports that break it."""
    wrong = {contract["id"]: sorted(_breaking(contract, edges)) for contract in agreed}
    return {name: found for name, found in wrong.items() if found}


def circle(edges: set[Import], room_of: Callable[[str], str]) -> list[str]:
    """Return one circle of rooms that import each other; none if there is none.

    Args:
        edges: Imports between modules.
        room_of: Module → its room.
    """
    graph: dict[str, set[str]] = {}
    for importer, imported in edges:
        if room_of(importer) != room_of(imported):
            graph.setdefault(room_of(importer), set()).add(room_of(imported))
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as found:
        return list(found.args[1])
    return []


def _breaking(contract: dict[str, Any], edges: set[Import]) -> Iterator[Import]:
    ignored = [tuple(map(_pattern, line.split(" -> "))) for line in contract.get("ignore_imports", [])]
    forbids = {"layers": _against_layers, "forbidden": _forbidden, "independence": _dependent}[contract["type"]]
    for importer, imported in edges:
        top_of_imported = imported.partition(".")[0]  # what is said of an external package holds for all in it
        named = [(importer, imported), (importer, top_of_imported)]
        if forbids(contract, importer, imported) and not any(
            by.fullmatch(who) and of.fullmatch(whom) for by, of in ignored for who, whom in named
        ):
            yield importer, imported


def _against_layers(contract: dict[str, Any], importer: str, imported: str) -> bool:
    layer = _layers(tuple(contract["layers"]))
    above, below = (next((room for room in layer if _within(module, [room])), "") for module in (importer, imported))
    return above != below and above in layer and below in layer and layer[above] >= layer[below]


@cache
def _layers(lines: tuple[str, ...]) -> dict[str, int]:
    """Return the number of each package's layer, the highest first."""
    return {package: number for number, line in enumerate(lines) for package in re.split(r"\s*[|:]\s*", line)}


def _forbidden(contract: dict[str, Any], importer: str, imported: str) -> bool:
    return _within(importer, contract["source_modules"]) and _within(imported, contract["forbidden_modules"])


def _dependent(contract: dict[str, Any], importer: str, imported: str) -> bool:
    siblings = contract["modules"]
    here = [package for package in siblings if _within(importer, [package])]
    there = [package for package in siblings if _within(imported, [package])]
    return bool(here and there and here != there)


def _within(module: str, packages: list[str]) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def _pattern(wildcard: str) -> re.Pattern[str]:
    """``*`` stands for one segment, ``**`` for one or more."""
    parts = {"*": r"[^.]+", "**": r"[^.]+(?:\.[^.]+)*"}
    return re.compile(r"\.".join(parts.get(part, re.escape(part)) for part in wildcard.strip().split(".")))
