"""Give: sends one command of its ARC, named by its word, and holds the ARC for a stated time.

In mission.xml: an ARC of any kind that has the command; ``scout-backbone components`` lists the commands of each kind.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Pause
from mission_control.behaviors.driver import Driver
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import WrongCommand

TICK_S = 1e-6  # chosen: far above the rounding of mission times


class GiveParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Give``.

    Attributes:
        word: The command.
        values: Its fields, ``name=value`` separated by blanks.
        role: Role of the RC that obeys, if several RCs can.
        for_s: Time for which the behavior holds its ARC; 0: until the command was applied.
        again_s: Time after which the command is repeated; 0: only after an interruption.
    """

    word: str
    values: str = ""
    role: str = ""
    for_s: Pause = 0.0
    again_s: Pause = 0.0

    def __post_init__(self) -> None:
        read_values(self.values)


def read_values(text: str) -> dict[str, object]:
    """Return field → value: a number, ``true`` or ``false``, else text.

    Raises:
        ValueError: A part is not ``name=value``.

    Example:
        >>> read_values("pan_rad=-0.5 on=true frequency=video1")
        {'pan_rad': -0.5, 'on': True, 'frequency': 'video1'}
    """
    pairs = [part.partition("=") for part in text.split()]
    if wrong := ["".join(pair) for pair in pairs if not (pair[0] and pair[2])]:
        raise ValueError(f"values has {wrong[0]!r}: write name=value, separated by blanks")
    return {name: _value(value) for name, _equals, value in pairs}


def _value(text: str) -> object:
    try:
        value = msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text
    return value if isinstance(value, float | int) else text


class GiveMemory(msgspec.Struct, frozen=True):
    """Time for which the command was in force."""

    held_s: float


class Give(Driver[GiveParameters]):
    """Succeeds when the command was applied and its time is over; fails if the ARC has no such command."""

    parameters_type = GiveParameters
    hands_over = frozenset({"held_s"})
    memory_type = GiveMemory
    never = Driver.never | {WrongCommand.code}

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._held_s, self._in_force_since_s = 0.0, math.inf
        self._command = self._read()
        self._holding: asyncio.Task[None] | None = None

    @property
    def held_s(self) -> float:
        """Time for which the command was in force, over all grants; settable."""
        return self._held_s + max(0.0, self.clock.now_s() - self._in_force_since_s)

    @held_s.setter
    def held_s(self, held_s: float) -> None:
        self._held_s = held_s

    def memory(self) -> GiveMemory:
        """Return the time until now; see ``BehaviorHooks.memory``."""
        return GiveMemory(self.held_s)

    def recall(self, memory: GiveMemory) -> None:
        """Hold the ARC for the rest of the time."""
        self.held_s = memory.held_s

    def parameters_changed(self) -> None:
        """Send the new command now, or at the next grant."""
        self._command = self._read()
        if self._holding is not None:
            self._holding.cancel()

    async def drive_on(self, robot: str) -> None:
        """Send the command, and hold the ARC."""
        while True:
            command = self._command
            await self.held.give(*command)
            if command != self._command:  # it changed meanwhile
                continue
            wanted = self.parameters
            self.report(f"gives {wanted.word}{f' to {robot}' if robot else ''}")
            left_s = max(0.0, wanted.for_s - self.held_s)
            self._in_force_since_s, lasts_s = self.clock.now_s(), min(left_s, wanted.again_s or left_s)
            self._holding = self.start_task(self.clock.sleep_s(lasts_s), "hold")
            try:
                await asyncio.wait([self._holding])
            finally:
                self._holding.cancel()
                self._held_s, self._in_force_since_s = self.held_s, math.inf
            if command == self._command and self.held_s >= self.parameters.for_s - TICK_S:
                self.finish(BehaviorStatus.SUCCESS)
                return

    def _read(self) -> tuple[str, Mapping[str, object], str]:
        """Return word, fields and role of the command."""
        given = self.parameters
        return given.word, read_values(given.values), given.role
