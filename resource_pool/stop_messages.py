"""Messages of emergency stops: operator → robot RC, bypassing ARC and RC manager; robot RC → all: ``StopState``.

A stop needs no grant.
"""

from __future__ import annotations

from typing import Annotated

from backbone.component.messages import Stopper
from backbone.errors import Refusal
from backbone.ranges import FEW, Count, Instant, Line, Mention, Text
from backbone.wire import Message


class EmergencyStop(Message, frozen=True):
    """Stop this robot; nothing moves it until the stop is lifted. Every operator may stop it at any time.

    Attributes:
        reason: Reason, for the holder and the log.
        user: Name of the operator, for people; empty: the console.
    """

    reason: Line = ""
    user: Mention = ""


class LiftStop(Message, frozen=True):
    """Let the robot move again.

    Attributes:
        number: Number of the stop that the operator saw; a newer stop is not lifted.
        user: Name of the operator, for people; empty: the console.
    """

    number: Count
    user: Mention = ""


class AskStop(Message, frozen=True):
    """Ask whether this robot is stopped."""


class StopState(Message, frozen=True):
    """Answer to the three messages above; also published as an event on every change.

    Attributes:
        rc: The robot.
        is_stopped: True: drives and jumps are refused.
        number: Number of the last order to stop; grows with each order, even if the robot is already stopped.
        by: The operator who stopped it first, or who lifted the last stop.
        reason: The operator's reason.
        at_s: Mission time of the stop, or of its end.
        is_confirmed: False if the radio did not accept the packet that stops the robot, or if no ARC holds the robot
            and a part of it may still move. Then no new packet moves the robot, and its present motion ends by itself,
            that of the wheels within twice ``COMMAND_TIMEOUT_S`` after the last command.
        console: Address of the console of the operator ``by``.
        also: Other operators who stopped it since it last moved.
    """

    rc: Mention
    is_stopped: bool
    number: Count
    by: Mention
    reason: Text
    at_s: Instant
    is_confirmed: bool = True
    console: Mention = ""
    also: Annotated[list[Stopper], FEW] = []


EmergencyQuestion = EmergencyStop | LiftStop | AskStop


class EmergencyStopped(Refusal):
    """An operator has stopped the robot; it did not move.

    Facts: ``rc``, ``number``, ``is_stopped``, ``by``, ``reason``, ``since_s``.
    """

    code = "robot.emergency_stop"
    remedy = "Check that the robot may move, then lift the stop at a console; the grant is not lost meanwhile."


class GivenBeforeStop(EmergencyStopped):
    """The sender did not know the robot's last stop, which has been lifted; facts as in ``EmergencyStopped``."""

    code = "robot.given_before_stop"
    remedy = "Give the command again, now that you know of the stop: let go of the control and press it again."


class OtherStop(Refusal):
    """The stop in force is not the one to lift; facts: ``number``, ``by``. Nothing is changed."""

    code = "robot.other_stop"
    remedy = "See which operator stopped the robot since, and lift that stop if the robot may move."
