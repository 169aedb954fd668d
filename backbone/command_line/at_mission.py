"""Commands that join a mission: three options name it, and the command gets it as its parameter ``where``."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from backbone.command_line.options import chosen


class AtMission:
    """A command with the options ``--mission``, ``--connect`` and ``--secret-file`` in place of a parameter ``where``.

    Typer reads the signature only of a command that it builds, so the signature is made then.
    """

    def __init__(self, command: Callable[..., None]) -> None:
        functools.update_wrapper(self, command)
        self._command = command

    @property
    def __signature__(self) -> inspect.Signature:
        own = inspect.signature(self._command, eval_str=True)
        options = [parameter for name, parameter in own.parameters.items() if name != "where"]
        return own.replace(parameters=[*options, *inspect.signature(chosen, eval_str=True).parameters.values()])

    def __call__(self, mission: str | None, connect: str | None, secret_file: Path | None, **options: Any) -> None:
        """Run the command at the mission that the options name."""
        self._command(where=chosen(mission, connect, secret_file), **options)
