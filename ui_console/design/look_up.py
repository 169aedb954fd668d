"""Ask classes for their documentation and parameters, in a process of its own.

To ask a class its module must be imported, and with it OpenCV and whatever else it needs; the designer stays light
and goes on if that fails. Run as a program it prints one JSON object: class path → ``ClassFacts``.
"""

from __future__ import annotations

import asyncio
import importlib
import inspect
import re
import sys
from collections.abc import Sequence
from typing import Any

import msgspec

from backbone.mission.behavior_orders import TREE_PARAMETERS
from ui_console.design.catalogue import ClassFacts, ParameterFacts

WITHIN_S = 30.0  # chosen: ten times what it takes on a loaded machine
HIDDEN = frozenset({*TREE_PARAMETERS, "driver", "sharable", "capacity", "links"})
"""Set by the rest of the mission file."""

_LIMITS = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
_ENTRY = re.compile(r"^    (\w+): (.*)$")


async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return what each class says of itself, asked in another process.

    Nothing is raised: what cannot be asked has a ``failure``.

    Args:
        class_paths: ``package.module:Class`` each. Their modules are run.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-P", "-m", "ui_console.design.look_up", *class_paths),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        async with asyncio.timeout(WITHIN_S):
            answer, _ = await process.communicate()
        return msgspec.json.decode(answer, type=dict[str, ClassFacts])
    except TimeoutError:
        failure = f"its module was not imported within {WITHIN_S:g} s"
    except msgspec.DecodeError:
        failure = "the process that imports its module ended without an answer"
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    return {path: ClassFacts(failure=failure) for path in class_paths}


def facts_of(class_path: str) -> ClassFacts:
    """Return what a class says of itself; imports its module into this process."""
    module, _, name = class_path.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # whatever a module raises that somebody is still writing
        return ClassFacts(failure=f"its module cannot be imported: {type(error).__name__}: {error}")
    struct = getattr(found, "parameters_type", None)
    parameters = _parameters(struct) if isinstance(struct, type) and issubclass(struct, msgspec.Struct) else ()
    return ClassFacts(inspect.getdoc(found) or "", parameters)


def _parameters(struct: type[msgspec.Struct]) -> tuple[ParameterFacts, ...]:
    (schema,), definitions = msgspec.json.schema_components([struct], ref_template="{name}")
    told = definitions[schema["$ref"]]
    docs = _documentation(struct)
    return tuple(
        ParameterFacts(
            name,
            _type(one, definitions),
            "" if name in told["required"] else msgspec.json.encode(one.get("default")).decode(),
            ", ".join(f"{word} {one[limit]:g}" for limit, word in _LIMITS.items() if limit in one),
            docs.get(name, ""),
        )
        for name, one in told["properties"].items()
        if name not in HIDDEN
    )


def _type(one: dict[str, Any], definitions: dict[str, Any]) -> str:
    if "$ref" in one:
        return _type(definitions[one["$ref"]], definitions)
    if "enum" in one:
        return "one of " + " ".join(map(str, one["enum"]))
    if "anyOf" in one:
        return " or ".join(_type(each, definitions) for each in one["anyOf"])
    return str(one.get("type", "any"))


def _documentation(struct: type) -> dict[str, str]:
    """Return what the docstrings of a struct and its bases say of each field."""
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
    return found


if __name__ == "__main__":
    sys.stdout.buffer.write(msgspec.json.encode({path: facts_of(path) for path in sys.argv[1:]}))
