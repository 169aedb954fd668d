"""Ask classes for their facts, in a process of its own.

To ask a class, its module must be imported, and with it OpenCV or MuJoCo. In a separate process, the import costs the
asking process no memory, and a module that raises, hangs, or ends its process does no harm.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Sequence

import msgspec

from backbone.mission.arranged import Arranged, UnitFault, UnitsQuestion
from backbone.mission.class_facts import ClassFacts, Question
from backbone.printable_text import printable

WITHIN_S = 30.0  # chosen: ten times the import of OpenCV and MuJoCo on a loaded machine
STACKS_AFTER = 0.8  # chosen: share of this time after which the other process writes where it stands
_CALL = re.compile(r'  File "(.*)", line (\d+) in ')

_known: dict[str, ClassFacts] = {}
_judged: dict[str, str] = {}
_arranged: dict[str, Arranged] = {}


def ask_classes(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return the facts of each class, or ``failure`` with the reason; a class is asked once in a process.

    Args:
        class_paths: Each as ``package.module:Class``. Their modules are run.
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


def judge(questions: Sequence[Question]) -> tuple[list[str], dict[str, str]]:
    """Return each class's objection to its parameters, empty if it starts with them or gave no answer.

    Args:
        questions: About classes that can be imported; their modules are run.

    Returns:
        The objections, and class path → why the class gave no answer.
    """
    texts = [msgspec.json.encode(one, order="sorted").decode() for one in questions]
    asked = dict(zip(texts, [one.class_path for one in questions], strict=True))
    left, silent = [text for text in asked if text not in _judged], dict[str, str]()
    while left:
        printed, reason = _printed("judge", left, "it does not judge its parameters")
        _judged.update(zip(left, map(msgspec.json.decode, printed), strict=False))
        if left := left[len(printed) :]:
            silent[asked[left[0]]] = reason
            left = [text for text in left if asked[text] not in silent]
    return [_judged.get(text, "") for text in texts], silent


def arrange(question: UnitsQuestion) -> Arranged:
    """Return how the units are connected, or all faults; a repeated question is answered from memory.

    Args:
        question: About classes that can be imported; their modules are run.
    """
    text = msgspec.json.encode(question, order="sorted").decode()
    if text not in _arranged:
        printed, reason = _printed("arrange", [text], "their modules are not imported")
        if not printed:
            remedy = "Mend the class of a module, so that its file can be imported"
            return Arranged(faults=(UnitFault(f"the modules' classes cannot be asked: {reason}", remedy),))
        _arranged[text] = msgspec.json.decode(printed[0], type=Arranged)
    return _arranged[text]


def _asked(class_paths: Sequence[str]) -> tuple[dict[str, ClassFacts], str]:
    """Return the answers up to the first class that ended or blocked the process, and the reason for that."""
    printed, reason = _printed("facts", class_paths, "its module is not imported")
    return dict(zip(class_paths, map(_facts, printed), strict=False)), reason


def _facts(line: bytes) -> ClassFacts:
    try:
        return msgspec.json.decode(line, type=ClassFacts)
    except msgspec.ValidationError as error:  # such as more choices than a message carries
        return ClassFacts(failure=f"what it declares cannot be read: {error}")


def _printed(what: str, about: Sequence[str], late: str) -> tuple[list[bytes], str]:
    """Return the lines that the other process printed, one for each question, and why there are not more.

    Args:
        late: What did not happen if the process needs too long, for people.
    """
    stacks_at_s = time.monotonic() + WITHIN_S * STACKS_AFTER  # of the machine: the start of the process counts
    command = [sys.executable, "-P", "-m", "backbone.mission.class_probe", what, f"{stacks_at_s}"]
    questions = "\0".join(about).encode()  # no arguments, whose length is limited
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    reason = "the process that imports its module ends without an answer"
    try:
        printed = subprocess.run(  # noqa: S603  # this interpreter, with this program
            command, env=environment, input=questions, capture_output=True, timeout=WITHIN_S, check=False
        ).stdout
    except subprocess.TimeoutExpired as expired:
        printed, place = expired.stdout or b"", _place(expired.stderr or b"")
        reason = f"{late} within {WITHIN_S:g} s{place and '; it is at '}{place}"
    return printed[: printed.rfind(b"\n") + 1].splitlines(), reason


def _place(stacks: bytes) -> str:
    """Return the innermost call of the main thread, whose stack the interpreter writes last; empty: there is none."""
    _others, _begins, last = stacks.decode(errors="replace").rpartition("(most recent call first):\n")
    found = _CALL.match(last)
    return "" if found is None else printable(f"{found[1]}, line {found[2]}")
