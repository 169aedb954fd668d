"""What the RC manager says is counted, whatever else is said, and components are asked for their own numbers."""

from __future__ import annotations

import asyncio
from typing import Any

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.messages import AskStatistics, ComponentState, LifeState, Statistics
from backbone.keys import Conversation
from backbone.metrics.watch import MetricsWatch
from backbone.nameserver.messages import Components, ListComponents
from backbone.rc_manager.messages import AskSchedule, AskUtilization, Leases, TraceLine
from backbone.scheduling.requests import Holder
from backbone.scheduling.views import RcUtilization, RcView, Schedule, Utilization
from backbone.wire import Envelope

GRABBER = "resource_pool/grabber"
HELD = RcView("scout1", "scout", "up", False, 1.0, [Holder("anna-drive", 1, 0.0, 0.0)], 1, [])


async def answer(asked: Envelope[Any]) -> Any:
    match asked.body:
        case AskSchedule():
            return Schedule(0.0, [HELD], [], [])
        case AskUtilization():
            return Utilization(0.0, [RcUtilization("scout1", 0.0, 0.5, 0.25)])
        case ListComponents():
            grabber = ComponentState(GRABBER, "framegrabber", "base", 1, LifeState.READY, 0.0)
            return Components([grabber], True, 0.0)
    return Statistics({"frames_garbled": 7.0})


def test_what_the_rc_manager_says_is_counted_and_components_are_asked(local_mission: Any) -> None:
    async def play() -> None:
        clock = VirtualClock()
        async with local_mission("local") as network:
            manager, other = network.join(RC_MANAGER, clock), network.join(GRABBER, clock)
            manager.serve(RC_MANAGER, AskSchedule | AskUtilization, answer)
            manager.serve(NAMESERVER, ListComponents, answer)
            other.serve(GRABBER, AskStatistics, answer)
            bus = network.join("ui_console/it", clock)
            watch = MetricsWatch(bus, clock)
            asking = asyncio.create_task(watch.run())
            await clock.sleep_s(0.5)
            for sender in (manager, other):
                sender.publish(sender.source, Conversation.LEASES, Leases([], 60.0))
            await clock.sleep_s(2.0)
            foreign = {"ev": "grant", "t": 2.0, "arc": "nobody", "epoch": {"scout1": 1}}
            other.publish(GRABBER, Conversation.EVENTS, TraceLine(foreign))
            line = {"ev": "grant", "t": 2.0, "arc": "anna-drive", "epoch": {"scout1": 1}}
            manager.publish(RC_MANAGER, Conversation.EVENTS, TraceLine(line))
            manager.publish(RC_MANAGER, Conversation.SCHEDULE, Schedule(clock.now_s(), [], [], []))
            await clock.sleep_s(1.0)
            watch.tally.advance(clock.now_s())
            asking.cancel()
            assert round(watch.tally.held_s["scout1", "anna-drive"], 6) == 2.0
            assert round(watch.tally.watched_s, 6) == 3.0
            assert watch.tally.grants == {("scout1", "anna-drive"): 1}
            assert watch.utilization == {"scout1": 0.5}
            assert watch.statistics == {("grabber", "frames_garbled"): 7.0}
            assert watch.dropped == 0
            await bus.close()

    run_virtual(play())
