"""Modules that a creator's zygote imports beforehand: components start sooner, and share the memory of these modules.

A module that only one component uses is imported beforehand, too. An import after the fork would write into many pages
that the component shares with its zygote, and would repeat imports of other components. Only shipped modules are: a
restarted component gets the preloaded code, and the files of others are edited while a mission runs.

Pure.
"""

from __future__ import annotations

from collections.abc import Iterable

from backbone.component_database.messages import ComponentType
from backbone.shipped import is_shipped


def preloaded_modules(types: Iterable[ComponentType], placed: Iterable[str] = ()) -> list[str]:
    """Return the modules of the shipped ARCs among these types, and of shipped types that are placed, by name.

    ARCs start while a person waits for a robot; all other components start with the mission. An ARC of one's own is not
    among them: its module imports the RCs and commands that it needs, and their edited files would not be read again.

    Args:
        placed: Types of the components that are placed.

    Example:
        >>> from backbone.naming import Subsystem
        >>> drive = ComponentType("drive", "resource_pool.drive:D", Subsystem.RESOURCE_POOL, needs={"scout": "scout"})
        >>> own = ComponentType("own", "lab.drive:Drive", Subsystem.RESOURCE_POOL, needs={"scout": "scout"})
        >>> watch = ComponentType("watch", "mission_control.watch:Watch", Subsystem.MISSION_CONTROL)
        >>> preloaded_modules([drive, own, watch], ["watch"])
        ['mission_control.watch', 'resource_pool.drive']
        >>> preloaded_modules([drive, own, watch])
        ['resource_pool.drive']
    """
    expected = set(placed)
    return sorted(
        {
            one.class_path.partition(":")[0]
            for one in types
            if (one.needs or one.name in expected) and is_shipped(one.class_path)
        }
    )
