"""Extras: libraries that only some commands need, and the refusal if one is not installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from backbone.command_line.options import DISTRIBUTION
from backbone.errors import Refusal
from backbone.launcher.endings import complaint_of, say

EXTRAS = {"foxglove": "foxglove", "prometheus_client": "metrics", "pyarrow": "parquet"}
"""Library → the extra that installs it."""


class ExtraMissing(Refusal):
    """The command needs a library that is not installed."""

    code = "usage.extra"

    def __init__(self, library: str) -> None:
        remedy = f"Install it: pip install '{DISTRIBUTION}[{EXTRAS[library]}]'."
        super().__init__(f"{library} is not installed", remedy=remedy, library=library)


@contextmanager
def needing_extras() -> Iterator[None]:
    """Import libraries that need an extra; if one is missing, print which extra to install, and end the command."""
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in EXTRAS:
            raise
        complaint, code = complaint_of(ExtraMissing(library))
        say(complaint)
        raise typer.Exit(int(code)) from None
