"""Why a class path leads to nothing: the path is wrong, or its file cannot be imported. The remedies differ."""

from __future__ import annotations

from backbone.errors import complaint, own_place
from backbone.printable_text import printable

MEND = "Mend the file of the class, so that it can be imported."


def import_fault(class_path: str, error: BaseException) -> tuple[str, str | None]:
    """Return a sentence about an exception that came from the import of ``package.module:Class``, and its remedy.

    Args:
        error: Raised by ``getattr(import_module("package.module"), "Class")``.

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
