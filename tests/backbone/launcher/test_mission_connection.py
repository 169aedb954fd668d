"""Connections to missions elsewhere."""

from __future__ import annotations

import pytest
from free_ports import free_endpoint

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.errors import NoResponder
from backbone.launcher.mission_connection import clock_elsewhere


async def test_a_hub_of_another_mission_is_told_from_a_silent_one() -> None:
    endpoint = free_endpoint()
    hub = ZenohBus.open("patrol", NAMESERVER, MissionClock.started_now(), hub_config([endpoint]))
    try:
        with pytest.raises(NoResponder, match=f"the hub at {endpoint} has no mission partol"):
            await clock_elsewhere("partol", endpoint, "ui_console/tester")
    finally:
        await hub.close()
