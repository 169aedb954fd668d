"""The command that serves the designer of one mission file."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from backbone.launcher.endings import ExitCode, say
from backbone.mission.reader import MissionInvalid
from ui_console.design.look_up import look_up
from ui_console.design.room import DesignRoom
from ui_console.design.server import DesignServer, begin
from ui_console.session.joining import end_server_on_signals
from ui_console.web.door import Doorkeeper, Pass
from ui_console.web.serving import Site
from ui_console.web.token_file import TokenFile


async def serve_designer(file: str, passes: Mapping[str, Pass], site: Site) -> int:
    """Serve the designer until a signal ends it; return the command's exit code.

    Args:
        file: Mission file to change, or to begin if there is none.
        passes: Token → whose it is.
        site: Where it is served.

    Raises:
        Refusal: ``CannotListen``, ``NoCertificate``, ``NotSaved`` or ``DraftUnreadable``.
    """
    encryption = site.encryption
    try:
        draft, kept = begin(file)
    except MissionInvalid as invalid:
        say(str(invalid))
        return ExitCode.MISSION_INVALID
    if kept.path.exists():
        say(f"goes on with what was not saved, from {kept.path}")
    end = asyncio.Event()
    interrupted = end_server_on_signals(lambda _signal: end.set())
    tokens = TokenFile.of_design(file, site.port) if site.port else None
    passes = site.passes_with(tokens, passes)
    server = DesignServer(DesignRoom(draft, kept, look_up), Doorkeeper(passes))
    await server.run(site.host, site.port, lambda port: site.opened(port, tokens, passes), end, encryption)
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE
