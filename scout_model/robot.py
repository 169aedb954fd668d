"""A kind of robot in the simulated world: one MJCF file and one class.

The class names the robot's body, receives its packets, and drives its actuators. A mission names
it by its class path, so a new kind needs no change in this package.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

from scout_model.battery import Battery
from scout_model.errors import InvalidWorld

_PARTS = ("body_mjcf", "frequency", "motors", "hear", "controls", "counts")
_CLASS_PATH = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@runtime_checkable
class Robot(Protocol):
    """A robot's on-board program, made without arguments; time only grows from call to call."""

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body as MJCF, without ``<option>`` and ``<visual>``.

        Its root is a body ``body`` with a free joint ``free``; the origin is what the mission file places, on the
        floor.  A camera ``camera``, if there is one, is what its transmitter sends.  Actuators have names.
        """

    @property
    def frequency(self) -> str:
        """Frequency of its transmitter; empty while it is off."""

    @property
    def motors(self) -> float:
        """How hard its motors are driven, 0 to 1; they disturb its own picture."""

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet; ignore and count it if it is malformed."""

    def controls(self, now_s: float) -> Mapping[str, float]:
        """Advance to this time; return actuator → what it shall do. All zero means that the robot may stand still."""

    def counts(self) -> Mapping[str, int]:
        """Return what it counted since it was switched on, by name."""


@runtime_checkable
class FeelingRobot(Robot, Protocol):
    """A robot that feels the sensors of its body."""

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:
        """Take the newest reading of each MJCF sensor of its body, by the sensor's name there.

        Called at the beginning and after each frame, but not while all readings stay the same.
        """


@runtime_checkable
class AnsweringRobot(Robot, Protocol):
    """A robot that answers on the digital link."""

    def reply(self, now_s: float) -> bytes:
        """Return its answer to the packets it heard since its last answer; empty: nothing to say."""


@runtime_checkable
class PoweredRobot(Robot, Protocol):
    """A robot that lives on a battery, which a world may replace by one of another capacity before its first frame."""

    battery: Battery


def robot_class(kind: str) -> type[Robot]:
    """Return the class of a kind of robot.

    Args:
        kind: Class path ``package.module:Class``.

    Raises:
        InvalidWorld: There is no such class, or it is no kind of robot.
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
    return found
