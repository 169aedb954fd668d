"""A console ends when the link comes back to a later mission of the same name, whose time its clock does not show."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from driven_console import grant_at_once
from fake_resource_pool import FakePlacer
from held_robot import console_launch

from backbone.bus.clock import VirtualClock
from backbone.bus.interface import LinkListener, Subscription
from backbone.bus.local_bus import LocalBus
from ui_console.session.observer import Observer
from ui_console.session.teleoperation import Teleoperation


class EarlierClock(VirtualClock):
    """The clock of a mission that began an hour before the present one."""

    def now_s(self) -> float:
        return super().now_s() + 3600.0


class CutBus(LocalBus):
    """A bus whose link is down for a second from ``cut`` on."""

    listeners: list[LinkListener]

    def watch_link(self, listener: LinkListener) -> Subscription:
        self.listeners = [*getattr(self, "listeners", []), listener]
        return super().watch_link(listener)

    async def cut(self) -> None:
        for is_up in (False, True):
            await asyncio.sleep(1.0)
            for listener in self.listeners:
                listener(is_up)


def teleoperation(bus: CutBus, clock: VirtualClock) -> Observer[Any]:
    launch = console_launch({"robot": "scout1", "kind": "video_drive"})
    return Teleoperation(launch, bus, clock, show=lambda event: None, watches=False)


def observer(bus: CutBus, clock: VirtualClock) -> Observer[Any]:
    return Observer(console_launch({}), bus, clock, show=lambda event: None)


@pytest.mark.parametrize("make", [teleoperation, observer])
@pytest.mark.parametrize(("clock", "goes_on"), [(EarlierClock(), False), (VirtualClock(), True)], ids=["later", "same"])
def test_a_console_ends_with_its_mission_also_if_a_later_one_has_its_name(
    placer_world: Any,
    make: Callable[[CutBus, VirtualClock], Observer[Any]],
    clock: VirtualClock,
    goes_on: bool,
) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        bus = CutBus(placer.network, "ui_console/console-7", clock)
        console = make(bus, clock)
        life = asyncio.create_task(console.run())
        await placer.wait(lambda: console.state == "ready")
        await bus.cut()
        await asyncio.sleep(10.0)
        assert life.done() != goes_on
        console.end("the test is over")
        await life

    placer_world(scene)
