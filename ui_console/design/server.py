"""The designer's server: page, socket and background tasks. No mission needs to be up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from ssl import SSLContext

from ui_console.design.draft import Draft
from ui_console.design.file import NotSaved
from ui_console.design.keeping import DraftFile
from ui_console.design.protocol import DesignIntent, understand_designer
from ui_console.design.room import Designer, DesignRoom
from ui_console.web.login import Authenticator
from ui_console.web.page_files import DESIGN_FILES, PageFiles
from ui_console.web.page_server import PageServer, port_of


def begin(source: str) -> tuple[Draft, DraftFile]:
    """Return the draft of a mission file: earlier unsaved changes, else the file's content, else a new mission.

    Raises:
        NotSaved: The file is a folder, or its folder does not exist.
        DraftUnreadable: The draft file is not valid.
        MissionInvalid: The file cannot be read, or is no XML.
    """
    if Path(source).is_dir():
        raise NotSaved(f"{source} is a folder", remedy="Name a mission file in it.")
    folder = Path(source).parent
    if not folder.is_dir():
        raise NotSaved(f"{folder} is no folder", remedy="Make it first.")
    kept = DraftFile(source)
    draft = kept.resume()
    if draft is None:
        draft = Draft.opened(source) if Path(source).exists() else Draft.new(source)
    return draft, kept


class DesignServer:
    """Serves the designer's page and its socket.

    Args:
        room: The draft and its designers.
        authenticator: Knows the tokens.
    """

    def __init__(self, room: DesignRoom, authenticator: Authenticator) -> None:
        self._room = room
        self._page_server: PageServer[Designer, DesignIntent] = PageServer(
            room, authenticator, PageFiles(DESIGN_FILES), understand_designer
        )

    async def run(
        self,
        host: str,
        port: int,
        ready: Callable[[int], None],
        end: asyncio.Event,
        encryption: SSLContext | None = None,
    ) -> None:
        """Serve until the event is set; unsaved changes are stored beside the file; see ``Reception.open``.

        Args:
            ready: Called with the port once the server listens.

        Raises:
            CannotListen: The address is in use, or does not belong to this machine.
            BaseExceptionGroup: A bug ended the server; the group contains it.
        """
        room = self._room
        await room.prepare()
        try:
            async with self._page_server.open(host, port, encryption) as server, asyncio.TaskGroup() as beside:
                keeping = beside.create_task(room.keep_on(), name="design: keep_on")
                ready(port_of(server))
                await end.wait()
                keeping.cancel()
        finally:
            await room.keep_now()
