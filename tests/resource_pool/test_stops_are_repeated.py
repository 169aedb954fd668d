"""A robot's RC repeats a stop that its radio did not take until the stop is confirmed, without an operator."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest
from pool_on_local_network import Pool, a_pool
from pool_orders import at, connect, disconnect

from backbone.bus.clock import run_virtual
from backbone.component.messages import ComponentState
from backbone.keys import Conversation
from resource_pool.arc_client import StopState, ask_stop, lift_stop, stop_robot, watch_stops
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import COMMAND_TIMEOUT_S, LoadPacket, PacketLoaded
from resource_pool.rcs.robot import RADIO_REPLY_S
from scout_model.radio_link import encode_halt

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from backbone.wire import Envelope, Message

OPERATOR = "ui_console/console-1"
REFUSED = 4


@dataclass
class FaultyRadio:
    """Answers in the radio's place: first by refusals or not at all, later as a radio that works.

    Attributes:
        works: True: it accepts packets.
        is_silent: True: while it does not work, it answers nothing.
        holds_back: Set when it may answer the packets that it accepts; None: at once.
    """

    pool: Pool
    works: bool = False
    is_silent: bool = False
    holds_back: asyncio.Event | None = None
    asked_s: list[float] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)

    async def answer(self, asked: Envelope[Any]) -> Message:
        self.asked_s.append(self.pool.clock.now_s())
        if not self.works and self.is_silent:
            await asyncio.Event().wait()
        if not self.works:
            raise HardwareFault("the antenna fell off")
        if self.holds_back is not None:
            await self.holds_back.wait()
        self.payloads.append(asked.body.payload)
        self.numbers.append(asked.body.robot_stop)
        return PacketLoaded()


@asynccontextmanager
async def a_faulty_radio(mission: Any, *, is_silent: bool = False) -> AsyncIterator[tuple[Pool, FaultyRadio]]:
    """Give a pool in which the ARC ``one`` holds scout1, whose radio accepts no packet."""
    async with a_pool(mission, ["scout1"], manager=False) as pool:
        radio = FaultyRadio(pool, is_silent=is_silent)
        pool.voice("radio").serve(at("radio"), LoadPacket, radio.answer)
        await connect(pool, "scout1", "one", 5, lease_s=60.0, companions={"scout1": 5, "radio": 6})
        yield pool, radio


@pytest.mark.parametrize("is_silent", [False, True], ids=["refusing", "silent"])
def test_a_stop_is_repeated_under_the_grant_until_the_radio_takes_it_and_every_screen_knows(
    local_mission: Any, is_silent: bool
) -> None:
    async def main() -> None:
        async with a_faulty_radio(local_mission, is_silent=is_silent) as (pool, radio):
            operator, heard = pool.voice_of(OPERATOR), list[StopState]()
            watch_stops(operator, heard.append)
            statuses: list[ComponentState] = []
            operator.subscribe(at("scout1"), Conversation.STATUS, ComponentState, lambda one: statuses.append(one.body))
            stop = await stop_robot(operator, "scout1", "a child", "anna")
            assert not stop.is_confirmed
            while len(radio.asked_s) < REFUSED:
                await pool.clock.sleep_s(0.01)
            assert not (await ask_stop(operator, "scout1")).is_confirmed
            radio.works = True
            await pool.clock.sleep_s(2 * RADIO_REPLY_S + 0.01)
            now = await ask_stop(operator, "scout1")
            assert (now.number, now.by, now.is_confirmed) == (stop.number, "anna", True)
            assert heard[-1] == now
            standing = statuses[-1].stop
            assert standing is not None
            assert standing.is_confirmed
            await pool.clock.sleep_s(5.0)
            assert radio.payloads == [encode_halt()], "a stop that is confirmed is not repeated"
            pauses = [later - at_s for at_s, later in zip(radio.asked_s, radio.asked_s[1:], strict=False)]
            assert min(pauses) >= RADIO_REPLY_S - 0.001

    run_virtual(main())


def test_a_lift_ends_the_repetitions(local_mission: Any) -> None:
    async def main() -> None:
        async with a_faulty_radio(local_mission) as (pool, radio):
            operator = pool.voice_of(OPERATOR)
            await lift_stop(operator, await stop_robot(operator, "scout1", ""))
            radio.works, asked = True, len(radio.asked_s)
            await pool.clock.sleep_s(5.0)
            assert len(radio.asked_s) == asked
            assert not (await ask_stop(operator, "scout1")).is_stopped

    run_virtual(main())


def test_a_newer_stop_is_the_one_that_is_repeated_and_each_is_sent_once_in_turn(local_mission: Any) -> None:
    async def main() -> None:
        async with a_faulty_radio(local_mission) as (pool, radio):
            operator = pool.voice_of(OPERATOR)
            for _press in range(3):
                last = await stop_robot(operator, "scout1", "")
            radio.works, asked = True, len(radio.asked_s)
            await pool.clock.sleep_s(5.0)
            assert len(radio.asked_s) == asked + 1
            assert radio.numbers == [last.number]
            assert (await ask_stop(operator, "scout1")).is_confirmed

    run_virtual(main())


def test_a_stop_that_outlives_its_holder_is_confirmed_when_no_former_packet_moves_the_robot(local_mission: Any) -> None:
    async def main() -> None:
        async with a_faulty_radio(local_mission) as (pool, radio):
            operator = pool.voice_of(OPERATOR)
            await stop_robot(operator, "scout1", "")
            await disconnect(pool, "scout1", "one", 5)
            await pool.clock.sleep_s(2 * COMMAND_TIMEOUT_S + RADIO_REPLY_S)
            assert (await ask_stop(operator, "scout1")).is_confirmed
            assert not radio.payloads

    run_virtual(main())


def test_the_next_holders_radio_confirms_a_stop_of_before(local_mission: Any) -> None:
    async def main() -> None:
        async with a_faulty_radio(local_mission) as (pool, radio):
            operator = pool.voice_of(OPERATOR)
            await stop_robot(operator, "scout1", "")
            await disconnect(pool, "scout1", "one", 5)
            radio.works = True
            await connect(pool, "scout1", "two", 8, companions={"scout1": 8, "radio": 9})
            await pool.clock.sleep_s(2 * RADIO_REPLY_S)
            assert (await ask_stop(operator, "scout1")).is_confirmed

    run_virtual(main())


def test_the_answer_to_an_earlier_stop_does_not_confirm_a_later_one(local_mission: Any) -> None:
    """The radio took the earlier one before the robot was freed, and moved it since."""

    async def main() -> None:
        async with a_faulty_radio(local_mission) as (pool, radio):
            operator, answered = pool.voice_of(OPERATOR), asyncio.Event()
            radio.works, radio.holds_back = True, answered
            first = asyncio.create_task(stop_robot(operator, "scout1", ""))
            await pool.clock.sleep_s(0.1)
            radio.holds_back = None
            await lift_stop(operator, await ask_stop(operator, "scout1"))
            radio.works = False
            later = await stop_robot(operator, "scout1", "")
            assert not later.is_confirmed
            answered.set()
            await first
            assert not (await ask_stop(operator, "scout1")).is_confirmed

    run_virtual(main())
