"""Wait: succeeds after a given time."""

from __future__ import annotations

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed, Seconds
from mission_control.timed import WithDelay


class WaitParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Wait``.

    Attributes:
        seconds: Mission time after which it succeeds.
    """

    seconds: Seconds


class Wait(Composed[WaitParameters]):
    """Succeeds after the given time."""

    parameters_type = WaitParameters
    rules_type = WithDelay
    children_allowed = (0, 0)
