"""Behaviors for tests, and a placer that starts them."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any, ClassVar

from fake_resource_pool import FakePlacer

from backbone.component.component import Component
from backbone.mission.behavior_orders import behavior_order
from backbone.placer.messages import Ended, StopComponent
from mission_control.behavior import Behavior
from mission_control.children import Decision
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import Frame

ARC = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
MADE: list[Any] = []
"""Implementations that a test's own class was made to."""


async def stop(placer: FakePlacer, name: str) -> None:
    """Stop a component as an operator does."""
    operator = placer.network.join("ui_console/cli", placer.clock)
    await operator.ask("backbone/placer", StopComponent(name, "by command"), Ended, within_s=5.0)
    await operator.close()


class Watcher(Behavior[Any]):
    """Writes down all it hears."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.heard: list[Any] = []

    async def start(self) -> None:
        self.heard.append("start")

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        self.heard.append(("resumed", dict(rcs)))

    async def suspending(self, deadline_s: float) -> None:
        self.heard.append(("suspending", deadline_s))

    async def suspended(self, reason: str, by: str) -> None:
        self.heard.append(("suspended", reason, by))

    def see(self, frame: Frame) -> None:
        self.heard.append(("frame", frame.epoch, frame.number))


class Parent(Behavior[Any]):
    """Decides by a list."""

    decisions: ClassVar[list[Decision]] = []

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.finished: list[tuple[str, BehaviorStatus, dict[str, Any]]] = []

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, Any]) -> Decision:
        self.finished.append((child, status, dict(payload)))
        return self.decisions[len(self.finished) - 1]


class Sequence(Parent):
    children_together = False


class Driver(Behavior[Any]):
    """Drives while it may."""

    async def act(self) -> None:
        while True:
            await self.arc.drive(4.0, 4.0)
            await self.clock.sleep_s(0.1)


class Starter(Driver):
    """Commands its robot at the begin of each grant already."""

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        await self.arc.halt()


class Stubborn(Driver):
    """Goes on for a while after each cancellation."""

    async def act(self) -> None:
        try:
            await super().act()
        finally:
            await self.clock.sleep_s(0.5)


class Canceller(Behavior[Any]):
    """Cancels its own task."""

    async def act(self) -> None:
        task = asyncio.current_task()
        assert task is not None
        task.cancel()
        await self.clock.sleep_s(0.1)


class Closer(Behavior[Any]):
    """Closes its bus."""

    async def act(self) -> None:
        await self.bus.close()


class Forgetful(Behavior[Any]):
    """Returns without ``finish``."""

    async def act(self) -> None:
        self.report("waves")


class Seer(Forgetful):
    """Finishes at a picture."""

    def see(self, frame: Frame) -> None:
        self.finish(BehaviorStatus.SUCCESS)


class Finisher(Behavior[Any]):
    """Finishes at the end of ``act``."""

    async def act(self) -> None:
        self.finish(BehaviorStatus.SUCCESS)


class Spectator(Behavior[Any]):
    """Only looks."""


CLASSES: dict[str, type[Component[Any]]] = {
    "spectator": Spectator,
    "watcher": Watcher,
    "parent": Parent,
    "sequence": Sequence,
    "driver": Driver,
    "starter": Starter,
    "stubborn": Stubborn,
    "canceller": Canceller,
    "closer": Closer,
    "forgetful": Forgetful,
    "seer": Seer,
    "finisher": Finisher,
}


def node(name: str, kind: str = "watcher", priority: int = 3, **rest: Any) -> dict[str, Any]:
    return {"type": kind, "name": name, "priority": priority, **rest}


async def root(placer: FakePlacer, behavior: dict[str, Any]) -> Any:
    return await placer.launch(behavior_order(behavior, [("iros2001", 10)]))
