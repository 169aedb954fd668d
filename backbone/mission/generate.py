"""Write the files that are made from declarations elsewhere: ``python -m backbone.mission.generate``.

Each stands in the repository, so that editors, readers and missions need not make it; a test compares.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import SHIPPED
from backbone.mission.declaration.reference import reference_text
from backbone.mission.declaration.xsd import XSD, xsd_text
from backbone.mission.shipped_types import shipped_types

HERE = Path(__file__).parent
REFERENCE = HERE.parents[1] / "docs" / "reference" / "mission-file.md"


def generated() -> dict[Path, str]:
    """Return the text of every generated file."""
    return {
        HERE / SHIPPED: shipped_classes_text(),
        HERE / XSD: xsd_text(),
        REFERENCE: reference_text(REFERENCE.read_text("utf-8")),
    }


def shipped_classes_text() -> str:
    """Return what the classes of the shipped types say of themselves, one class a line."""
    facts = ask_classes([one.text("class") for one in shipped_types()])
    if failed := [f"{path}: {one.failure}" for path, one in facts.items() if one.failure]:
        raise AssertionError("; ".join(failed))
    lines = (
        f"{msgspec.json.encode(path).decode()}: {msgspec.json.encode(one).decode()}" for path, one in facts.items()
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    for file, text in generated().items():
        file.write_text(text, "utf-8")
