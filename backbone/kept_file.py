"""Kept file: what a component leaves in the mission's folder for its next process, but not for another mission.

The folder of a mission that ends is renamed while its processes still run, and another mission of the same name may
make a new one. So a process writes only into the folder that it found when it began.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from copy import copy
from pathlib import Path

from backbone.atomic_file import replace_file

log = logging.getLogger(__name__)

FOLDER = "kept"


class KeptFile:
    """A file of one component.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        kind: Kind of the file, such as ``motions``.
        name: Name of the component.
    """

    def __init__(self, run_directory: str, kind: str, name: str) -> None:
        self._run_directory = Path(run_directory) if run_directory else None
        self._kind = kind
        self._name = name
        self._found = _identity(self._run_directory)

    @property
    def path(self) -> Path | None:
        """Path of the file; None: nothing is kept, or no longer, or the mission has ended."""
        if self._run_directory is None or self._found is None or _identity(self._run_directory) != self._found:
            return None
        return self._run_directory / FOLDER / self._kind / self._name

    def of(self, name: str) -> KeptFile:
        """Return the file of another component, of the same kind and in the folder that was found."""
        other = copy(self)
        other._name = name  # noqa: SLF001  of this class
        return other

    def give_up(self) -> None:
        """Keep nothing from now on."""
        self._found = None

    def read(self) -> bytes | None:
        """Return the content; None: there is no file.

        Raises:
            OSError: The system refused.
        """
        path = self.path
        try:
            return None if path is None else path.read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None

    def target(self) -> Path | None:
        """Return the path of the file, in a folder that exists; None: as for ``path``.

        Raises:
            OSError: The system refused.
        """
        path = self.path
        if path is not None:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        return path


def kept_files(run_directory: Path) -> dict[Path, bytes]:
    """Return all kept files of a mission's folder: path in it → content; those that cannot be read are left out."""
    found = {}
    for path in sorted((run_directory / FOLDER).rglob("[!.]*")):
        try:
            if path.is_file():
                found[path.relative_to(run_directory)] = path.read_bytes()
        except OSError as error:
            log.warning("%s is lost: %s", path, error)
    return found


def put_back(run_directory: Path, files: Mapping[Path, bytes]) -> None:
    """Write kept files to another folder of the same mission on the same host, before a component runs there."""
    for path, content in files.items():
        target = run_directory / path
        try:
            target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            replace_file(target, content, is_lasting=False)
        except OSError as error:
            log.warning("%s is lost: %s", target, error)


def _identity(folder: Path | None) -> tuple[int, int] | None:
    try:
        found = None if folder is None else folder.stat()
    except OSError:
        return None
    return None if found is None else (found.st_dev, found.st_ino)
