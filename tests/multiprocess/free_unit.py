"""An execution unit for tests of real processes: it registers nowhere, so no nameserver is needed."""

from __future__ import annotations

from mission_control.modules.unit_component import UnitComponent


class FreeUnit(UnitComponent):
    registers = False
