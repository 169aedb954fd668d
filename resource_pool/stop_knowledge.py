"""Stop knowledge: the stops that a commander knows. Its commands carry the number of the last stop whose lift it knows.

Rules of this file: pure; no bus, no clock.

A command sent before a stop, or before the stop was lifted, may arrive after both. Its number distinguishes it from a
later command: the robot's RC rejects every number except that of its last stop.
"""

from __future__ import annotations

from resource_pool.stop_messages import EmergencyStopped, StopState


class StopKnowledge:
    """Numbers of the last stops, by robot."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, bool]] = {}

    def number(self, robot: str) -> int:
        """Return the number for commands to this robot; 0: no stop is known."""
        number, is_lifted = self._last.get(robot, (0, True))
        return number if is_lifted else number - 1  # wrong number, even if the lift overtakes the command

    def heard(self, state: StopState) -> bool:
        """Record a robot's state; return whether it is news. A state older than the known one changes nothing."""
        known, now = self._last.get(state.rc, (0, True)), (state.number, not state.is_stopped)
        if now <= known:
            return False
        self._last[state.rc] = now
        return True

    def refused(self, refusal: EmergencyStopped) -> None:
        """Record the state in a refusal of the robot's RC, which overrides all earlier states."""
        facts = refusal.facts
        if "rc" in facts and "number" in facts:
            self._last[str(facts["rc"])] = (int(facts["number"]), not facts.get("is_stopped", True))
