"""A how-to guide whose files are written and executed as they stand on the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from backbone.component.class_path import load_class
from backbone.mission.model import MissionDescription
from scout_model.description import WorldDescription

TOP = Path(__file__).parents[2]


def files_of(guide: str) -> dict[str, str]:
    """Return the files on a page of ``docs/how-to``: each a path in backticks and a colon, then a block."""
    page = (TOP / "docs" / "how-to" / guide).read_text(encoding="utf-8")
    return dict(re.findall(r"^`([\w./]+)`:\n\n```\w+\n(.*?)^```", page, re.M | re.S))


def lines_of(text: str) -> int:
    """Return the number of lines that are not blank."""
    return len([line for line in text.splitlines() if line.strip()])


@contextmanager
def written(files: dict[str, str], folder: Path, package: str) -> Iterator[None]:
    """Let the files stand in this folder and be importable for the time of the block."""
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / package / "__init__.py").touch()
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        for module in [name for name in sys.modules if name.partition(".")[0] == package]:
            del sys.modules[module]


def pool_of(mission: MissionDescription, package: str) -> dict[str, Any]:
    """Return world, hardware and classes of a mission for ``a_pool``; a radio is the pool's own."""
    [world] = [component for component in mission.components if component.name == "world"]
    classes = {kind.name: load_class(kind.class_path) for kind in mission.types if kind.class_path.startswith(package)}
    devices = {resource.type for resource in mission.resources}
    return {
        "world": msgspec.convert(world.parameters["world"], WorldDescription),
        "hardware": [resource for resource in mission.resources if resource.type in classes],
        "rc_classes": {name: kind for name, kind in classes.items() if name in devices},
        "arc_classes": {name: kind for name, kind in classes.items() if name not in devices},
    }


def rehearse(mission: Path) -> subprocess.CompletedProcess[str]:
    """Return what ``scout-backbone check --dry-run`` says of this file."""
    command = [str(Path(sys.executable).parent / "scout-backbone"), "check", mission.name, "--dry-run"]
    found = {**os.environ, "PYTHONPATH": os.pathsep.join([str(mission.parent), str(TOP)])}
    return subprocess.run(command, cwd=mission.parent, env=found, capture_output=True, text=True, check=False)
