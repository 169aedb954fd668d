"""Links to the hub: messages wait during a short cut, are lost in a long one, and tokens show it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock
from backbone.component.messages import AskStory, Story
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.rc_manager.messages import Beat
from backbone.wire import Envelope
from mission_control.laboratory.simulation.simulated_links import (
    LINK_LEASE_S,
    RECONNECT_AFTER_S,
    LinkedBus,
    LinkedNetwork,
)
from mission_control.laboratory.simulation.simulated_processes import ProcessLoop, SimulatedProcess, run_processes

CLOCK = VirtualClock()
SERVER = "resource_pool/server"


class Scene:
    """A hub, one who asks and listens, one who answers and speaks."""

    def __init__(self) -> None:
        self.network = LinkedNetwork("local", "nameserver")
        self.hub, self.near, self.far = (self.process(name, pid) for pid, name in enumerate(("nameserver", "a", "b")))
        self.asker, self.server = self._join(self.near, "resource_pool/asker"), self._join(self.far, SERVER)
        self.seen: list[tuple[float, bool]] = []
        self.link: list[tuple[float, bool]] = []
        self.heard: list[tuple[float, str]] = []
        self.server.serve(SERVER, AskStory, self._answer)
        self.far.run(self.server.declare_alive, SERVER)
        self.near.run(self.asker.watch_alive, SERVER, lambda _, alive: self.seen.append((now_s(), alive)))
        self.far.run(self.server.watch_link, lambda up: self.link.append((now_s(), up)))
        self.asker.subscribe(SERVER, Conversation.BEAT, Beat, lambda e: self.heard.append((now_s(), e.body.arc)))

    def process(self, name: str, pid: int) -> SimulatedProcess:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, ProcessLoop)
        process = SimulatedProcess(loop, name, f"h{pid}", pid)
        self.network.begin(process)
        return process

    def _join(self, process: SimulatedProcess, source: str) -> LinkedBus:
        return process.run(self.network.join, source, CLOCK)

    async def _answer(self, asked: Envelope[Any]) -> Story:
        return Story([])

    async def ask(self, within_s: float = 1.0) -> Story:
        asking = self.asker.ask(SERVER, AskStory("x"), Story, within_s=within_s)
        return await asyncio.get_running_loop().create_task(asking, context=self.near.context.copy())

    def beat(self, arc: str) -> None:
        self.far.run(self.server.publish, SERVER, Conversation.BEAT, Beat(arc))


def now_s() -> float:
    return round(CLOCK.now_s(), 3)


def play(body: Callable[[Scene], Awaitable[None]]) -> None:
    async def main() -> None:
        scene = Scene()
        await CLOCK.sleep_until_s(1.0)
        assert (scene.seen, scene.link) == ([(0.0, True)], [(0.0, True)])
        scene.seen.clear()
        scene.link.clear()
        await body(scene)

    run_processes(main())


def test_a_short_cut_is_seen_by_nobody_and_what_is_said_comes_when_it_heals() -> None:
    async def body(scene: Scene) -> None:
        scene.network.cut(scene.far)
        scene.beat("first")
        asking = asyncio.create_task(scene.ask(within_s=2.0))
        await CLOCK.sleep_until_s(2.0)
        scene.network.heal(scene.far)
        await asking
        await CLOCK.sleep_until_s(5.0)
        assert scene.heard == [(2.0, "first")]
        assert (scene.seen, scene.link) == ([], [])

    play(body)


def test_a_cut_longer_than_a_lease_is_seen_at_both_ends_and_what_was_said_is_lost() -> None:
    async def body(scene: Scene) -> None:
        scene.network.cut(scene.far)
        scene.beat("lost")
        asking = asyncio.create_task(scene.ask(within_s=30.0))
        with pytest.raises(NoResponder):
            await asking
        assert now_s() == 1.0 + LINK_LEASE_S
        with pytest.raises(NoResponder):
            await scene.ask()
        await CLOCK.sleep_until_s(6.0)
        scene.network.heal(scene.far)
        await CLOCK.sleep_until_s(7.0)
        await scene.ask()
        assert scene.heard == []
        assert scene.seen == scene.link == [(1.0 + LINK_LEASE_S, False), (6.0 + RECONNECT_AFTER_S, True)]

    play(body)


def test_a_paused_process_learns_of_its_lost_link_when_it_goes_on() -> None:
    async def body(scene: Scene) -> None:
        scene.far.pause()
        scene.network.pause(scene.far)
        await CLOCK.sleep_until_s(9.0)
        assert (scene.seen, scene.link) == ([(1.0 + LINK_LEASE_S, False)], [])
        scene.far.go_on()
        scene.network.go_on(scene.far)
        await CLOCK.sleep_until_s(10.0)
        assert scene.link == [(9.0, False), (9.0 + RECONNECT_AFTER_S, True)]

    play(body)


def test_one_that_was_paused_too_long_also_learns_of_a_death_meanwhile() -> None:
    async def body(scene: Scene) -> None:
        scene.near.pause()
        scene.network.pause(scene.near)
        await CLOCK.sleep_until_s(2.0)
        scene.far.die()
        scene.network.end(scene.far)
        await CLOCK.sleep_until_s(9.0)
        scene.near.go_on()
        scene.network.go_on(scene.near)
        await CLOCK.sleep_until_s(10.0)
        assert scene.seen == [(9.0, False)]

    play(body)


def test_the_death_of_a_process_is_seen_at_once_and_that_of_the_hub_by_everybody() -> None:
    async def body(scene: Scene) -> None:
        asking = asyncio.create_task(scene.ask(within_s=30.0))
        scene.hub.die()
        scene.network.end(scene.hub)
        with pytest.raises(NoResponder):
            await asking
        await CLOCK.sleep_until_s(1.5)
        assert scene.seen == scene.link == [(1.0, False)]
        scene.process("nameserver", 9)
        await CLOCK.sleep_until_s(2.0)
        assert scene.seen == scene.link == [(1.0, False), (1.5 + RECONNECT_AFTER_S, True)]
        await scene.ask()
        scene.far.die()
        scene.network.end(scene.far)
        await CLOCK.sleep_until_s(2.1)
        assert scene.seen[-1] == (2.0, False)

    play(body)


def test_a_host_that_is_cut_off_also_cuts_off_what_begins_there_meanwhile() -> None:
    async def body(scene: Scene) -> None:
        scene.network.cut_host("h2")
        newcomer = SimulatedProcess(asyncio.get_running_loop(), "c", "h2", 5)  # type: ignore[arg-type]
        link = scene.network.begin(newcomer)
        await CLOCK.sleep_until_s(2.0)
        assert not link.is_up
        scene.network.heal_host("h2")
        await CLOCK.sleep_until_s(3.0)
        assert link.is_up

    play(body)
