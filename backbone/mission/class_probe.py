"""Ask classes for their facts, in a process of its own.

To ask a class, its module is imported, and with it OpenCV or MuJoCo: the asking process stays light, and it goes on
if a module raises, hangs, or ends its process. Run as a program, the module prints one JSON line for each class.
"""

from __future__ import annotations

import importlib
import inspect
import os
import re
import subprocess
import sys
from collections.abc import Sequence

import msgspec

from backbone.component.component import Component
from backbone.mission.class_facts import ClassFacts, ParameterFacts, parameters_of

WITHIN_S = 30.0  # chosen: ten times the import of OpenCV and MuJoCo on a loaded machine

_ENTRY = re.compile(r"^    (\w+): (.*)$")
_known: dict[str, ClassFacts] = {}


def ask_classes(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return the facts of each class; ``failure`` says why a class has none. A class is asked once in a process.

    Args:
        class_paths: ``package.module:Class`` each. Their modules are run.
    """
    left = [path for path in dict.fromkeys(class_paths) if path not in _known]
    failed: dict[str, ClassFacts] = {}
    while left:
        answers, reason = _asked(left)
        _known.update({path: facts for path, facts in answers.items() if not facts.failure})
        failed.update({path: facts for path, facts in answers.items() if facts.failure})
        left = left[len(answers) :]
        if left:
            failed[left.pop(0)] = ClassFacts(failure=reason)
    return {path: _known.get(path) or failed[path] for path in class_paths}


def _asked(class_paths: Sequence[str]) -> tuple[dict[str, ClassFacts], str]:
    """Return the answers up to the first class that ended or held up the process, and how it did so."""
    command = [sys.executable, "-P", "-m", "backbone.mission.class_probe", *class_paths]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    reason = "the process that imports its module ends without an answer"
    try:
        printed = subprocess.run(  # noqa: S603  # this interpreter, with this program
            command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=WITHIN_S, check=False
        ).stdout
    except subprocess.TimeoutExpired as expired:
        printed, reason = expired.stdout or b"", f"its module is not imported within {WITHIN_S:g} s"
    lines = printed[: printed.rfind(b"\n") + 1].splitlines()
    answers = [msgspec.json.decode(line, type=ClassFacts) for line in lines]
    return dict(zip(class_paths, answers, strict=False)), reason


def facts_of(class_path: str) -> ClassFacts:
    """Return the facts of a class; imports its module into this process."""
    module, _, name = class_path.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # a module that is being written raises anything
        return ClassFacts(failure=f"its module cannot be imported: {type(error).__name__}: {error}")
    if not (isinstance(found, type) and issubclass(found, Component)):
        return ClassFacts(failure="it is no component: it does not derive from backbone.component.component:Component")
    own = tuple(one for one in _documented(found.parameters_type) if one.name not in found.given_elsewhere)
    options = found.driver_options()
    return ClassFacts(
        inspect.getdoc(found) or "",
        own,
        None if options is None else {driver: _documented(struct) for driver, struct in options.items()},
    )


def _documented(struct: type[msgspec.Struct]) -> tuple[ParameterFacts, ...]:
    docs = _documentation(struct)
    found = parameters_of(struct)
    return tuple(
        msgspec.structs.replace(one, doc=one.doc or docs.get(one.name, "").replace("``", "'")) for one in found
    )


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


def _answer(class_paths: Sequence[str]) -> None:
    """Print the facts of each class as it is known; what the modules print goes nowhere."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for path in class_paths:
        answers.write(msgspec.json.encode(facts_of(path)) + b"\n")
        answers.flush()


if __name__ == "__main__":
    _answer(sys.argv[1:])
