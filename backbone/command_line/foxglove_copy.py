"""The work of ``scout-backbone recording foxglove``."""

from __future__ import annotations

from pathlib import Path

from backbone.command_line.opened_recording import opened, require_selected
from backbone.command_line.unusable_file import new_file
from backbone.foxglove.translated_copy import write_copy
from backbone.foxglove.well_known import installed
from backbone.launcher.endings import ExitCode, say
from backbone.spoken import counted


async def copy_for_foxglove(path: Path, to: Path, keys: tuple[str, ...]) -> ExitCode:
    """Write a copy of the recording to a new file, with messages that Foxglove shows.

    Raises:
        NothingSelected: No message has one of these keys.
        FileUnusable: The recording cannot be read, or the new file exists or cannot be written.
        NoRecording: The file is not a recording, its recorder was killed, or it is damaged.
    """
    with opened(path) as recording:
        require_selected(recording, path, keys)
        with new_file(to) as file:
            shown = write_copy(recording, file, installed(), keys)
    say(f"{to}: {counted(shown, 'message')} that Foxglove shows, and all others as recorded")
    return ExitCode.DONE
