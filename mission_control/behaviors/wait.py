"""Wait: some time."""

from __future__ import annotations

from collections.abc import Sequence

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed, Seconds
from mission_control.composites import WithDelay


class WaitParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Wait``.

    Attributes:
        seconds: Mission time after which it succeeds.
    """

    seconds: Seconds


class Wait(Composed[WaitParameters]):
    """Succeeds after some time."""

    parameters_type = WaitParameters
    children_allowed = (0, 0)

    def rules(self, children: Sequence[str]) -> WithDelay:
        """Return the rule of a wait."""
        self._rules = WithDelay(children, seconds=self.parameters.seconds)
        return self._rules

    def parameters_changed(self) -> None:
        """Apply them from now on, to the time that has already passed too."""
        self._rules.seconds = self.parameters.seconds
        self._children.look_again()
