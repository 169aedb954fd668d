"""A changed priority reaches each ARC below it, because the next RC manager learns it from the ARCs alone."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.rc_manager.messages import AskAttributes, AskRequest, CurrentRequest, Done, SetPriority, TakePath
from backbone.scheduling.requests import PathNode
from backbone.scheduling.views import Attributes
from backbone.wire import Envelope, Message
from resource_pool.arcs.drive import DriveArc

ROBOTS = ["scout1", "scout2", "radio"]
ARC = "watcher-drive"


class LossyDrive(DriveArc):
    """An ARC that some of the RC manager's messages do not reach."""

    lost = 0
    paths: list[list[PathNode]]

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.paths = []

    async def answer(self, asked: Envelope[Message]) -> Message:
        if isinstance(asked.body, TakePath):
            if self.lost:
                self.lost -= 1
                await asyncio.Event().wait()
            self.paths.append(asked.body.path)
        return await super().answer(asked)


async def set_priority(pool: Pool, priority: int) -> None:
    await pool.ear.ask(RC_MANAGER, SetPriority("watcher", priority), Done, within_s=1)


async def path_of(pool: Pool) -> list[PathNode]:
    """Return the path that the next RC manager would get."""
    current = await pool.manager_voice.ask(f"resource_pool/{ARC}", AskRequest(), CurrentRequest, within_s=1)
    return current.request.path


def with_priority(priority: int) -> list[PathNode]:
    return [PathNode("local", 10), PathNode("watcher", priority)]


@pytest.mark.parametrize("lost", [1, 3])
def test_a_path_that_did_not_reach_its_arc_is_sent_again(local_mission: Any, lost: int) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, arc_classes={"drive": LossyDrive}) as pool:
            await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            arc = cast("LossyDrive", pool.running[ARC])
            arc.lost = lost
            await set_priority(pool, 7)
            await pool.clock.sleep_s(2.0 * lost)
            assert await path_of(pool) == with_priority(7)
            await pool.clock.sleep_s(5.0)
            assert len(arc.paths) == 1, "a path that arrived is not repeated"

    run_virtual(main())


def test_an_older_path_is_not_repeated_after_a_newer_one(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, arc_classes={"drive": LossyDrive}) as pool:
            await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            arc = cast("LossyDrive", pool.running[ARC])
            arc.lost = 1
            for priority in (7, 8):
                await set_priority(pool, priority)
                await pool.clock.sleep_s(0.1)
            await pool.clock.sleep_s(5.0)
            assert await path_of(pool) == with_priority(8)
            assert arc.paths == [with_priority(8)]

    run_virtual(main())


def test_an_arc_that_starts_anew_learns_the_priority_that_was_set_before(local_mission: Any) -> None:
    """It starts by the mission file; a restart of the RC manager would undo what the operator has set."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            await pool.arc(owner, "drive", "scout1")
            await set_priority(pool, 7)
            await pool.kill(ARC)
            await pool.clock.sleep_s(0.5)
            await pool.arc(owner, "drive", "scout1")
            await pool.clock.sleep_s(0.5)
            assert await path_of(pool) == with_priority(7)
            await pool.kill("rc_manager")
            await pool.manager()
            await pool.clock.sleep_s(0.5)
            [found] = (await pool.ear.ask(RC_MANAGER, AskAttributes(ARC), Attributes, within_s=1)).requests
            assert found.path == with_priority(7)

    run_virtual(main())
