"""An exit in a class is its bug, also if it has replaced another one; the process does not end at once."""

from __future__ import annotations

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import AskState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.wire import WIRE_VERSION, Envelope, Message
from mission_control.gated_bus import GatedBus

AT = "mission_control/turner"
EVENT = StoryEvent(0.0, AT, "sees a picture", "turner", "", LogLevel.INFO, "")


def leave(_heard: Envelope[Message]) -> None:
    raise SystemExit(3)


async def leave_later(_asked: Envelope[Message]) -> Message:
    raise KeyboardInterrupt


@pytest.mark.parametrize("is_first", [True, False])
def test_an_exit_in_a_listener(is_first: bool) -> None:
    bugs: list[BaseException] = []

    async def main() -> None:
        bus = LocalNetwork().join(AT, VirtualClock())
        gate = GatedBus(bus, is_first=is_first)
        gate.on_bug = bugs.append
        gate.subscribe(AT, Conversation.LOG, StoryEvent, leave)
        bus.publish(AT, Conversation.LOG, EVENT)
        await VirtualClock().sleep_s(0.1)
        await bus.close()

    run_virtual(main())
    assert [str(bug).split(" (")[0] for bug in bugs] == ["SystemExit: 3"]


def test_an_exit_in_an_answer() -> None:
    async def main() -> None:
        gate = GatedBus(LocalNetwork().join(AT, VirtualClock()), is_first=False)
        gate.serve(AT, AskState, leave_later)
        with pytest.raises(RuntimeError, match="KeyboardInterrupt"):
            await gate.answer(Envelope(WIRE_VERSION, AT, 1, 0.0, "", AskState()))

    run_virtual(main())
