"""The end of a mission orders the end of all roots at once, so a root that does not confirm it delays no other root."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, cast

from up_watcher import UpWatcher

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.creator.messages import EndedBy, ProcessEnded
from backbone.creator.process_keeper import ProcessKeeper
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.ending_messages import AwaitMissionEnd, MissionEnded
from backbone.launcher.launcher import Launcher
from backbone.mission.reader import read_mission_bytes
from backbone.naming import Subsystem
from backbone.placer.messages import Ended, ListPlacements, Placements, Start, Started, StopComponent
from backbone.wire import Envelope, Message

ROOTS = ["one", "two", "three"]
WAIT = '<behavior type="wait" name="{}" priority="1"><parameter name="seconds" value="9"/></behavior>'
BEHAVIORS = "".join(map(WAIT.format, ROOTS))
MISSION_XML = f'<mission name="m" priority="1"><behaviors>{BEHAVIORS}</behaviors></mission>'
MISSION = read_mission_bytes(MISSION_XML.encode(), "m.xml")
HERE = MISSION.hosts[0].name
LAUNCHER = Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", HERE, "", 0.0, 1.0)
CUT_OFF_S = 7.0


class KeeperWithoutProcesses:
    """Core services that begin at once and end after a while."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock

    on_fell = on_silent = on_changed = on_bug = None

    async def start(self, launch: Launch, *_given: object) -> None: ...

    async def end(self, name: str, _reason: str) -> ProcessEnded:
        await self._clock.sleep_s(0.1)
        return ProcessEnded(name, EndedBy.ASKING, 0)

    def absences(self) -> list[object]:
        return []

    def processes(self) -> list[object]:
        return []


def test_a_root_that_is_cut_off_delays_no_other_and_the_killed_one_is_named(
    local_mission: Callable[..., Any],
) -> None:
    async def main() -> None:
        async with local_mission() as network:
            clock, ordered_s = VirtualClock(), dict[str, float]()

            async def placer(asked: Envelope[Message]) -> Message:
                match asked.body:
                    case Start(name=name):
                        return Started(f"mission_control/{name}", HERE, 1, [])
                    case StopComponent(name=name):
                        ordered_s[name] = clock.now_s()
                        if name == ROOTS[-1]:
                            await clock.sleep_s(CUT_OFF_S)
                        return Ended(name, EndedBy.SIGKILL if name == ROOTS[0] else EndedBy.ASKING)
                    case ListPlacements():
                        return Placements([])
                raise AssertionError(asked)

            bus = network.join(PLACER, clock)
            bus.serve(PLACER, Start | StopComponent | ListPlacements, placer)
            bus.declare_alive(PLACER)
            asker = network.join("ui_console/down", clock)
            watcher, keeper = UpWatcher(), cast("ProcessKeeper", KeeperWithoutProcesses(clock))
            launcher = Launcher(
                LAUNCHER,
                network.join(LAUNCHER.address, clock),
                clock,
                keeper=keeper,
                description=MISSION,
                options=UpOptions(),
                observer=watcher,
                began_s=0.0,
            )
            running = asyncio.create_task(launcher.run())
            await watcher.is_up.wait()
            began_s = clock.now_s()
            launcher.end("test", at_once=True)
            ended = await asker.ask(LAUNCHER.address, AwaitMissionEnd(), MissionEnded, within_s=60.0)
            await running
            assert [ordered_s[name] - began_s for name in ROOTS] == [0.0, 0.0, 0.0]
            assert clock.now_s() - began_s >= CUT_OFF_S, "the end is only complete when the last root has ended"
            assert ended.signaled == [ProcessEnded(ROOTS[0], EndedBy.SIGKILL, 0)]

    run_virtual(main())
