"""Saving a draft: whole or not at all, and never over somebody else's work unasked."""

from __future__ import annotations

from pathlib import Path

from backbone.atomic_file import replace_file
from backbone.errors import Refusal
from ui_console.design.commands import DesignRefused
from ui_console.design.draft import Draft


class FileChanged(DesignRefused):
    """The file is no longer what was opened or saved last."""

    code = "design.file_changed"
    remedy = "Save it under another name, or save again to overwrite."


class NotSaved(Refusal):
    """The system did not let the file be written; what it held before it holds now."""

    code = "design.not_saved"
    remedy = "Free the disk, or save it elsewhere."


def save(draft: Draft, path: Path, *, overwrite: bool = False) -> Draft:
    """Write the draft's bytes and return it as saved there.

    The file is replaced in one step: whoever reads it meanwhile sees the old one or the new one. Its permissions stay.

    Args:
        draft: What is saved.
        path: Where; a symbolic link is followed.
        overwrite: Whether to replace what somebody else wrote there.

    Raises:
        FileChanged: The file holds something else than was opened or saved last.
        NotSaved: The system refused.
    """
    try:
        target = path.resolve()
        holds = target.read_bytes() if target.exists() else None
        known = draft.saved if path == Path(draft.source) else None
        if not overwrite and holds is not None and holds not in (known, draft.text):
            raise FileChanged(f"{path} holds something else than was opened or saved last")
        replace_file(target, draft.text)
    except OSError as error:
        raise NotSaved(f"{path}: {error.strerror or error}") from error
    return draft.kept(str(path))
