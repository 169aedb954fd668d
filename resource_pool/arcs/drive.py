"""ARC kind 1: the actuators of a robot, without its camera.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from resource_pool.aggregate_resource_controller import AggregateResourceController


class DriveArc(AggregateResourceController):
    """A robot and a share of its command radio."""

    roles: ClassVar[Sequence[str]] = ("scout", "command_radio")
