"""A component that publishes an event and a picture a hundred times a second, from numbers that grow."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from web_stage import Stage

from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from resource_pool.arc_client import Frame

SPEAKER = "resource_pool/watch-capture"
LOGGED = {"key": f"{SPEAKER}/log", "source": SPEAKER, "schema": "StoryEvent/1"}
PICTURES = {"key": f"{SPEAKER}/frames", "source": SPEAKER, "schema": "Frame/1"}
EACH_S = 0.01


def event(stage: Stage, number: int) -> StoryEvent:
    return StoryEvent(stage.clock.now_s(), SPEAKER, f"round {number}", "scout1", "", LogLevel.INFO)


@asynccontextmanager
async def speaker(stage: Stage) -> AsyncIterator[None]:
    bus = stage.network.join(SPEAKER, stage.clock)

    async def speak() -> None:
        for number in range(1_000_000):
            bus.publish(SPEAKER, Conversation.LOG, event(stage, number))
            picture = Frame("grabber", "watch", 1, "scout1", number, 0.0, 16, 12, bytes([200]) * 16 * 12)
            bus.publish(SPEAKER, Conversation.FRAMES, picture)
            await asyncio.sleep(EACH_S)

    speaking = asyncio.create_task(speak())
    try:
        yield
    finally:
        speaking.cancel()
        await asyncio.wait({speaking})
        await bus.close()
