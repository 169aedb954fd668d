"""A run of the last branch: keep its root placed, and follow it until it has finished or its time is over."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

from backbone.bus.interface import Bus, Clock
from backbone.component.messages import AskStory, Story, StoryEvent
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.launcher.last_branch import LastBranch, how_it_finished
from backbone.naming import component_of
from backbone.waiting import first_of

ASK_AGAIN_S = 1.0  # chosen: each published event leads to a question at once; this covers lost events
STORY_TIME_S = 1.0  # chosen: a thousand round trips


async def run_last(
    last: LastBranch, bus: Bus, clock: Clock, address: str, keeping: Coroutine[Any, Any, str], until_s: float
) -> None:
    """Return when the branch is over; ``last`` then has the result. The caller stops what the branch started.

    Args:
        last: The decisions about the branch.
        address: Address of its root.
        keeping: Keeps its root placed; returns the reason of the order that stops it, or raises the refusal of its
            start.
        until_s: Deadline of the branch, in mission time.
    """
    kept = asyncio.create_task(keeping, name="keep the last branch")
    followed = asyncio.create_task(_finished(bus, clock, address), name="follow the last branch")
    await first_of(kept, followed, clock.sleep_until_s(until_s))
    if not followed.cancelled():
        last.finished(followed.result(), clock.now_s())
    elif kept.cancelled():
        last.finished("was not done: its time is over", clock.now_s())
    else:
        try:
            last.finished(f"stopped: {kept.result()}", clock.now_s())
        except Refusal as refusal:
            last.not_started(refusal.detail)


async def _finished(bus: Bus, clock: Clock, address: str) -> str:
    """Return how the behavior at this address finished, as soon as its story contains the end."""
    name, news = component_of(address), asyncio.Event()
    heard = bus.subscribe(address, Conversation.LOG, StoryEvent, lambda _event: news.set())
    try:
        while True:
            news.clear()
            with suppress(LinkError, Refusal):  # the behavior has not started yet, or restarts
                story = await bus.ask(address, AskStory(name), Story, within_s=STORY_TIME_S)
                if how := how_it_finished(story.events, name):
                    return how
            await first_of(news.wait(), clock.sleep_s(ASK_AGAIN_S * clock.rate))
    finally:
        heard.close()
