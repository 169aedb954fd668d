"""A behavior that overrides ``not_now`` is asked before its slice ends; others never are."""

from __future__ import annotations

from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior import Behavior
from resource_pool.messages import Noted, SliceEnds

ARC = {"kind": "capture", "minimum_runtime_s": 5.0, "maximum_runtime_s": 8.0, "period_s": 0.1, "packet_time_s": 0.002}


class Tracker(Behavior[Any]):
    """Needs two seconds more while it follows something."""

    follows = True

    def not_now(self) -> float:
        return 2.0 if self.follows else 0.0


class Plain(Behavior[Any]):
    """Has nothing against the end of its slice."""


@pytest.mark.parametrize(("kind", "asked"), [("tracker", True), ("plain", False)])
def test_only_a_behavior_that_has_something_to_say_wants_to_be_asked(
    local_mission: Any, kind: str, asked: bool
) -> None:
    async def main() -> None:
        async with local_mission("iros2001") as network:
            placer = FakePlacer(network, VirtualClock(), {"tracker": Tracker, "plain": Plain})
            node = {"type": kind, "name": "watch1", "priority": 3, "arc": ARC}
            await placer.launch(behavior_order(node, [("iros2001", 10)]))
            await placer.wait(lambda: placer.arcs)
            assert placer.arcs["watch1-capture"].parameters["may_say_not_now"] is asked
            await placer.close()

    run_virtual(main())


def test_it_says_what_it_still_needs_while_it_holds_its_rcs(local_mission: Any) -> None:
    async def main() -> None:
        async with local_mission("iros2001") as network:
            placer = FakePlacer(network, VirtualClock(), {"tracker": Tracker})
            node = {"type": "tracker", "name": "watch1", "priority": 3, "arc": ARC}
            tracker = await placer.launch(behavior_order(node, [("iros2001", 10)]))
            await placer.wait(lambda: placer.arcs)
            arc = placer.arcs["watch1-capture"]

            async def wanted_s() -> float:
                question = SliceEnds(arc.name, 5.0, 8.0)
                return (await arc.bus.ask(tracker.address, question, Noted, within_s=1)).wanted_s

            assert await wanted_s() == 0.0
            await arc.grant()
            assert await wanted_s() == 2.0
            tracker.follows = False
            assert await wanted_s() == 0.0
            tracker.follows = True
            await arc.suspend()
            assert await wanted_s() == 0.0
            await placer.close()

    run_virtual(main())
