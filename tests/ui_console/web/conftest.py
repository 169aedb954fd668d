"""Stages for the web console: see ``web_stage``."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from web_stage import MISSION, RIGHTS, WITHIN_S, Stage

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import MissionClock
from ui_console.web.login import Authenticator, TokenRights
from ui_console.web.server import Console, WebServer, path_of


@pytest.fixture
async def stage(local_mission: Any) -> AsyncIterator[Stage]:
    async with served(local_mission, {MISSION: RIGHTS}) as made:
        yield made[0]


@pytest.fixture
async def stages(local_mission: Any) -> AsyncIterator[list[Stage]]:
    """Return two missions of one server: ``day`` with the usual tokens, ``night`` with others."""
    nightly = {f"{token}-night": granted for token, granted in RIGHTS.items()}
    async with served(local_mission, {"day": RIGHTS, "night": nightly}) as made:
        yield made


@asynccontextmanager
async def served(local_mission: Any, missions: Mapping[str, Mapping[str, TokenRights]]) -> AsyncIterator[list[Stage]]:
    """Serve missions with these rights from one server."""
    async with AsyncExitStack() as stack:
        made = [await stack.enter_async_context(staged(local_mission, name)) for name in missions]
        is_ready = asyncio.Event()

        def ready(port: int) -> None:
            for one in made:
                one.port, one.path = port, path_of(one.hub.mission, is_alone=len(made) == 1)
            is_ready.set()

        consoles = [
            Console(one.hub, Authenticator(rights)) for one, rights in zip(made, missions.values(), strict=True)
        ]
        serving = asyncio.create_task(WebServer(*consoles).run("127.0.0.1", 0, ready), name="server")
        try:
            async with asyncio.timeout(WITHIN_S):
                await is_ready.wait()
            for one in made:
                await one.placer.wait(lambda one=one: one.hub.observer.state == "ready")  # type: ignore[misc]
            yield made
        finally:
            for one in made:
                one.hub.observer.end("the test is over")
            await asyncio.wait({serving})
        serving.result()


@asynccontextmanager
async def staged(local_mission: Any, name: str) -> AsyncIterator[Stage]:
    clock = MissionClock.started_now()
    async with local_mission(name, clock) as network:
        placer = FakePlacer(network, clock, {})
        rc_manager = network.join(RC_MANAGER, clock)
        made = Stage(network, clock, placer, rc_manager)
        try:
            yield made
        finally:
            await made.close()
            await placer.close()
            await rc_manager.close()
