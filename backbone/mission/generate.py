"""Write the files that are made from declarations elsewhere: ``python -m backbone.mission.generate``.

Each stands in the repository, so that editors, readers and missions need not make it; a test compares.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec

from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import SHIPPED
from backbone.mission.declaration.xsd import XSD, xsd_text
from backbone.mission.reference import reference_text
from backbone.mission.shipped_types import shipped_types

REFERENCE = Path("docs/reference/mission-file.md")
ROOM = Path("backbone/mission")


def shipped_classes_text() -> str:
    """Return what the classes of the shipped types say of themselves, one class a line."""
    facts = ask_classes([one.text("class") for one in shipped_types()])
    if failed := [f"{path}: {one.failure}" for path, one in facts.items() if one.failure]:
        raise AssertionError("; ".join(failed))
    lines = (
        f"{msgspec.json.encode(path).decode()}: {msgspec.json.encode(one).decode()}" for path, one in facts.items()
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"


GENERATED: dict[Path, Callable[[str], str]] = {
    ROOM / SHIPPED: lambda _old: shipped_classes_text(),
    ROOM / XSD: lambda _old: xsd_text(),
    REFERENCE: reference_text,
}
"""Every generated file, below the project's top, and what makes its text of the old one.

Tables of the reference are made of the facts of classes; the text around them stays.
"""

if __name__ == "__main__":
    top = Path(__file__).parents[2]
    for file, text in GENERATED.items():
        (top / file).write_text(text((top / file).read_text("utf-8")), "utf-8")
