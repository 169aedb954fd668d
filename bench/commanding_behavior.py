"""A behavior that commands its robot repeatedly and measures the time of each command, for the benches.

Between two commands it asks on bare zenoh, through the same hub, so that both run under the same load.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable

import zenoh
from measuring import percentile
from round_trip import ask_bare

from backbone.authentication import secret_of
from backbone.bus.interface import Bus, Clock
from backbone.bus.zenoh_bus import client_config
from backbone.component.launch import Launch
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.messages import BehaviorStatus

PAUSE_S = 0.02  # chosen: one command at a time, as behaviors and consoles send them


async def timed_s(call: Awaitable[object]) -> float:
    """Return the duration of this call."""
    began_s = time.perf_counter()
    await call
    return time.perf_counter() - began_s


class CommandingBehavior(Behavior[BehaviorParameters]):
    """Drives until it is ended; its statistics are the percentiles of the answers' times."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.commands_s, self.bare_s = list[float](), list[float]()

    async def act(self) -> BehaviorStatus:
        """Command, ask, and pause, in turns."""
        with zenoh.open(client_config(self.launch.endpoint, secret_of(self.launch.run_directory))) as bare:
            await self._wait_for_server(bare)
            while True:
                assert self.arc is not None
                self.commands_s.append(await timed_s(self.arc.drive(1.0, 1.0)))
                self.bare_s.append(await timed_s(ask_bare(bare, bytes(64))))
                await self.clock.sleep_s(PAUSE_S)

    async def _wait_for_server(self, bare: zenoh.Session) -> None:
        """Wait for the measuring process, which begins to answer bare questions after the mission is up."""
        while True:
            try:
                await ask_bare(bare, bytes(64))
            except ConnectionError:
                await self.clock.sleep_s(PAUSE_S)
            else:
                return

    def statistics(self) -> dict[str, float]:
        """Return how many commands were answered, and the percentiles in seconds once one was."""
        if not self.bare_s:
            return {"commands": 0.0}
        shares = {"p50_s": 0.5, "p99_s": 0.99}
        return {
            "commands": float(len(self.commands_s)),
            **{f"command_{name}": percentile(self.commands_s, share) for name, share in shares.items()},
            **{f"bare_{name}": percentile(self.bare_s, share) for name, share in shares.items()},
        }
