"""A console on a virtual clock, and the ARC and the RC of the robot that it holds."""

from __future__ import annotations

from typing import Any

from fake_resource_pool import FakeArc, FakePlacer

from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from resource_pool.arc_client import EmergencyStopped
from resource_pool.commands import Drive as ArcDrive
from resource_pool.commands import Move as ArcMove
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop, EmergencyStop, LiftStop
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import MoveWish
from ui_console.session.teleoperation import Teleoperation

FORWARD = MoveWish(0.1, 0.0)
REPEAT_S = 0.05


def console_launch(parameters: dict[str, Any]) -> Launch:
    """Return how a console of these parameters is launched."""
    address = (Subsystem.UI_CONSOLE, "console-7", "console")
    return Launch("iros2001", *address, "in this process", "local", "", 0.0, 1.0, parameters)


class HeldRobot:
    """A console whose screens show what it hears, and the RC of the robot that it holds."""

    def __init__(self, placer: FakePlacer, *, is_scripted: bool = False) -> None:
        self.placer, self.clock = placer, placer.clock
        self.model = ConsoleModel("console-7", "anna")
        if not is_scripted:
            self.make_console(show=self.model.apply)
        self.latch = StopLatch("scout1")
        self.rc = placer.network.join("resource_pool/scout1", placer.clock)
        self.rc.serve("resource_pool/scout1", AskStop | EmergencyStop | LiftStop, self._answer)
        self.rc.declare_alive("resource_pool/scout1")

    def make_console(self, **options: Any) -> None:
        launch = console_launch({"robot": "scout1", "kind": "drive", "priority": 100})
        bus = self.placer.network.join(launch.address, self.clock)
        self.console = Teleoperation(launch, bus, self.clock, watches=False, user="anna", **options)

    @property
    def arc(self) -> FakeArc:
        return self.placer.arcs["console-7-drive"]

    def stop(self, by: str = "ben", reason: str = "") -> None:
        """Stop the robot: its RC refuses commands from now on, and publishes the stop."""
        self.latch.stop(by, reason, self.clock.now_s(), f"ui_console/{by}")
        for arc in self.placer.arcs.values():
            arc.refusal = EmergencyStopped(
                "scout1 was stopped", rc="scout1", number=self.latch.state.number, is_stopped=True
            )
        self.rc.publish("resource_pool/scout1", Conversation.EVENTS, self.latch.state)

    def lift(self) -> None:
        self.latch.lift(self.latch.state.number, "ben", self.clock.now_s())
        self.arc.refusal = None
        self.rc.publish("resource_pool/scout1", Conversation.EVENTS, self.latch.state)

    async def held(self) -> None:
        await self.placer.wait(lambda: self.placer.arcs)
        await self.arc.grant()
        await self.clock.sleep_s(0.1)

    async def hold_key(self, seconds: float, lasts_s: float | None = None) -> None:
        """Hold a control for so long."""
        until_s = self.clock.now_s() + seconds
        while self.clock.now_s() < until_s:
            self.console.hold(FORWARD, lasts_s)
            await self.clock.sleep_s(REPEAT_S)

    def drives(self) -> list[ArcMove | ArcDrive]:
        return [command for _at_s, _epoch, command in self.arc.commands if isinstance(command, ArcMove | ArcDrive)]

    async def _answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case EmergencyStop(user=user, reason=reason):
                self.stop(user, reason)
        return self.latch.state
