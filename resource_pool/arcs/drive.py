"""ARC kind 1: the actuators of a robot, without its camera.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from resource_pool.aggregate_resource_controller import AggregateResourceController
from resource_pool.commands import Command, Drive, Halt, Jump, Move


class DriveArc(AggregateResourceController):
    """A robot and a share of its command radio."""

    roles: ClassVar[Mapping[str, str] | Sequence[str]] = ("scout", "command_radio")
    commands: ClassVar[Mapping[type[Command], str]] = dict.fromkeys((Move, Drive, Halt, Jump), "scout")
    body: ClassVar[str] = "scout"
