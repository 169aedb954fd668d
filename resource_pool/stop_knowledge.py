"""What a commander knows of the stops of robots; its commands carry the number of the last stop it knows to be lifted.

Rules of this file: pure; no bus, no clock.

A command that was given before a stop or before its lift may arrive after both. Its number tells it from one that was
given afterwards: the robot's RC refuses every number but that of its last stop.
"""

from __future__ import annotations

from resource_pool.messages import EmergencyStopped, StopState


class StopKnowledge:
    """Numbers of the last stops, by robot."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, bool]] = {}

    def number(self, robot: str) -> int:
        """Return the number that commands to this robot carry; 0: no stop of it is known."""
        number, is_lifted = self._last.get(robot, (0, True))
        return number if is_lifted else number - 1  # one that cannot be right, also if the lift overtakes the command

    def heard(self, state: StopState) -> bool:
        """Take in how a robot is; return whether that is news. What is older than what is known changes nothing."""
        known, now = self._last.get(state.rc, (0, True)), (state.number, not state.is_stopped)
        if now <= known:
            return False
        self._last[state.rc] = now
        return True

    def refused(self, refusal: EmergencyStopped) -> None:
        """Take in what the robot's RC said when it refused a command: that is how it is, whatever was heard before."""
        facts = refusal.facts
        if "rc" in facts and "number" in facts:
            self._last[str(facts["rc"])] = (int(facts["number"]), not facts.get("is_stopped", True))
