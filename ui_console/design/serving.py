"""The command that serves the designer of one mission file."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence

from backbone.launcher.endings import ExitCode, say
from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import ClassFacts
from backbone.mission.reader import MissionInvalid
from ui_console.design.room import DesignRoom
from ui_console.design.server import DesignServer, begin
from ui_console.session.joining import end_server_on_signals
from ui_console.web.login import Authenticator, TokenRights
from ui_console.web.serving import ServerOptions
from ui_console.web.token_file import TokenFile


async def serve_designer(file: str, rights: Mapping[str, TokenRights], options: ServerOptions) -> int:
    """Serve the designer until a signal ends it; return the command's exit code.

    Args:
        file: Mission file; it need not exist yet.
        rights: Token → its rights.
        options: Address and encryption.

    Raises:
        Refusal: ``CannotListen``, ``NoCertificate``, ``NotSaved`` or ``DraftUnreadable``.
    """
    encryption = options.encryption
    try:
        draft, kept = begin(file)
    except MissionInvalid as invalid:
        say(str(invalid))
        return ExitCode.MISSION_INVALID
    if kept.path.exists():
        say(f"goes on with the unsaved changes in {kept.path}")
    end = asyncio.Event()
    interrupted = end_server_on_signals(lambda _signal: end.set())
    tokens = TokenFile.of_design(file, options.port) if options.port else None
    rights = options.rights_with(tokens, rights)
    server = DesignServer(DesignRoom(draft, kept, look_up), Authenticator(rights))
    await server.run(options.host, options.port, lambda port: options.opened(port, tokens, rights), end, encryption)
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return the facts of each class, read in another process; if a class has no facts, ``failure`` has the reason.

    Args:
        class_paths: Class paths ``package.module:Class``. Their modules are executed.
    """
    return await asyncio.to_thread(ask_classes, class_paths)
