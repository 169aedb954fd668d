"""A stage for the web console: see ``web_stage``."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from web_stage import MISSION, RIGHTS, WITHIN_S, Stage

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import MissionClock
from ui_console.web.login import Authenticator
from ui_console.web.server import WebServer


@pytest.fixture
async def stage(local_mission: Any) -> AsyncIterator[Stage]:
    clock = MissionClock.started_now()
    async with local_mission(MISSION, clock) as network:
        placer = FakePlacer(network, clock, {})
        rc_manager = network.join(RC_MANAGER, clock)
        made = Stage(network, clock, placer, rc_manager)
        is_ready = asyncio.Event()

        def ready(port: int) -> None:
            made.port = port
            is_ready.set()

        serving = asyncio.create_task(
            WebServer(made.hub, Authenticator(RIGHTS)).run("127.0.0.1", 0, ready), name="server"
        )
        try:
            async with asyncio.timeout(WITHIN_S):
                await is_ready.wait()
            await placer.wait(lambda: made.hub.observer.state == "ready")
            yield made
        finally:
            made.hub.observer.end("the test is over")
            await asyncio.wait({serving})
            await made.close()
            await placer.close()
            await rc_manager.close()
        serving.result()
