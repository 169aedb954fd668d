"""Descriptions of a struct and of its fields, from its docstrings."""

from __future__ import annotations

import inspect
import re

_ENTRY = re.compile(r"^    (\w+): (.*)$")


def field_docs(struct: type) -> dict[str, str]:
    """Return field → its description in the docstrings of a struct and of its bases."""
    found: dict[str, str] = {}
    for base in reversed(struct.__mro__):
        _, _, section = inspect.cleandoc(base.__dict__.get("__doc__") or "").partition("Attributes:\n")
        name = ""
        for line in section.splitlines():
            if entry := _ENTRY.match(line):
                name = entry[1]
                found[name] = entry[2]
            elif name and line.startswith("        "):
                found[name] += " " + line.strip()
            else:
                name = ""
    return {name: doc.replace("``", "'") for name, doc in found.items()}


def first_sentence(struct: type) -> str:
    """Return the first sentence of a struct's docstring, without its full stop."""
    summary = inspect.cleandoc(struct.__doc__ or "").partition("\n\n")[0]
    return " ".join(summary.split()).removesuffix(".").replace("``", "'")
