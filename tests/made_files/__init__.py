"""The files that are made from declarations elsewhere: ``python -m tests.made_files`` writes them all anew.

Each stands in the repository, so that editors, readers, missions and the checker of the pages' JavaScript need not make
it; ``test_made_files`` compares. Nothing that runs in a mission needs these programs, so they stand beside the tests.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec

from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import SHIPPED
from backbone.mission.declaration.xsd import XSD, xsd_text
from backbone.mission.shipped_types import shipped_types

from .kit_reference import kit_reference
from .mission_reference import reference_text
from .page_types import CONSOLE, DESIGNER, declarations
from .quality_reference import quality_reference

TOP = Path(__file__).parents[2]
ROOM, PAGE = Path("backbone/mission"), Path("ui_console/web/page")


def shipped_classes_text() -> str:
    """Return what the classes of the shipped types say of themselves, one class a line."""
    facts = ask_classes([one.text("class") for one in shipped_types()])
    if failed := [f"{path}: {one.failure}" for path, one in facts.items() if one.failure]:
        raise AssertionError("; ".join(failed))
    lines = (
        f"{msgspec.json.encode(path).decode()}: {msgspec.json.encode(one).decode()}" for path, one in facts.items()
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"


MADE_FILES: dict[Path, Callable[[str], str]] = {
    ROOM / SHIPPED: lambda _old: shipped_classes_text(),
    ROOM / XSD: lambda _old: xsd_text(),
    Path("docs/reference/mission-file.md"): reference_text,
    Path("docs/reference/module-kit.md"): kit_reference,
    Path("docs/reference/messages.md"): quality_reference,
    PAGE / "messages.d.ts": lambda _old: declarations(CONSOLE),
    PAGE / "design_messages.d.ts": lambda _old: declarations(DESIGNER),
}
"""Every made file, below the project's top, and what makes its text of the old one.

Tables of the reference are made of the facts of classes, which are written first; the text around them stays.
"""


def write_all() -> None:
    """Write every made file."""
    for file, text in MADE_FILES.items():
        (TOP / file).write_text(text((TOP / file).read_text("utf-8")), "utf-8")
