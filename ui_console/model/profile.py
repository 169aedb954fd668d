"""How a console looks."""

from __future__ import annotations

from enum import StrEnum


class Profile(StrEnum):
    """How a console looks."""

    TERMINAL = "terminal"  # picture, tables, keys
    PENDANT = "pendant"  # keys for one hand and the state of one robot; the picture is on a video monitor
    MONITOR = "monitor"  # tables only; drives nothing
    HEADLESS = "headless"  # no screen: a gamepad drives one robot, and what changes is printed in lines
