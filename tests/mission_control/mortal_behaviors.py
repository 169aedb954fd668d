"""Behaviors whose processes are killed, with a folder of the mission in which they keep their progress."""

from __future__ import annotations

from typing import Any, ClassVar

import msgspec
from behaviors_of_a_placer import CLASSES
from fake_resource_pool import FakePlacer

from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behaviors.fallback import Fallback
from mission_control.behaviors.repeat import Repeat
from mission_control.behaviors.sequence import Sequence
from mission_control.behaviors.timeout import Timeout


class Steps(msgspec.Struct, frozen=True):
    number: int


class Jumps(msgspec.Struct, frozen=True):
    height_m: str


class WalkerParameters(BehaviorParameters, frozen=True, kw_only=True):
    pace: float = 1.0


class Walker(Behavior[WalkerParameters]):
    """Counts its steps."""

    parameters_type = WalkerParameters
    memory_type = Steps
    recalled: ClassVar[list[int]] = []

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.number = 0

    def memory(self) -> Steps:
        return Steps(self.number)

    def recall(self, memory: Steps) -> None:
        self.number = memory.number
        self.recalled.append(memory.number)

    def step(self) -> None:
        self.number += 1
        self.tell_parent({"steps": self.number})


class Jumper(Behavior[WalkerParameters]):
    """Another class that is put in the place of a walker."""

    parameters_type = WalkerParameters
    memory_type = Jumps
    recalled: ClassVar[list[object]] = []

    def recall(self, memory: Jumps) -> None:
        self.recalled.append(memory)


MORTALS = {
    **CLASSES,
    "walker": Walker,
    "jumper": Jumper,
    "sequence": Sequence,
    "fallback": Fallback,
    "repeat": Repeat,
    "timeout": Timeout,
}


async def die(placer: FakePlacer, name: str) -> Any:
    """Kill it, and start it again as its creator does."""
    await placer.kill(name)
    again = await placer.restart(name)
    await placer.clock.sleep_s(0.1)  # it asks for its memory
    return again
