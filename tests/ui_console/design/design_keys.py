"""Keys of the designer as a tutorial writes them, and classes that say little of themselves."""

from __future__ import annotations

import re
from collections.abc import Sequence

from textual.pilot import Pilot
from textual.widgets import Input

from ui_console.design.catalogue import ClassFacts, ParameterFacts

WATCH = "mission_control.behaviors.watch_for_motion:WatchForMotion"
FACTS = {
    WATCH: ClassFacts(
        "Looks for motion.",
        (ParameterFacts("view_s", "number", "0.0", "at least 0", "For how long what moves is in view."),),
    )
}


async def known(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    return {path: FACTS.get(path, ClassFacts("Documented elsewhere.")) for path in class_paths}


async def press(pilot: Pilot[None], keys: str) -> None:
    """Press what a line of the tutorial says; what is in quotes is put into the field, in place of what was there."""
    for typed, key in re.findall(r'"([^"]*)"|(\S+)', keys):
        if key:
            await pilot.press(key)
        else:
            pilot.app.screen.query_one(Input).value = typed
            await pilot.pause()


async def settle(pilot: Pilot[None]) -> None:
    """Let what was begun come to its end."""
    for _ in range(3):
        await pilot.pause()
