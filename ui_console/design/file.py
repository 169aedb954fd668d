"""Saves a draft: completely or not at all, and over another program's change only on request."""

from __future__ import annotations

import os
from pathlib import Path

from backbone.atomic_file import replace_file
from backbone.errors import Refusal
from ui_console.design.commands import DesignRefused
from ui_console.design.draft import Draft


class FileChanged(DesignRefused):
    """The file has changed since the designer opened or saved it."""

    code = "design.file_changed"
    remedy = "Save it under another name, or save again to overwrite."


class NotSaved(Refusal):
    """The system refused to write the file; its content is as before."""

    code = "design.not_saved"
    remedy = "Free the disk, or save it elsewhere."


def save(draft: Draft, path: Path, *, overwrite: bool = False) -> Draft:
    """Write the draft's bytes; return the draft as saved.

    The file is replaced in one step: a program that reads it meanwhile gets either the old or the new content. Its
    permissions stay.

    Args:
        path: The file; a symbolic link is followed.
        overwrite: True: replace the changes of other programs.

    Raises:
        FileChanged: The file has changed since the designer opened or saved it.
        NotSaved: The system refused.
    """
    try:
        target = Path(os.path.realpath(path))  # ``resolve`` raises on a loop of links
        holds = target.read_bytes() if target.exists() else None
        known = draft.saved if path == Path(draft.source) else None
        if not overwrite and holds is not None and holds not in (known, draft.text):
            raise FileChanged(f"{path} holds something else than was opened or saved last")
        replace_file(target, draft.text)
    except OSError as error:
        raise NotSaved(f"{path}: {error.strerror or error}") from error
    return draft.kept(str(path))
