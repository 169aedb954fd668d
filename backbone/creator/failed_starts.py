"""Failed starts: the refusal or the last lines of a component's log, as the answer to the order that started it."""

from __future__ import annotations

import os

from backbone.component.launch import Launch
from backbone.component.logs import log_path
from backbone.component.process import EXIT_BUG, EXIT_NO_HUB, EXIT_REFUSED, cause_in_log, refusal_in_log
from backbone.creator.messages import StartFailed
from backbone.creator.supervision import describe
from backbone.errors import code_of

LAST_LINES = 20
_LOGGED = (EXIT_BUG, EXIT_REFUSED, EXIT_NO_HUB)
_LAST_BYTES = 16_384  # chosen: more than 20 lines of a traceback


def last_lines(run_directory: str, name: str) -> list[str]:
    """Return the end of a component's log, at most ``LAST_LINES`` lines; empty if it cannot be read."""
    return _end_of_log(run_directory, name)[-LAST_LINES:]


def cause_of_end(launch: Launch | None, pid: int, returncode: int) -> str:
    """Return the bug or the refusal that ended a component; empty: another end, or its log does not say."""
    if launch is None or not launch.run_directory or returncode not in _LOGGED:
        return ""
    return cause_in_log(_end_of_log(launch.run_directory, launch.process or launch.name), launch.address, pid)


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
        name: The component.
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
