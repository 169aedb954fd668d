"""The packages of this project, which tests have judged and which are not edited while a mission runs."""

from __future__ import annotations

PACKAGES = ("backbone", "mission_control", "resource_pool", "scout_model", "ui_console")


def is_shipped(path: str) -> bool:
    """Return whether a module or class path leads into a package of this project.

    Example:
        >>> is_shipped("resource_pool.rcs.scout:Scout"), is_shipped("lab.scout:Scout"), is_shipped("backbones.a:B")
        (True, False, False)
    """
    return path.partition(":")[0].partition(".")[0] in PACKAGES
