"""Priorities and places that an operator set hold after a restart of the RC manager, with or without an ARC."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import pytest
from rc_manager_at_work import PlainArc, Pool, request

from backbone.addresses import LAUNCHER, RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.creator.messages import ReviseSpawn, SpawnRevised
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskAttributes, Done, MoveNode, SetPriority
from backbone.rc_manager.service import RcManager
from backbone.scheduling.events import KeptTree
from backbone.scheduling.requests import PathNode, SchedulingRequest
from backbone.scheduling.views import Attributes
from backbone.wire import Envelope, Message


class PlayedLauncher(Component[Any]):
    """Keeps the parameters of the RC manager's next start."""

    accepts = ReviseSpawn

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.kept: dict[str, Any] = {}
        self.lost, self.answered = 0, 0

    @property
    def tree(self) -> KeptTree:
        return msgspec.convert(self.kept["tree"], KeptTree)

    async def answer(self, asked: Envelope[Message]) -> Message:
        assert isinstance(asked.body, ReviseSpawn)
        if self.lost:
            self.lost -= 1
            await asyncio.Event().wait()
        self.answered += 1
        self.kept = asked.body.parameters
        return SpawnRevised()


@asynccontextmanager
async def a_launcher(here: Pool) -> AsyncIterator[PlayedLauncher]:
    launch = Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", "here", "", 0.0, 1.0)
    launcher = PlayedLauncher(launch, here.network.join(LAUNCHER, here.clock), here.clock)
    async with here.beside(launcher):
        yield launcher


def next_manager(here: Pool, launcher: PlayedLauncher) -> RcManager:
    return here.manager(requester=LAUNCHER, **launcher.kept)


async def tell(arc: PlainArc, order: Message) -> None:
    """Order it as an operator; the ARC's bus is as good as another."""
    await arc.bus.ask(RC_MANAGER, order, Done, within_s=1)
    await arc.clock.sleep_s(0.1)


async def path_of(arc: PlainArc) -> list[tuple[str, int]]:
    [found] = (await arc.bus.ask(RC_MANAGER, AskAttributes(arc.name), Attributes, within_s=1)).requests
    return [(node.name, node.priority) for node in found.path]


def below(arc: str, *path: str) -> SchedulingRequest:
    """Ask as the behavior ``path[-1]``, by the mission file: all its nodes have the number 1."""
    nodes = [PathNode("local", 10), *(PathNode(name, 1) for name in path)]
    return msgspec.structs.replace(request(arc, "video"), path=nodes)


Case = Callable[[Pool, PlayedLauncher, PlainArc], Awaitable[None]]


def run_case(pool: Any, case: Case) -> None:
    async def main() -> None:
        async with pool() as here, a_launcher(here) as launcher:
            await case(here, launcher, await here.arc("one"))

    run_virtual(main())


def test_a_console_without_a_request_keeps_the_priority_that_was_set(pool: Any) -> None:
    async def case(here: Pool, launcher: PlayedLauncher, arc: PlainArc) -> None:
        async with here.beside(next_manager(here, launcher)):
            await tell(arc, SetPriority("console-one", 5))
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(request("one", "video", priority=100))
            assert await path_of(arc) == [("console-one", 5)]

    run_case(pool, case)


def test_a_behavior_that_begins_anew_after_the_restart_has_the_priorities_that_were_set(pool: Any) -> None:
    async def case(here: Pool, launcher: PlayedLauncher, arc: PlainArc) -> None:
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(below("one", "patrol", "left"))
            for node, priority in (("left", 7), ("patrol", 8), ("local", 30)):
                await tell(arc, SetPriority(node, priority))
        arc.request = None
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(below("one", "patrol", "left"))
            assert await path_of(arc) == [("local", 30), ("patrol", 8), ("left", 7)]

    run_case(pool, case)


def test_a_moved_node_that_begins_anew_after_the_restart_is_in_its_new_place(pool: Any) -> None:
    """Nothing else below its new parent has asked by then."""

    async def case(here: Pool, launcher: PlayedLauncher, arc: PlainArc) -> None:
        other = await here.arc("other")
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(below("one", "patrol", "left"))
            await other.ask_for(below("other", "home"))
            await tell(arc, MoveNode("left", "home"))
        arc.request = other.request = None
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(below("one", "patrol", "left"))
            assert await path_of(arc) == [("local", 10), ("home", 1), ("left", 1)]
            await tell(arc, MoveNode("left", "local"))
        async with here.beside(next_manager(here, launcher)):
            await arc.ask_for(below("one", "patrol", "left"))
            assert await path_of(arc) == [("local", 10), ("left", 1)]

    run_case(pool, case)


@pytest.mark.parametrize("lost", [1, 3])
def test_a_change_that_did_not_reach_the_launcher_is_sent_again(pool: Any, lost: int) -> None:
    async def case(here: Pool, launcher: PlayedLauncher, arc: PlainArc) -> None:
        launcher.lost = lost
        async with here.beside(next_manager(here, launcher)):
            await tell(arc, SetPriority("console-one", 5))
            await here.clock.sleep_s(2.0 * lost)
            assert launcher.tree.priorities == {"console-one": 5}
            await here.clock.sleep_s(5.0)
            assert launcher.answered == 1, "a change that arrived is not repeated"

    run_case(pool, case)


def test_an_older_change_is_not_repeated_after_a_newer_one(pool: Any) -> None:
    async def case(here: Pool, launcher: PlayedLauncher, arc: PlainArc) -> None:
        launcher.lost = 1
        async with here.beside(next_manager(here, launcher)):
            for priority in (7, 8):
                await tell(arc, SetPriority("console-one", priority))
            await here.clock.sleep_s(5.0)
            assert launcher.answered == 1
            assert launcher.tree.priorities == {"console-one": 8}

    run_case(pool, case)
