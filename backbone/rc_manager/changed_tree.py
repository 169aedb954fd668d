"""Changed tree: a later RC manager begins with the numbers and places that operators have set.

The owner of this process, the launcher, keeps them with the parameters of the RC manager's next start. ARCs cannot keep
them: a node may have no ARC at the time, and an ARC that begins anew has the path of the mission file.
"""

from __future__ import annotations

import asyncio

import msgspec

from backbone.component.asking import ask_until_answered
from backbone.creator.messages import ReviseSpawn, SpawnRevised
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.rc_watch import Service

LAUNCHER_REPLY_S = 1.0  # chosen: it answers in milliseconds
KEPT_WITHIN_S = 60.0  # chosen: longer than links are down


class ChangedTree:
    """Sends the changed tree to the owner of this process.

    Args:
        service: The RC manager.
    """

    def __init__(self, service: Service) -> None:
        self._service = service
        self._sending: asyncio.Task[None] | None = None

    def keep(self) -> None:
        """Send the present numbers and places until the owner has them; earlier ones are not repeated any more."""
        if self._sending is not None:
            self._sending.cancel()
        if self._service.launch.requester:  # else it was started by hand, and no owner starts it again
            self._sending = self._service.start_task(self._send(), "keep the tree")

    async def _send(self) -> None:
        launch = self._service.launch
        tree = msgspec.to_builtins(self._service.manager.tree.kept())
        revised = ReviseSpawn(launch.name, {**launch.parameters, "tree": tree})
        try:
            await ask_until_answered(
                self._service.bus,
                self._service.clock,
                launch.requester,
                revised,
                SpawnRevised,
                each_s=LAUNCHER_REPLY_S,
                within_s=KEPT_WITHIN_S,
            )
        except (Refusal, LinkError) as error:
            self._service.story.note(launch.name, f"a later one would not have the changed tree: {error}")
