"""A process that blocks its event loop again and again is told once, and once more with the count when that ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
from in_process_zygote import InProcessZygote
from test_creator_service import CREATOR, TYPES, order

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.heartbeat import Vitals
from backbone.component.launch import Launch
from backbone.component.messages import StoryEvent
from backbone.component.recurring import CALM_S
from backbone.creator.messages import Spawned
from backbone.creator.service import Creator
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Envelope

BLOCKED_S = 1.0


def test_silences_that_come_again_and_again_are_told_once(local_mission: Any, beside: Any, tmp_path: Path) -> None:
    clock, blocks = VirtualClock(), [False]

    def vitals(_run_directory: str, _pid: int) -> Vitals:
        return Vitals(1 + int(clock.now_s() / (BLOCKED_S if blocks[0] else 0.1)))

    async def main() -> None:
        async with local_mission() as network:
            asked: dict[str, Any] = {"tags": [], "preload": [], "types": [msgspec.to_builtins(one) for one in TYPES]}
            of = (Subsystem.BACKBONE, "creator-lab", "creator", "x:Y", "lab", "", 0.0, 1.0, asked)
            launch = Launch("local", *of, run_directory=str(tmp_path))
            bus, told = network.join(PLACER, clock), list[str]()

            def hear(heard: Envelope[StoryEvent]) -> None:
                if heard.body.subject == "scout1":
                    told.append(heard.body.what)

            bus.subscribe(CREATOR, Conversation.LOG, StoryEvent, hear)
            async with beside(Creator(launch, network.join(CREATOR, clock), clock, InProcessZygote(network), vitals)):
                await bus.ask(CREATOR, order("Quiet", "scout1"), Spawned, within_s=30.0)
                blocks[0] = True
                await clock.sleep_s(10.5 * BLOCKED_S)
                assert len(told) == 1, told
                blocks[0] = False
                await clock.sleep_s(CALM_S + 1.0)
                assert told[0].startswith("shows no sign of life for ")
                assert told[1:] == ["responds again, after 10 silences"]
                blocks[0] = True
                await clock.sleep_s(1.5 * BLOCKED_S)
                blocks[0] = False
                await clock.sleep_s(CALM_S + 1.0)
                assert told[3:] == ["responds again"]
            await bus.close()

    run_virtual(main())
