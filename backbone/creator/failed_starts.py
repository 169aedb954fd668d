"""Failed starts: the refusal or the last lines of a component's log, as the answer to the order that started it."""

from __future__ import annotations

import itertools
import os
import re
import sysconfig
from collections.abc import Sequence

from backbone.component.launch import Launch
from backbone.component.logs import log_path
from backbone.component.process import EXIT_BUG, EXIT_NO_HUB, EXIT_REFUSED, cause_in_log, refusal_in_log
from backbone.creator.decisions import CRASHES, describe
from backbone.creator.messages import StartFailed
from backbone.errors import code_of
from backbone.printable_text import printable

LAST_LINES = 20
_STACK_LINE = re.compile(r'  File "(.*)", line (\d+) in (.*)$')
_ESCAPED = re.compile(r"\\(?:x([0-9a-f]{2})|u((?!d[89a-f])[0-9a-f]{4})|U(000[0-9a-f]{5}))")  # no lone surrogates
_STACK_CUT = "  ..."  # the last line of a stack of more than a hundred calls
_LOGGED = (EXIT_BUG, EXIT_REFUSED, EXIT_NO_HUB)
_ITSELF = "it ended itself without a reason in its log, as os._exit and exit in a C library do"
_STANDARD = f"{sysconfig.get_path('stdlib')}{os.sep}"
_CRASH = "Fatal Python error: "  # the interpreter writes it before the stacks
_LAST_BYTES = 16_384  # chosen: more than 20 lines of a traceback


def last_lines(run_directory: str, name: str) -> list[str]:
    """Return the end of a component's log, at most ``LAST_LINES`` lines; empty if it cannot be read."""
    return _end_of_log(run_directory, name)[-LAST_LINES:]


def cause_of_end(launch: Launch | None, pid: int, returncode: int) -> str:
    """Return the bug or the refusal that ended a component, or the place at which it crashed, or hung until its end.

    Empty: a signal ended it, or no log is kept.
    """
    if launch is None or not launch.run_directory:
        return ""
    lines = _end_of_log(launch.run_directory, launch.process or launch.name)
    if returncode < 0:
        return place_of_crash(lines) if -returncode in CRASHES else place_of_hang(lines)
    logged = cause_in_log(lines, launch.address, pid) if returncode in _LOGGED else ""
    is_kept = log_path(launch.run_directory, launch.process or launch.name).is_file()
    return logged or (_ITSELF if is_kept else "")


def place_of_crash(lines: Sequence[str]) -> str:
    """Return the developer's place at which a thread crashed, if a log ends with the interpreter's words; else empty.

    Example:
        >>> log = ["Fatal Python error: Aborted", "Current thread 0x01 (most recent call first):"]
        >>> place_of_crash([*log, '  File "pan.py", line 7 in update'])
        'pan.py, line 7, in update'
    """
    begins = max((number for number, line in enumerate(lines) if line.startswith(_CRASH)), default=len(lines))
    crashed = itertools.dropwhile(lambda line: not line.startswith("Current thread "), lines[begins:])
    stack = list(itertools.takewhile(lambda found: found is not None, map(_STACK_LINE.match, [*crashed][1:])))
    own = [found for found in stack if found is not None and not found[1].startswith(_STANDARD)]
    return _place(own[0]) if own else ""


def place_of_hang(lines: Sequence[str]) -> str:
    """Return the place at which the main thread stood, if a log ends with the stacks of its process; else empty.

    Example:
        >>> place_of_hang(["Thread 0x01 (most recent call first):", '  File "pan.py", line 7 in update'])
        'pan.py, line 7, in update'
    """
    place = None
    whole = lines[:-1] if lines and lines[-1] == _STACK_CUT else lines
    for line in reversed(whole):  # the main thread's stack is the last one, and its innermost call comes first
        found = _STACK_LINE.match(line)
        if found is None:
            break
        place = found
    return "" if place is None else _place(place)


def _place(place: re.Match[str]) -> str:
    file = _ESCAPED.sub(lambda found: chr(int(found[found.lastindex or 0], 16)), place[1])  # the interpreter escapes
    return printable(f"{file}, line {place[2]}, in {place[3]}")


def _end_of_log(run_directory: str, name: str) -> list[str]:
    try:
        with log_path(run_directory, name).open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - _LAST_BYTES))
            return file.read().decode(errors="replace").splitlines()
    except OSError:  # it was removed, or no descriptor is left: the component is restarted all the same
        return []


def start_failed(name: str, how: str, launch: Launch | None) -> StartFailed:
    """Return why the component did not start: the refusal at the end of its log, or the last lines.

    Args:
        how: How it ended.
        launch: Its launch; None: it is not known here any more.
    """
    lines = log_of(launch)
    if launch is not None and how.partition(":")[0] == describe(EXIT_REFUSED):  # the log ends with its refusal
        refusal = refusal_in_log(lines, launch.address)
        if refusal is not None:
            return StartFailed(refusal.detail, remedy=refusal.remedy, name=name, how=how, refused=code_of(refusal))
    return StartFailed("\n".join([f"{name}: {how}", *lines]), name=name, how=how)


def log_of(launch: Launch | None) -> list[str]:
    """Return the end of the log of a component, or of the process that it shares; empty if there is none."""
    if launch is None or not launch.run_directory:
        return []
    return last_lines(launch.run_directory, launch.process or launch.name)
