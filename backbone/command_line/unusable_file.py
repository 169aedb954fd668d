"""The refusal of a file that a command cannot use."""

from __future__ import annotations

from backbone.errors import Refusal


class FileUnusable(Refusal):
    """A file of the command cannot be read or written."""

    code = "usage.file"
    remedy = "Name a file that this user may read, or a new file in a folder where this user may write."
