"""Emergency stop of one robot: the robot stays stopped until exactly this stop is lifted.

Rules of this file: pure; time is an argument; no bus.

* A stop is always allowed and needs no grant. A second stop keeps the first one's author and reason, adds its own
  author, and has a number of its own.
* A lift names the stop that the operator saw. If a newer stop comes meanwhile, the lift changes nothing.
* The ARC that holds the robot keeps it; its drives and jumps are refused with the author and the reason of the stop.
* A command is refused if its sender did not know that the last stop was lifted.
"""

from __future__ import annotations

import msgspec

from backbone.component.messages import LastStop, StandingStop, Stopper
from backbone.ranges import MOST_FEW
from resource_pool.stop_messages import EmergencyStopped, GivenBeforeStop, OtherStop, StopState

MOST_AUTHORS = MOST_FEW - 1  # beside the first one, as many as a ``StandingStop`` carries


class StopLatch:
    """The stop of one robot.

    Args:
        state: State before the RC's process began; None: the robot may move and was never stopped.
    """

    def __init__(self, rc: str, state: StopState | None = None) -> None:
        self.state = state or StopState(rc, False, 0, "", "", 0.0)
        """The present state."""
        self._began = self.state.number  # number of the first order of the stop in force

    def stop(self, by: str, reason: str, now_s: float, console: str = "") -> bool:
        """Stop the robot; return True if the robot could move, or if this author had not stopped it yet.

        Args:
            by: Name of the operator, for people.
            console: Address of the operator's console.
        """
        state, author = self.state, Stopper(by, console)
        if not state.is_stopped:
            self.state = StopState(state.rc, True, state.number + 1, by, reason, now_s, console=console)
            self._began = self.state.number
            return True
        is_new = author not in (Stopper(state.by, state.console), *state.also)
        also = _fitting([*state.also, author]) if is_new else state.also
        self.state = msgspec.structs.replace(state, number=state.number + 1, also=also)
        return is_new

    def resume(self, last: LastStop) -> bool:
        """Adopt the last stop of the RC's former process; return False if nothing later than here is known of it."""
        stop, state = last.standing, self.state
        if (last.number, stop is None) <= (state.number, not state.is_stopped):
            return False
        self._began = last.number
        if stop is None:
            self.state = StopState(state.rc, False, last.number, "an operator", "", state.at_s)
            return True
        (first, *also), rc = stop.authors or [Stopper(stop.by)], state.rc
        self.state = StopState(
            rc, True, last.number, first.by, stop.reason, stop.since_s, stop.is_confirmed, first.console, also
        )
        return True

    def last(self) -> LastStop:
        """Return the last stop, if it is in force with all its authors, for the RC's next process."""
        state = self.state
        if not state.is_stopped:
            return LastStop(state.number)
        authors = [Stopper(state.by, state.console), *state.also]
        by = ", ".join(dict.fromkeys(author.by for author in authors))
        standing = StandingStop(state.number, by, state.reason, state.at_s, state.is_confirmed, authors)
        return LastStop(state.number, standing)

    def confirm(self, is_confirmed: bool, number: int | None = None) -> None:
        """If the robot is still stopped, record whether the radio accepted the packet that stops the wheels.

        Args:
            number: Number of the last order to stop when the packet was made: if the robot was freed since, the packet
                says nothing about the stop in force. None: the packet is of the stop in force.
        """
        if self.state.is_stopped and (number is None or number >= self._began):
            self.state = msgspec.structs.replace(self.state, is_confirmed=is_confirmed)

    def lift(self, number: int, by: str, now_s: float) -> bool:
        """Lift the stop; return True if it was in force.

        Raises:
            OtherStop: Another stop is in force.
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
        """Check that a command may move the robot.

        Args:
            after_stop: Number of the last stop whose lift the sender knew.

        Raises:
            EmergencyStopped: A stop is in force.
            GivenBeforeStop: No stop is in force, but the command is older than the lift of the last stop.
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


def _fitting(also: list[Stopper]) -> list[Stopper]:
    """Return at most ``MOST_AUTHORS`` of these authors; a person's earlier consoles go first, the newest author last.

    A program that stops a robot by one console after the other thus leaves room for other people.
    """
    if len(also) <= MOST_AUTHORS:
        return also
    later = [author.by for author in also]
    double = next((at for at, author in enumerate(also) if author.by in later[at + 1 :]), len(also) - 1)
    return also[:double] + also[double + 1 :]
