"""A behavior's reports to its parent, over a link that loses them."""

from __future__ import annotations

import asyncio
from typing import Any

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.wire import Envelope, Message
from mission_control.messages import BehaviorStatus, ChildReport, ReportNoted
from mission_control.parent_reports import ParentReports

PARENT = "mission_control/parent"


def test_the_newest_report_is_repeated_until_it_is_noted_and_older_ones_are_left_out(local_mission: Any) -> None:
    heard: list[str] = []

    async def scene() -> None:
        async with local_mission("iros2001") as network, asyncio.TaskGroup() as tasks:
            clock = VirtualClock()
            bus, parent = network.join("mission_control/child", clock), network.join(PARENT, clock)
            because = "slice"
            is_deaf = True

            async def answer(asked: Envelope[Message]) -> Message:
                assert isinstance(asked.body, ChildReport)
                if is_deaf:
                    await clock.sleep_s(1000.0)
                heard.append(asked.body.suspended_because)
                return ReportNoted()

            parent.serve(PARENT, ChildReport, answer)
            parent.declare_alive(PARENT)
            reports = ParentReports(
                bus,
                clock,
                PARENT,
                lambda: ChildReport("child", BehaviorStatus.RUNNING, {}, because),
                lambda work, name: tasks.create_task(work, name=name),
            )
            reports.send()
            await clock.sleep_s(3.0)
            because = "higher by console-1"
            reports.send()
            reports.send()
            await clock.sleep_s(3.0)
            assert heard == []
            is_deaf = False
            await clock.sleep_s(10.0)
            assert heard[-1] == "higher by console-1"
            assert len(heard) <= 2, "one that is noted is sent once, and once for what changed meanwhile"
            await bus.close()
            await parent.close()

    run_virtual(scene())
