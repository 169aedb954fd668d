"""Folder watch: notices that the folder of a mission's files was removed."""

from __future__ import annotations

import os
from pathlib import Path

from backbone.atomic_file import is_at
from backbone.bus.interface import Clock

LOOK_EVERY_S = 5.0  # chosen: soon enough for a mission that no command finds; seconds of the machine


async def wait_removed(folder: Path, clock: Clock) -> None:
    """Return when the folder is no longer at its path."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        while is_at(descriptor, folder):
            await clock.sleep_s(LOOK_EVERY_S * clock.rate)
    finally:
        os.close(descriptor)
