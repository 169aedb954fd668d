"""A watcher that must stop its robot at the end of a slice, for the benches."""

from __future__ import annotations

from mission_control.behaviors.watch_for_motion import WatchForMotion


class HaltingWatcher(WatchForMotion):
    """Stops its robot's wheels before it releases the robot, so that the switch has to wait for it."""

    async def suspending(self, deadline_s: float) -> None:  # noqa: ARG002  one command needs no deadline
        """Stop the wheels."""
        if self.arc is not None:
            await self.arc.halt()
