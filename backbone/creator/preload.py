"""Modules that a creator's zygote imports beforehand, so that a component's start does not wait for them."""

from __future__ import annotations

from collections.abc import Iterable

from backbone.component_database.messages import ComponentType


def arc_modules(types: Iterable[ComponentType]) -> list[str]:
    """Return the modules of the ARCs among these types, each once, in order of name.

    ARCs start while a person waits for a robot; all other components start with the mission.

    Example:
        >>> from backbone.naming import Subsystem
        >>> drive = ComponentType("drive", "lab.drive:Drive", Subsystem.RESOURCE_POOL, needs={"scout": "scout"})
        >>> arc_modules([drive, ComponentType("scout", "lab.scout:Scout", Subsystem.RESOURCE_POOL)])
        ['lab.drive']
    """
    return sorted({one.class_path.partition(":")[0] for one in types if one.needs})
