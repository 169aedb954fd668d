"""Appearance of a console, and the pictures that its operator needs.

Rule of this file: imports only from the standard library, because the command line reads this file before it knows the
command.
"""

from __future__ import annotations

from enum import StrEnum


class Profile(StrEnum):
    """Appearance of a console."""

    TERMINAL = "terminal"  # picture, tables, keys
    PENDANT = "pendant"  # one-handed keys and the state of one robot; the picture is on a video monitor
    MONITOR = "monitor"  # tables only; drives nothing
    HEADLESS = "headless"  # no screen: a gamepad drives one robot, and changes are printed as lines


class Sight(StrEnum):
    """Pictures that the operator needs of the robot."""

    PICTURES = "pictures"  # pictures come to this machine
    BROADCAST = "broadcast"  # the robot transmits to a video monitor; framegrabbers stay free for others
    NOTHING = "nothing"  # no picture, so the grant needs no settling, and the frequency stays free for others
