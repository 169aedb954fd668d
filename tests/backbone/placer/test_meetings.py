"""The placer finds a living creator again although it did not hear of its return."""

from __future__ import annotations

import asyncio

import pytest
from placer_at_work import Mission, on

from backbone.addresses import NAMESERVER
from backbone.keys import Conversation
from backbone.nameserver.messages import Disappeared


@pytest.mark.parametrize("host", ["a", "b"])
@pytest.mark.parametrize("times", [1, 50])
def test_a_creator_that_reports_its_load_is_not_lost(host: str, times: int) -> None:
    """The news of its return may have been dropped while the placer was paused. The placer is on host a."""

    @on("a", "b")
    async def lose_sight(one: Mission) -> None:
        await one.start("watcher", "w", host=host)
        for _ in range(times):
            one.bus.publish(NAMESERVER, Conversation.EVENTS, Disappeared(one.creators[host].address))
            await one.clock.sleep_s(0.01)
        assert await one.placements() == {"w": ""}
        one.creators[host].tell_load()
        await one.clock.sleep_s(1.0)
        assert await one.placements() == {"w": host}
        assert one.creators[host].spawns == ["w"], "it is not started twice"

    lose_sight()


@on("a", "b")
async def test_a_creator_that_drains_gets_nothing_although_it_reports_its_load(one: Mission) -> None:
    creator = one.creators["a"]
    await one.start("watcher", "w", host="a")
    creator.drain_s = 3.0
    ending = asyncio.create_task(one.kill("creator-a"))
    await one.clock.sleep_s(0.5)
    creator.tell_load()
    await one.clock.sleep_s(1.0)
    assert (await one.start("watcher", "w2")).host == "b"
    await ending
