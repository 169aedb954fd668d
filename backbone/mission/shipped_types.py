"""The shipped component types, which no mission file needs to declare."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources

from backbone.mission.document import Element, parse
from backbone.mission.report import Report

FILE = "shipped_types.xml"


def shipped_text() -> bytes:
    """Return the types as the text of a mission file without other content."""
    return resources.files("backbone.mission").joinpath(FILE).read_bytes()


@lru_cache(maxsize=1)
def shipped_types() -> tuple[Element, ...]:
    """Return the element of each type, in the order of the file; whoever changes one changes a copy."""
    root = parse(shipped_text(), Report(FILE))
    types = None if root is None else root.first("types")
    if types is None:
        raise AssertionError(f"{FILE} has no types")
    return tuple(types.children)
