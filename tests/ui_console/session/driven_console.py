"""A console at a robot, beside a placer that its test plays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fake_resource_pool import FakeArc, FakePlacer
from held_robot import console_launch

from ui_console.model.events import ConsoleEvent
from ui_console.session.teleoperation import Teleoperation


def console(
    placer: FakePlacer, show: Callable[[ConsoleEvent], None], away_after_s: float = 0.0, **options: Any
) -> Teleoperation:
    parameters = {"robot": "scout1", "kind": "video_drive", "priority": 100, "away_after_s": away_after_s}
    launch = console_launch(parameters)
    bus = placer.network.join(launch.address, placer.clock)
    return Teleoperation(launch, bus, placer.clock, show=show, **options)


def grant_at_once(arc: FakeArc) -> None:
    arc.bus.start(arc.grant())
