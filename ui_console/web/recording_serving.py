"""The command that serves a recording as a page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from backbone.bus.clock import MissionClock
from backbone.launcher.endings import ExitCode
from ui_console.session.joining import end_server_on_signals
from ui_console.session.recorded_play import opener
from ui_console.web.login import Authenticator, TokenRights
from ui_console.web.page_files import PageFiles
from ui_console.web.page_server import PageServer, port_of
from ui_console.web.playing import Playing, understand
from ui_console.web.protocol import Intent
from ui_console.web.recording_room import RecordingRoom, Viewer
from ui_console.web.serving import ServerOptions


async def serve_recording(path: Path, rights: Mapping[str, TokenRights], options: ServerOptions) -> int:
    """Serve a recording until a signal ends it; return the command's exit code.

    Args:
        path: Of the recording; nothing needs to be up.
        rights: Token → its rights.
        options: Address and encryption.

    Raises:
        Refusal: ``CannotListen``, ``NoCertificate``, ``FileUnusable``, ``NoRecording`` or ``OtherForm``.
    """
    room = RecordingRoom(opener(path), MissionClock.started_now())
    interrupted = end_server_on_signals(room.end)
    server: PageServer[Viewer, Intent | Playing] = PageServer(room, Authenticator(rights), PageFiles(), understand)
    async with server.open(options.host, options.port, options.encryption) as listening:
        options.opened(port_of(listening), None, rights)
        await room.run()
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE
