"""Emergency stop of one robot: once stopped it stays so until that very stop is lifted.

Rules of this file: pure; time is an argument; no bus.

* Stopping is always right: it needs no grant, and a second stop keeps the first one's author and reason.
* Only the stop that was seen is lifted. A lift on its way while somebody stops again changes nothing.
* Who holds the robot keeps it; its drives and jumps are refused with the author and the reason.
"""

from __future__ import annotations

import msgspec

from resource_pool.messages import EmergencyStopped, OtherStop, StopState


class StopLatch:
    """Whether a robot may move.

    Args:
        rc: Its name.
        state: As it was before its process began; None: it may move, and nobody ever stopped it.
    """

    def __init__(self, rc: str, state: StopState | None = None) -> None:
        self.state = state or StopState(rc, False, 0, "", "", 0.0)
        """How it is now."""

    def stop(self, by: str, reason: str, now_s: float) -> bool:
        """Let nothing move it any more; say whether that is new."""
        if self.state.is_stopped:
            return False
        self.state = StopState(self.state.rc, True, self.state.number + 1, by, reason, now_s)
        return True

    def confirm(self, is_confirmed: bool) -> None:
        """Take note whether the packet that stops the wheels was handed to the radio."""
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

    def require_moving(self) -> None:
        """Return if the robot may move.

        Raises:
            EmergencyStopped: It may not.
        """
        state = self.state
        if state.is_stopped:
            why = f": {state.reason}" if state.reason else ""
            raise EmergencyStopped(
                f"{state.rc} was stopped by {state.by}{why}",
                rc=state.rc,
                number=state.number,
                by=state.by,
                reason=state.reason,
                since_s=state.at_s,
            )
