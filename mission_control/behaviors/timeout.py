"""Timeout: runs a child for a limited time."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed, Seconds
from mission_control.timed import WithTimeout


class TimeoutParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Timeout``.

    Attributes:
        seconds: Mission time after which the child is ended.
        while_suspended: Whether the time of a suspension counts. wait: it does not. count: it does.
    """

    seconds: Seconds
    while_suspended: Literal["wait", "count"] = "wait"


class Timeout(Composed[TimeoutParameters]):
    """Runs its child for a limited time; has the child's result, or fails when the time is over."""

    parameters_type = TimeoutParameters
    rules_type = WithTimeout
    children_allowed = (1, 1)
