"""A complete ARC to copy from: a robot that drives with its lamp on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from resource_pool.arcs.drive import DriveArc
from resource_pool.commands import Command
from resource_pool.rcs.skeleton import Shine


class LitDriveArc(DriveArc):
    """The set of ``DriveArc`` and a lamp; during a grant the lamp has the brightness that the owner chose."""

    roles: ClassVar[Sequence[str]] = (*DriveArc.roles, "lamp")
    commands: ClassVar[Mapping[type[Command], str]] = {**DriveArc.commands, Shine: "lamp"}

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Switch the lamp on; the lamp's RC switches it off when the set is given back."""
        await self.tell_rc("lamp", epochs[self.rc("lamp")], Shine(1.0))
