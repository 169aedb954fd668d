"""Emergency stop of one robot: once stopped it stays so until that very stop is lifted.

Rules of this file: pure; time is an argument; no bus.

* Stopping is always right: it needs no grant. A second stop keeps the first one's author and reason, adds its own
  author, and has a number of its own.
* Only the stop that was seen is lifted. A lift on its way while somebody stops again changes nothing.
* Who holds the robot keeps it; its drives and jumps are refused with the author and the reason.
* A command counts only if whoever gave it knew that the last stop was lifted: one that was on its way then is refused.
"""

from __future__ import annotations

import msgspec

from resource_pool.messages import EmergencyStopped, GivenBeforeStop, OtherStop, Stopper, StopState

MOST_AUTHORS = 16  # chosen: more people than look after one robot


class StopLatch:
    """Whether a robot may move.

    Args:
        rc: Its name.
        state: As it was before its process began; None: it may move, and nobody ever stopped it.
    """

    def __init__(self, rc: str, state: StopState | None = None) -> None:
        self.state = state or StopState(rc, False, 0, "", "", 0.0)
        """How it is now."""

    def stop(self, by: str, reason: str, now_s: float, console: str = "") -> bool:
        """Let nothing move it any more; say whether that is new: it could move, or this author did not stop it yet.

        Args:
            by: Who stops it, for people.
            reason: As given.
            now_s: When.
            console: Address of the console it is done by.
        """
        state, author = self.state, Stopper(by, console)
        if not state.is_stopped:
            self.state = StopState(state.rc, True, state.number + 1, by, reason, now_s, console=console)
            return True
        is_new = author not in (Stopper(state.by, state.console), *state.also) and len(state.also) < MOST_AUTHORS
        also = [*state.also, author] if is_new else state.also
        self.state = msgspec.structs.replace(state, number=state.number + 1, also=also)
        return is_new

    def confirm(self, is_confirmed: bool) -> None:
        """Take note whether the packet that stops the wheels was handed to the radio, if it is still stopped."""
        if self.state.is_stopped:
            self.state = msgspec.structs.replace(self.state, is_confirmed=is_confirmed)

    def lift(self, number: int, by: str, now_s: float) -> bool:
        """Let it move again; say whether that is new.

        Raises:
            OtherStop: Another stop than this one is in force.
        """
        state = self.state
        if number != state.number:
            raise OtherStop(
                f"{state.rc}: stop {number} is to be lifted, the last one is {state.number} by {state.by}",
                number=state.number,
                by=state.by,
            )
        if not state.is_stopped:
            return False
        self.state = StopState(state.rc, False, number, by, state.reason, now_s)
        return True

    def require_moving(self, after_stop: int) -> None:
        """Return if a command may move the robot.

        Args:
            after_stop: Number of the last stop that whoever gave the command knew to be lifted.

        Raises:
            EmergencyStopped: The robot may not move.
            GivenBeforeStop: It may, and the command is older than the lift of its last stop.
        """
        state = self.state
        if state.is_stopped:
            why = f": {state.reason}" if state.reason else ""
            raise self._refusal(EmergencyStopped, f"{state.rc} was stopped by {state.by}{why}")
        if after_stop != state.number:
            raise self._refusal(GivenBeforeStop, f"{state.rc} was stopped since then, and freed by {state.by}")

    def _refusal(self, kind: type[EmergencyStopped], detail: str) -> EmergencyStopped:
        state = self.state
        return kind(
            detail,
            rc=state.rc,
            number=state.number,
            is_stopped=state.is_stopped,
            by=state.by,
            reason=state.reason,
            since_s=state.at_s,
        )
