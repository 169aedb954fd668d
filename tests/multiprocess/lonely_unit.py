"""A robot's unit with all that it needs in itself, in a process with a component that sends much."""

from __future__ import annotations

import time
from typing import TextIO

from backbone.keys import Conversation
from backbone.ranges import Bulk
from backbone.wire import Message
from mission_control.modules.module import Module
from mission_control.modules.unit_component import UnitComponent

EVENT_BYTES, EVENTS_HZ = 20_000, 20.0  # fills a socket within half a second
PICTURE_BYTES, REPORTS_HZ = 15_000, 5.0


class Reading(Message, frozen=True):
    value: float


class Much(Message, frozen=True):
    data: Bulk


class Sensor(Module):
    """Reads a sensor of the robot: here it counts."""

    class Outputs(Module.Outputs):
        reading: Reading

    def reset(self) -> None:
        self.count = 0

    def update(self, inputs: Module.Inputs) -> Outputs:
        self.count += 1
        return self.Outputs(Reading(float(self.count)))


class Actuator(Module):
    """Moves the robot: here it writes when it did so."""

    class Inputs(Module.Inputs):
        reading: Reading

    class Outputs(Module.Outputs):
        done: Reading

    class Parameters(Module.Parameters, frozen=True):
        path: str

    parameters: Parameters

    def reset(self) -> None:
        self.file: TextIO | None = None

    def update(self, inputs: Inputs) -> Outputs:
        self.file = self.file or open(self.parameters.path, "w", buffering=1)  # noqa: SIM115  closed by its end
        self.file.write(f"{time.monotonic()}\n")
        return self.Outputs(inputs.reading)


class Camera(Module):
    """Makes pictures that are too small for a board."""

    class Outputs(Module.Outputs):
        picture: Much

    def update(self, inputs: Module.Inputs) -> Outputs:
        return self.Outputs(Much(memoryview(bytes(PICTURE_BYTES))))


class QuietUnit(UnitComponent):
    registers = False


class UnitBesideTalk(QuietUnit):
    """Its event loop also sends what must not be lost, and waits where the hub takes nothing."""

    async def connect(self) -> None:
        await super().connect()
        self.start_task(self._talk(), "talk")

    async def _talk(self) -> None:
        data = memoryview(bytes(EVENT_BYTES))
        while True:
            self.bus.publish(self.address, Conversation.EVENTS, Much(data))
            await self.clock.sleep_s(1 / EVENTS_HZ)


class UnitOfPictures(QuietUnit):
    """Its pictures fill a queue, and meanwhile it sends states, which must not be lost."""

    async def connect(self) -> None:
        await super().connect()
        self.start_task(self._report_on(), "report on")

    async def _report_on(self) -> None:
        number = 0
        while True:
            self.report(f"report {(number := number + 1)}")
            await self.clock.sleep_s(1 / REPORTS_HZ)
