"""A robot's RC that only stops and moves again, for tests of consoles."""

from __future__ import annotations

from typing import Any

from backbone.component.component import Component
from backbone.keys import Conversation
from backbone.wire import Envelope, Message
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop, EmergencyStop, LiftStop


class StoppableRobot(Component[Any]):
    """Keeps the authors of its stop, and publishes it."""

    is_robot = True
    accepts = AskStop | EmergencyStop | LiftStop

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.latch = StopLatch(self.name)

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case EmergencyStop(reason=reason, user=user):
                self.latch.stop(user, reason, self.clock.now_s(), asked.source)
            case LiftStop(number=number, user=user):
                self.latch.lift(number, user, self.clock.now_s())
        self.bus.publish(self.address, Conversation.EVENTS, self.latch.state)
        return self.latch.state
