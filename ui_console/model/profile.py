"""How a console looks, and what its operator is to see of the robot.

Rule of this file: no imports but the standard library's; the command line reads it before it knows the command.
"""

from __future__ import annotations

from enum import StrEnum


class Profile(StrEnum):
    """How a console looks."""

    TERMINAL = "terminal"  # picture, tables, keys
    PENDANT = "pendant"  # keys for one hand and the state of one robot; the picture is on a video monitor
    MONITOR = "monitor"  # tables only; drives nothing
    HEADLESS = "headless"  # no screen: a gamepad drives one robot, and what changes is printed in lines


class Sight(StrEnum):
    """What the operator is to see of the robot."""

    PICTURES = "pictures"  # pictures come to this machine
    BROADCAST = "broadcast"  # the robot transmits to a video monitor; a framegrabber is left to others
    NOTHING = "nothing"  # no picture, so the robot waits for none to settle, and leaves the frequency to others
