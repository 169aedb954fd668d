"""The object at a class path, and why a path leads to nothing: it is wrong, or its file cannot be imported."""

from __future__ import annotations

import importlib
import operator
import re
from typing import Any

from backbone.errors import complaint, own_place
from backbone.printable_text import printable

MEND = "Mend the file of the class, so that it can be imported."
_NAMES = r"[^\W\d]\w*(\.[^\W\d]\w*)*"
_PATH = re.compile(f"{_NAMES}:{_NAMES}")


def object_at(path: str) -> Any:
    """Return the object at ``package.module:Class``; imports its file.

    Raises:
        ValueError: The text is no such path; nothing is imported.
        Exception: There is no such object, or its file cannot be imported, which may raise anything: ``import_fault``.
    """
    if _PATH.fullmatch(path) is None:
        raise ValueError("it is no path as package.module:Class")
    module, _, name = path.partition(":")
    return operator.attrgetter(name)(importlib.import_module(module))


def import_fault(class_path: str, error: BaseException) -> tuple[str, str | None]:
    """Return a sentence about an exception that came from the import of ``package.module:Class``, and its remedy.

    Args:
        error: Raised by ``object_at``.

    Returns:
        The sentence; with its file and line if code of the file raised it. The remedy: ``MEND``, or None if only the
        path is wrong.

    Example:
        >>> import_fault("nowhere:Own", ModuleNotFoundError("No module named 'nowhere'", name="nowhere"))
        ("nowhere:Own: No module named 'nowhere'", None)
        >>> import_fault("there:Own", ModuleNotFoundError("No module named 'library'", name="library"))[1] == MEND
        True
    """
    module = class_path.partition(":")[0]
    if isinstance(error, ModuleNotFoundError):
        is_path = f"{module}.".startswith(f"{error.name}.")
    else:
        is_path = isinstance(error, AttributeError | ValueError) and not own_place(error)
    return (printable(f"{class_path}: {error}"), None) if is_path else (f"{class_path}: {complaint(error)}", MEND)
