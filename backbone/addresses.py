"""Addresses of the launcher and the core services, which are the same in every mission."""

from __future__ import annotations

from backbone.naming import Subsystem, address

LAUNCHER = address(Subsystem.BACKBONE, "launcher")
NAMESERVER = address(Subsystem.BACKBONE, "nameserver")
COMPONENT_DATABASE = address(Subsystem.BACKBONE, "component_database")
PLACER = address(Subsystem.BACKBONE, "placer")
DEPENDENCY_DATABASE = address(Subsystem.BACKBONE, "dependency_database")
RC_MANAGER = address(Subsystem.BACKBONE, "rc_manager")
