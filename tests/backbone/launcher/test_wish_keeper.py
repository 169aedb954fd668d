"""A root that a change of the tree insists on is wanted, and absent, until its start succeeds."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from itertools import pairwise
from typing import Any

import msgspec
import pytest

from backbone.addresses import LAUNCHER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.creator.messages import StartFailed
from backbone.launcher.other_hosts import OtherHosts
from backbone.launcher.wish_keeper import WishKeeper
from backbone.mission.reader import read_mission_bytes
from backbone.naming import Subsystem
from backbone.placer.messages import AskPlacement, Placement, Start, Started
from backbone.placer.wishes import PAUSE_MOST_S
from backbone.wire import Envelope

MISSION = read_mission_bytes(b'<mission name="m" priority="10"/>', "m.xml")
OLD, NEW = Start("wait", "dawn", {"seconds": 1}), Start("wait", "dawn", {"seconds": 2})
AT = "mission_control/dawn"


class Scene:
    """A launcher's wishes, and a placer that refuses starts as long as ``refuses``."""

    def __init__(self, network: LocalNetwork, launcher: Component[NoParameters], clock: VirtualClock) -> None:
        self.clock, self.newest, self.refuses = clock, OLD, True
        self.asked: list[tuple[float, Start]] = []
        self.wishes = WishKeeper(launcher, MISSION, OtherHosts(MISSION, 0.0), lambda _order: self.newest)
        self._root, placer = network.join(AT, clock), network.join(PLACER, clock)
        placer.serve(PLACER, Start | AskPlacement, self._place)
        placer.declare_alive(PLACER)

    async def _place(self, asked: Envelope[Any]) -> Any:
        if isinstance(asked.body, AskPlacement):
            return Placement("dawn", "wait", "base", LAUNCHER, 0.0, [])
        self.asked.append((self.clock.now_s(), asked.body))
        if self.refuses:
            raise StartFailed("no camera")
        self._root.declare_alive(AT)
        return Started(AT, "base", 7, [])


Play = Callable[[Callable[[Scene], Awaitable[None]]], None]


@pytest.fixture
def scene(local_mission: Callable[..., Any], beside: Callable[..., Any]) -> Play:
    def run(body: Callable[[Scene], Awaitable[None]]) -> None:
        async def main() -> None:
            async with local_mission() as network:
                clock = VirtualClock()
                launch = Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", "base", "", 0.0, 1.0)
                launcher = Component[NoParameters](launch, network.join(LAUNCHER, clock), clock)
                async with beside(launcher):
                    await body(Scene(network, launcher, clock))

        run_virtual(main())

    return run


def test_a_root_whose_start_is_refused_is_absent_and_is_asked_for_ever_less_often(scene: Play) -> None:
    async def body(one: Scene) -> None:
        await one.wishes.begin_root(OLD, insists=True)
        await one.clock.sleep_s(60.0)
        [absence] = one.wishes.absences()
        assert (absence.name, absence.cause) == ("dawn", "no camera")
        pauses = [round(later - earlier, 3) for (earlier, _), (later, _) in pairwise(one.asked)]
        assert pauses == sorted(pauses)
        assert pauses[-1] >= PAUSE_MOST_S

    scene(body)


def test_it_starts_as_the_tree_declares_it_by_then(scene: Play) -> None:
    async def body(one: Scene) -> None:
        await one.wishes.begin_root(OLD, insists=True)
        await one.clock.sleep_s(3.0)
        one.newest, one.refuses = NEW, False
        await one.clock.sleep_s(PAUSE_MOST_S)
        assert msgspec.structs.replace(one.asked[-1][1], order_id="") == NEW
        assert one.wishes.absences() == []

    scene(body)


def test_a_root_that_leaves_the_tree_meanwhile_is_neither_wanted_nor_absent(scene: Play) -> None:
    async def body(one: Scene) -> None:
        await one.wishes.begin_root(OLD, insists=True)
        await one.clock.sleep_s(3.0)
        await one.wishes.leave_root("dawn")
        asked = len(one.asked)
        await one.clock.sleep_s(60.0)
        assert (one.wishes.absences(), len(one.asked)) == ([], asked)

    scene(body)


def test_a_root_that_is_added_and_refused_is_not_wanted(scene: Play) -> None:
    async def body(one: Scene) -> None:
        with pytest.raises(StartFailed):
            await one.wishes.begin_root(OLD, insists=False)
        await one.clock.sleep_s(60.0)
        assert (one.wishes.absences(), len(one.asked)) == ([], 1)

    scene(body)
