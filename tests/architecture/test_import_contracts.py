"""The walls between the packages stand, and whoever breaks one is found."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
import walls

TOP = Path(__file__).parents[2]
PACKAGES, CONTRACTS = walls.contracts(TOP)
MODULES = walls.modules(TOP, PACKAGES)

PLANTED = [
    ("layers", "backbone/planted.py", "import scout_model.description"),
    ("layers", "backbone/planted.py", "def late() -> None:\n    from resource_pool import arc_client"),
    ("layers", "resource_pool/planted.py", "from mission_control import behaviors"),
    ("layers", "scout_model/planted.py", "import backbone.wire"),
    ("layers", "ui_console/planted.py", "import mission_control.behaviors"),
    ("one-door", "mission_control/behaviors/planted.py", "from resource_pool import messages"),
    ("one-door", "mission_control/vision/planted.py", "import resource_pool.rcs"),
    ("one-door", "ui_console/planted.py", "from resource_pool.messages import Frame"),
    ("one-door", "mission_control/behaviors/planted.py", "import scout_model.description"),
    ("laboratory", "mission_control/behaviors/planted.py", "import mission_control.laboratory.simulation.laws"),
    ("core-services", "backbone/placer/planted.py", "from backbone.nameserver import service"),
    ("core-services", "backbone/rc_manager/planted.py", "import backbone.creator"),
    ("scheduling", "backbone/scheduling/planted.py", "import backbone.rc_manager.service"),
    ("modules", "mission_control/modules/planted.py", "import asyncio"),
    ("modules", "mission_control/modules/planted.py", "from backbone.bus.interface import Bus"),
    ("picture", "backbone/picture/planted.py", "import asyncio"),
    ("console-rooms", "ui_console/model/planted.py", "import ui_console.session.feed"),
    ("console-rooms", "ui_console/web/planted.py", "from ui_console.terminal import app"),
    ("console-model", "ui_console/model/planted.py", "import asyncio"),
    ("zenoh", "backbone/bus/planted.py", "import zenoh"),
    ("zenoh", "resource_pool/planted.py", "from zenoh.handlers import Callback"),
    ("mujoco", "resource_pool/planted.py", "import mujoco"),
    ("mujoco", "resource_pool/robots/walker/planted.py", "import mink"),
    ("cv2", "mission_control/planted.py", "import cv2"),
    ("cv2", "ui_console/planted.py", "import cv2"),
    ("foxglove", "backbone/recording/planted.py", "import foxglove"),
    ("foxglove", "resource_pool/planted.py", "from foxglove.messages import Log"),
    ("prometheus", "backbone/metrics/planted.py", "import prometheus_client"),
    ("pytest", "mission_control/laboratory/planted.py", "import pytest"),
    ("pyarrow", "backbone/command_line/planted.py", "import pyarrow"),
    ("pydantic", "backbone/placer/planted.py", "import pydantic"),
    ("pydantic", "resource_pool/planted.py", "from lxml import etree"),
    ("textual", "mission_control/planted.py", "import textual.app"),
    ("terminal", "resource_pool/planted.py", "from rich.console import Console"),
    ("terminal", "backbone/creator/planted.py", "import typer"),
]


@pytest.fixture(autouse=True, scope="module")
def _trees() -> Iterator[None]:
    with walls.kept_trees():
        yield


@pytest.fixture(scope="module")
def edges() -> set[walls.Import]:
    """Return all direct imports of the five packages."""
    return walls.imports(MODULES, MODULES)


def broken_by(folder: Path, file: str, line: str) -> dict[str, list[walls.Import]]:
    """Return what a file with this line breaks, added to the packages; each import breaks a wall by itself."""
    planted = folder / "planted.py"
    planted.write_text(f"{line}\n")
    name = module_of(file)
    return walls.broken(CONTRACTS, walls.imports({**MODULES, name: planted}, [name]))


def module_of(file: str) -> str:
    return file.removesuffix(".py").replace("/", ".")


def test_the_walls_stand(edges: set[walls.Import]) -> None:
    assert walls.broken(CONTRACTS, edges) == {}


def folder_of(module: str) -> str:
    return ".".join(MODULES[module].relative_to(TOP).parts[:-1])


def test_no_folder_and_no_file_imports_what_imports_it(edges: set[walls.Import]) -> None:
    own = {(importer, imported) for importer, imported in edges if imported in MODULES}
    assert walls.circle(own, folder_of) == []
    assert walls.circle(own, lambda module: module) == []


def test_a_planted_circle_is_found(edges: set[walls.Import]) -> None:
    back = ("backbone.errors", "backbone.launcher.endings")
    own = {(importer, imported) for importer, imported in edges if imported in MODULES} | {back}
    assert walls.circle(own, folder_of)
    assert walls.circle(own, lambda module: module)


def test_every_wall_has_a_planted_violation() -> None:
    assert {wall for wall, _file, _line in PLANTED} == {contract["id"] for contract in CONTRACTS}


@pytest.mark.parametrize("wall", ["one-door", "laboratory"])
def test_every_room_of_mission_control_but_the_laboratory_is_behind_the_wall(wall: str) -> None:
    rooms = {".".join(name.split(".")[:2]) for name in MODULES if name.startswith("mission_control.")}
    [contract] = (contract for contract in CONTRACTS if contract["id"] == wall)
    assert set(contract["source_modules"]) - {"ui_console"} == rooms - {"mission_control.laboratory"}


@pytest.mark.parametrize(("wall", "file", "line"), PLANTED)
def test_a_planted_violation_is_found(tmp_path: Path, wall: str, file: str, line: str) -> None:
    found = broken_by(tmp_path, file, line)
    assert wall in found
    assert {importer for importer, _imported in found[wall]} == {module_of(file)}


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("mission_control/behaviors/planted.py", "from resource_pool import arc_client"),
        ("mission_control/laboratory/planted.py", "import resource_pool.rcs"),
        ("mission_control/vision/planted.py", "import cv2"),
        ("backbone/placer/planted.py", "from backbone.nameserver.messages import Resolve"),
        ("resource_pool/planted.py", "import scout_model.description, backbone.wire"),
        ("ui_console/planted.py", "import textual, typer, rich.table"),
    ],
)
def test_what_is_allowed_is_not_complained_about(tmp_path: Path, file: str, line: str) -> None:
    assert broken_by(tmp_path, file, line) == {}


@pytest.mark.processes
def test_import_linter_finds_the_walls_standing() -> None:
    assert "0 broken" in lint_imports(TOP)


@pytest.mark.processes
def test_import_linter_finds_a_violation_of_each_wall_in_a_copy_of_the_tree(tmp_path: Path) -> None:
    shutil.copy(TOP / "pyproject.toml", tmp_path)
    for package in PACKAGES:
        shutil.copytree(TOP / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for number, (_wall, file, line) in enumerate(PLANTED):
        (tmp_path / file).with_name(f"planted_{number}.py").write_text(f"{line}\n")
    told = lint_imports(tmp_path)
    for contract in CONTRACTS:
        assert f"{contract['name']} BROKEN" in told, told


def lint_imports(top: Path) -> str:
    pytest.importorskip("importlinter", reason="import-linter comes with the dev extra")
    linting = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as lint; lint()", "--no-cache"],
        cwd=top,
        env={"PYTHONPATH": str(top), "PYTHONSAFEPATH": "1", "COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert linting.returncode in (0, 1), linting.stderr
    return linting.stdout


def test_only_the_clock_sleeps() -> None:
    """The local bus yields once, which takes no time."""
    sleepers = set()
    for name, file in MODULES.items():
        for node in walls.nodes(file):
            match node:
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id="asyncio" | "time"), attr="sleep"), args=[argument]
                ) if not (isinstance(argument, ast.Constant) and argument.value == 0):
                    sleepers.add(name)
    assert sleepers == {"backbone.bus.clock"}


def test_any_is_rare() -> None:
    """``Any`` turns the type checker off; it is for struct fields and libraries whose values really are of any kind."""
    names = [node.id for file in MODULES.values() for node in walls.nodes(file) if isinstance(node, ast.Name)]
    count = names.count("Any")
    lines = sum(file.read_text().count("\n") for file in MODULES.values())
    assert count <= 2 * lines / 1000, f"{count} in {lines} lines"


def test_each_refusal_has_a_code_of_its_own() -> None:
    """scout_model knows no refusals: what it raises is turned into one, under the same code, above it."""
    codes: Counter[str] = Counter()
    for file in (file for name, file in MODULES.items() if not name.startswith("scout_model")):
        for node in walls.nodes(file):
            match node:
                case ast.Assign(targets=[ast.Name(id="code")], value=ast.Constant(value=str(code))):
                    codes[code] += 1
    assert [code for code, count in codes.items() if count > 1] == []
