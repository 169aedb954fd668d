"""Commands that an RC carries out for the ARC that holds it.

The RC that obeys a command declares it, as one message class. A decision process sends the command to its ARC; the ARC
fills in its own name and the epoch, and passes the command on to the RC of its role. The answer contains the applied
values, or is the refusal ``StaleEpoch``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import ClassVar, Self

import msgspec

from backbone.errors import Refusal
from backbone.ranges import Count, Epoch, Mention, Speed, TurnRate, WheelSpeed
from backbone.wire import Message, naming_field


class Command(Message, frozen=True, kw_only=True):
    """Base class of commands; derive and add the command's own fields.

    Attributes:
        role: Role of the RC in its ARC; empty: the only role that accepts this command.
        after_stop: Number of the robot's last stop whose lift the sender knows; 0: no stop.
        arc: The ARC that commands; filled in by the ARC.
        epoch: Epoch of the RC's connection; filled in by the ARC.
    """

    role: Mention = ""
    after_stop: Count = 0
    arc: Mention = ""
    epoch: Epoch = 0

    moves: ClassVar[bool] = False
    """True: it moves the robot, so a stopped robot refuses it."""

    @classmethod
    def word(cls) -> str:
        """Return the command's name in ``Applied``, scripts and stories.

        Example:
            >>> SwitchTransmitter.word()
            'switch_transmitter'
        """
        return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    def under(self, arc: str, epoch: int) -> Self:
        """Return this command with the ARC and the epoch of its grant filled in."""
        return msgspec.structs.replace(self, arc=arc, epoch=epoch)


OF_THE_BASE = Command.__struct_fields__
"""Fields that the ARC and its client fill in, not the commanding person or behavior."""


class WrongCommand(Refusal):
    """A command by its word has a field that the command lacks, lacks a field, or has a value out of range."""

    code = "arc.wrong_command"
    remedy = "Give the fields of this command within their ranges; 'scout-backbone components' lists them."


def command_of(kind: type[Command], values: Mapping[str, object], *, role: str, after_stop: int) -> Command:
    """Return the command of a class with these values.

    Raises:
        WrongCommand: The values do not fit the command's fields.
    """
    fields = [field for field in msgspec.structs.fields(kind) if field.name not in OF_THE_BASE]
    if unknown := sorted(values.keys() - {field.name for field in fields}):
        known = ", ".join(field.name for field in fields) or "none"
        raise WrongCommand(f"{kind.word()} has no field {unknown[0]}; its fields: {known}", field=unknown[0])
    missing = [field.name for field in fields if field.required and field.name not in values]
    if missing:
        raise WrongCommand(f"{kind.word()} needs a value of {missing[0]}", field=missing[0])
    given = [values.get(field.name, field.default) for field in fields]
    try:
        return msgspec.convert([kind.__struct_config__.tag, *given, role, after_stop], kind)
    except msgspec.ValidationError as error:
        raise WrongCommand(f"{kind.word()}: {naming_field(str(error), kind)}") from None


def clipped(order: Command, limits: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Return the command's limited values, each clipped to its limits.

    Raises:
        WrongCommand: A value is not finite.

    Example:
        >>> clipped(Move(5.0, 0.5), {"forward_m_s": (-1.0, 1.0), "turn_rad_s": (-2.0, 2.0)})
        {'forward_m_s': 1.0, 'turn_rad_s': 0.5}
    """
    values = {name: getattr(order, name) for name in limits if name in order.__struct_fields__}
    for name, value in values.items():
        if not math.isfinite(value):
            raise WrongCommand(f"{order.word()}: {name} is {value}", field=name)
    return {name: min(limits[name][1], max(limits[name][0], value)) for name, value in values.items()}


class Move(Command, frozen=True):
    """Move forward and turn at these speeds until another command, at most for 0.5 s.

    Every kind of robot that moves obeys it.

    Attributes:
        forward_m_s: Along its heading; negative is backward.
        turn_rad_s: To the left; negative is to the right.
    """

    forward_m_s: Speed
    turn_rad_s: TurnRate = 0.0

    moves: ClassVar[bool] = True


class Drive(Command, frozen=True, tag="Drive/2"):
    """Turn the wheels at these speeds until another command, at most for 0.5 s.

    Attributes:
        left_rad_s: Left wheel, forward is positive.
        right_rad_s: Right wheel.
    """

    left_rad_s: WheelSpeed
    right_rad_s: WheelSpeed

    moves: ClassVar[bool] = True


class Halt(Command, frozen=True, tag="Halt/2"):
    """Stop the wheels."""


class Jump(Command, frozen=True, tag="Jump/2"):
    """Wind the spring foot and kick."""

    moves: ClassVar[bool] = True


class SwitchTransmitter(Command, frozen=True, tag="SwitchTransmitter/2"):
    """Switch the robot's video transmitter on at a frequency, or off.

    Attributes:
        on: On or off.
        frequency: Name of the video frequency's RC; empty when off.
    """

    on: bool
    frequency: Mention = ""


class Tune(Command, frozen=True, tag="Tune/3"):
    """Receive this video frequency and deliver its pictures to the ARC that holds the framegrabber.

    Attributes:
        frequency: Name of the video frequency's RC.
        robot: The robot of the ARC; pictures of other robots are not delivered. Empty: any.
        camera: Last segment of the address of the pictures, for a further camera of the ARC; empty: the ARC's address.
    """

    frequency: Mention
    robot: Mention = ""
    camera: Mention = ""
