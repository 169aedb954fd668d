"""A virtual mission refuses what could not cross the bus between processes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from sample_modules import Number

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.ranges import Bulk
from backbone.wire import MAX_MESSAGE_BYTES, MalformedMessage, Message, OversizedMessage, UnwritableMessage
from mission_control.laboratory.module_kit.encoding_network import EncodingBus, EncodingNetwork
from mission_control.laboratory.module_kit.virtual_mission import play
from mission_control.laboratory.simulation.whole_mission import RunningMission

WRONG: list[tuple[object, type[Refusal]]] = [
    ("a text", MalformedMessage),
    (object(), UnwritableMessage),
    (2**70, UnwritableMessage),
]
AT = "mission_control/test"


class Picture(Message, frozen=True):
    pixels: Bulk


def wrong(value: Any) -> Number:
    return Number(value)  # as a module without types makes it


def between_two(scene: Callable[[EncodingBus, EncodingBus], Awaitable[None]]) -> None:
    async def main() -> None:
        network, clock = EncodingNetwork(), VirtualClock()
        here, there = network.join(AT, clock), network.join("mission_control/other", clock)
        await scene(here, there)
        await here.close()
        await there.close()

    run_virtual(main())


@pytest.mark.parametrize(("value", "refusal"), WRONG)
def test_what_cannot_be_sent_is_refused_at_its_sender(value: object, refusal: type[Refusal]) -> None:
    async def scene(here: EncodingBus, there: EncodingBus) -> None:
        async def answer(asked: object) -> Message:
            return wrong(value)

        there.serve("mission_control/other", Number, answer)
        with pytest.raises(refusal) as published:
            here.publish(AT, Conversation.OUTPUTS, wrong(value))
        assert published.value.remedy
        with pytest.raises(refusal):
            await here.ask("mission_control/other", wrong(value), Number, within_s=1.0)
        with pytest.raises(refusal):
            await here.ask("mission_control/other", Number(1.0), Number, within_s=1.0)

    between_two(scene)


def test_a_message_is_as_long_as_its_conversation_admits() -> None:
    async def scene(here: EncodingBus, _there: EncodingBus) -> None:
        long = Picture(memoryview(bytes(MAX_MESSAGE_BYTES + 1)))
        here.publish(AT, Conversation.OUTPUTS, long)  # a blackboard takes it
        with pytest.raises(OversizedMessage):
            here.publish(AT, Conversation.EVENTS, long)

    between_two(scene)


@pytest.mark.processes
def test_a_virtual_mission_refuses_it(tmp_path: Path) -> None:
    async def scene(running: RunningMission) -> None:
        running.bus.publish(AT, Conversation.EVENTS, wrong("a text"))

    with pytest.raises(MalformedMessage, match="Expected `float`, got `str`"):
        play('<mission name="m" priority="1"/>', scene)
