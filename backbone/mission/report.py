"""Faults of a mission file: collected, never raised one by one, reported in the order of the file."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from backbone.errors import BackboneError
from backbone.naming import MAX_NAME_LENGTH

HINTS_AT_MOST = 50  # chosen: more than a person reads at once, and each hint costs milliseconds
NAMES_LISTED = 8  # chosen: fits a line
QUOTED_LENGTH = 60  # chosen: same


class Place(NamedTuple):
    """Line and column in a file; both count from 1, columns in characters."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault in a mission file.

    Attributes:
        file: The file, as it was named to the reader.
        line: From 1.
        column: From 1, in characters.
        remedy: How to correct it.
    """

    file: str
    line: int
    column: int
    message: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.message} ({self.remedy})"


class MissionInvalid(BackboneError):
    """A mission file cannot be used; the text contains every fault, one a line.

    Attributes:
        faults: All of them, in the order of the file.
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))


class Report:
    """Collects the faults of one file.

    Args:
        file: The file, as it was named to the reader.
    """

    def __init__(self, file: str) -> None:
        self.file = file
        """The file, as it was named to the reader."""
        self._faults: list[Fault] = []
        self._hints_left = HINTS_AT_MOST

    def fault(self, place: Place, message: str, remedy: str) -> None:
        """Add a fault."""
        self._faults.append(Fault(self.file, place.line, place.column, message, remedy.rstrip(".")))

    def nearest(self, name: str, known: Collection[str]) -> str:
        """Return the known name nearest to a wrong one; empty if none is near, or after ``HINTS_AT_MOST`` searches."""
        if self._hints_left == 0 or not known:
            return ""
        self._hints_left -= 1
        return next(iter(difflib.get_close_matches(name[:MAX_NAME_LENGTH], known, n=1)), "")

    def hint(self, name: str, known: Collection[str]) -> str:
        """Return a remark with the nearest known name, to follow the wrong one."""
        near = self.nearest(name, known)
        return f" (did you mean {near!r}?)" if near else ""

    def faults(self) -> list[Fault]:
        """Return each fault once, in the order of the file."""
        return sorted(dict.fromkeys(self._faults), key=lambda fault: (fault.line, fault.column))


def quoted(value: str) -> str:
    """Return the value quoted, shortened if it is long."""
    return repr(value if len(value) <= QUOTED_LENGTH else f"{value[:QUOTED_LENGTH]}…")


def listed(names: Collection[str]) -> str:
    """Return names as a list for people, shortened if there are many.

    Example:
        >>> listed(["radio", "grabber"])
        'radio, grabber'
    """
    each = [name for name in dict.fromkeys(names) if name]  # a missing name is a fault of its own
    first = each[:NAMES_LISTED]
    rest = len(each) - len(first)
    return ", ".join(first) + (f" and {rest} more" if rest else "")
