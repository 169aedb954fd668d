"""Interface of a kind of robot in the simulated world: one MJCF file and one class.

The class names the robot's body, receives its packets and drives its actuators. A mission file names the class path, so
a new kind needs no change in this package.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Mapping, Sequence
from typing import Protocol, cast, runtime_checkable

from scout_model.battery import Battery
from scout_model.errors import InvalidWorld

_PARTS = ("body_mjcf", "frequency", "motors", "hear", "controls")
_CLASS_PATH = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@runtime_checkable
class Robot(Protocol):
    """A robot's on-board program. The constructor has no arguments; time never decreases between calls."""

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body as MJCF, without ``<option>`` and ``<visual>``.

        Its root is a body ``body`` with a free joint ``free``; the mission file places the body's origin, on the floor.
        The transmitter sends the picture of the camera ``camera``, if there is one. Actuators have names.
        """

    @property
    def frequency(self) -> str:
        """Frequency of its transmitter; empty while it is off."""

    @property
    def motors(self) -> float:
        """Load of its motors, 0 to 1; they disturb its own picture."""

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet; ignore it if it is malformed."""

    def controls(self, now_s: float) -> Mapping[str, float]:
        """Advance to this time; return actuator → control. If all controls are zero, the robot may stand still."""


@runtime_checkable
class FeelingRobot(Robot, Protocol):
    """A robot that receives the readings of its body's sensors."""

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:
        """Record the newest reading of each MJCF sensor of its body, by the sensor's name.

        Called at the beginning and after each frame, but not while all readings stay the same.
        """


@runtime_checkable
class AnsweringRobot(Robot, Protocol):
    """A robot that replies on the digital link."""

    def reply(self, now_s: float) -> bytes:
        """Return the reply to the packets since the last reply; empty: no reply."""


@runtime_checkable
class PoweredRobot(Robot, Protocol):
    """A robot with a battery; before the first frame, a world may replace it by one of another capacity."""

    battery: Battery


def robot_class(kind: str) -> type[Robot]:
    """Return the class of a kind of robot.

    Args:
        kind: Class path ``package.module:Class``.

    Raises:
        InvalidWorld: There is no such class, it lacks a method of ``Robot``, or has one as an ``async def``.
    """
    if not _CLASS_PATH.fullmatch(kind):
        raise InvalidWorld(f"{kind!r} is no class path; write package.module:Class")
    module, _, name = kind.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InvalidWorld(f"there is no kind of robot {kind}: {error}") from error
    lacking = [part for part in _PARTS if not hasattr(found, part)]
    if not isinstance(found, type) or lacking:
        raise InvalidWorld(f"{kind} is no kind of robot: it lacks {', '.join(lacking) or 'a class'}")
    for part in _PARTS:
        if inspect.iscoroutinefunction(getattr(found, part)):
            raise InvalidWorld(f"{kind} is no kind of robot: {part} is an 'async def'; write it as a 'def'")
    return found


def answering(program: Robot) -> AnsweringRobot | None:
    """Return the program if it replies, by a method of its own or of another program to which it passes calls on.

    Not ``isinstance``, which from Python 3.12 on sees only the first.
    """
    return cast("AnsweringRobot", program) if hasattr(program, "reply") else None


def feeling(program: Robot) -> FeelingRobot | None:
    """Return the program if it receives readings; see ``answering``."""
    return cast("FeelingRobot", program) if hasattr(program, "feel") else None


def fit_battery(program: Robot, battery_j: float, kind: str) -> None:
    """Replace the battery of a program that was not used yet by one of this capacity.

    Raises:
        InvalidWorld: This kind of robot has no battery.
    """
    if not isinstance(program, PoweredRobot):
        raise InvalidWorld(f"{kind} has no battery, so none of {battery_j:g} J")
    program.battery = Battery(battery_j)
