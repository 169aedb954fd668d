"""The draft file: stores unsaved changes beside the mission file, so that no reload, restart or power cut loses them.

The file exists only while there are unsaved changes. It contains the text and the mission file's content at the last
opening or saving, so that another program's change is detected even after a restart. The steps to undo are not stored.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import msgspec

from backbone.atomic_file import remove_leftover, replace_file
from backbone.errors import Refusal
from backbone.mission.document import MAX_BYTES
from backbone.mission.edit import outline
from backbone.mission.report import MissionInvalid
from ui_console.design.commands import TextState
from ui_console.design.draft import Draft

FORMAT = 1
MOST_BYTES = 4 * MAX_BYTES  # two texts in Base64 and their envelope


class DraftUnreadable(Refusal):
    """The draft file is not valid, or cannot be read."""

    code = "design.draft_unreadable"
    remedy = "Remove it to begin with what the mission file holds."


class DraftNotKept(Refusal):
    """The unsaved changes could not be written to the draft file; they are only in the server's memory."""

    code = "design.draft_not_kept"
    remedy = "Save the mission, or free the disk."


class _DraftRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    format: int
    text: bytes
    saved: bytes | None


class DraftFile:
    """The draft file of one mission; only one designer writes to it.

    Args:
        source: The mission file.
    """

    def __init__(self, source: str) -> None:
        self.path = path_of_draft(source)
        self._source = source
        self._wrote: bytes | None = None

    def resume(self) -> Draft | None:
        """Return the stored draft; None: there is no draft file.

        Raises:
            DraftUnreadable: The file is not a draft.
        """
        with contextlib.suppress(OSError):  # the existing file can be read nevertheless
            remove_leftover(self.path)
        try:
            if not self.path.exists():
                return None
            with self.path.open("rb") as file:
                data = file.read(MOST_BYTES + 1)
            kept = msgspec.json.decode(data, type=_DraftRecord)
            outline(kept.text)
        except OSError as error:
            raise DraftUnreadable(f"{self.path}: {error.strerror or error}") from error
        except (msgspec.DecodeError, MissionInvalid) as error:
            raise DraftUnreadable(f"{self.path} is no draft of a mission") from error
        if kept.format != FORMAT or len(data) > MOST_BYTES:
            raise DraftUnreadable(f"{self.path} is no draft that this program wrote")
        self._wrote = data
        return Draft(self._source, TextState(kept.text), saved=kept.saved)

    def keep(self, draft: Draft) -> None:
        """Write this draft to the draft file; if there are no unsaved changes, remove the file.

        Raises:
            DraftNotKept: The system refused, or another designer uses the draft file.
        """
        try:
            there = self.path.read_bytes() if self.path.exists() else None
            if there is not None and there != self._wrote:
                raise DraftNotKept(
                    f"{self.path} is another designer's", remedy="End the other one, then save or change something."
                )
            if draft.is_changed:
                data = msgspec.json.encode(_DraftRecord(FORMAT, draft.text, draft.saved))
                if data != there:
                    replace_file(self.path, data)
                self._wrote = data
            else:
                with contextlib.suppress(FileNotFoundError):
                    self.path.unlink()
                self._wrote = None
        except OSError as error:
            raise DraftNotKept(f"{self.path}: {error.strerror or error}") from error


def path_of_draft(source: str) -> Path:
    """Return the path of a mission file's draft file.

    Example:
        >>> str(path_of_draft("missions/guard.xml"))
        'missions/.guard.xml.draft'
    """
    path = Path(source)
    return path.with_name(f".{path.name}.draft")
