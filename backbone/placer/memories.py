"""Memories: what components left for their next processes, on whichever host these are.

A component also keeps its memory on its own host, but that host may be lost or cut off.
"""

from __future__ import annotations

import logging

import msgspec

from backbone.atomic_file import replace_file
from backbone.kept_file import KeptFile
from backbone.placer.messages import KeepMemory

log = logging.getLogger(__name__)


class Memories:
    """The memories of a mission's components; files of the mission's folder keep them for the next placer.

    Args:
        run_directory: The mission's folder on the placer's host; empty: only this placer knows them.
    """

    def __init__(self, run_directory: str) -> None:
        self._file = KeptFile(run_directory, "memories", "")
        self._kept: dict[str, KeepMemory] = {}

    def keep(self, name: str, memory: KeepMemory) -> None:
        """Replace the memory of the component; a write error only loses it for the next placer."""
        self._kept[name] = memory
        try:
            if (target := self._file.of(name).target()) is not None:
                replace_file(target, msgspec.msgpack.encode(memory), is_lasting=False)
        except OSError as error:
            log.warning("a restart of the placer will not know the memory of %s: %s", name, error)

    def of(self, name: str, order_id: str) -> bytes:
        """Return the component's memory of this order; empty: none."""
        memory = self._kept.get(name) or self._read(name)
        return memory.content if memory is not None and memory.order_id == order_id else b""

    def forget(self, name: str) -> None:
        """Remove the memory of a component that an order has stopped."""
        self._kept.pop(name, None)
        try:
            if (path := self._file.of(name).path) is not None:
                path.unlink(missing_ok=True)
        except OSError as error:
            log.warning("the memory of %s stays: %s", name, error)

    def _read(self, name: str) -> KeepMemory | None:
        try:
            found = self._file.of(name).read()
            return None if found is None else msgspec.msgpack.decode(found, type=KeepMemory)
        except (OSError, msgspec.DecodeError) as error:
            log.warning("the memory of %s is lost: %s", name, error)
            return None
