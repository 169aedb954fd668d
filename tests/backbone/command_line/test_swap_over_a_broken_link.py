"""``swap`` whose answer is lost, because the hub, the link or the process ended during the exchange."""

from __future__ import annotations

import asyncio

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line.swapping import swapped_by
from backbone.errors import LinkError
from backbone.exchange import ExchangeRunning, SwapModule, Swapped, UnknownExchange
from backbone.exchange_answers import ExchangeAnswers
from backbone.wire import Envelope, Message

UNIT, ASKED = "mission_control/waves", SwapModule("smoothing", "pair:Smoothing")
PROVED = Swapped(True, "", True, 0.0, 5.0, 100)
LASTS_S, BREAKS_S = 5.0, 1.0


class Unit:
    """A unit that exchanges for 5 s; its link can break, so that the answer is lost."""

    def __init__(self, refuses: bool = False) -> None:
        self.network, self.clock, self.begun = LocalNetwork("m"), VirtualClock(), 0
        self.answers, self.refuses = ExchangeAnswers(), refuses
        self.answering: list[asyncio.Future[Swapped]] = []
        self.asker = self.network.join("ui_console/asker", self.clock)
        self.bus = self.up()

    def up(self) -> LocalBus:
        self.bus = self.network.join(UNIT, self.clock)
        self.bus.serve(UNIT, SwapModule, self.answer)
        return self.bus

    async def exchange(self) -> Swapped:
        self.begun += 1
        await self.clock.sleep_s(LASTS_S)
        if self.refuses:
            raise ExchangeRunning("waves is exchanging wave")
        return PROVED

    async def answer(self, asked: Envelope[Message]) -> Message:
        assert isinstance(asked.body, SwapModule)
        answering = asyncio.ensure_future(self.answers.answer(asked.body, self.exchange))
        self.answering.append(answering)
        answering.add_done_callback(lambda done: done.cancelled() or done.exception())  # its asker may be gone
        return await asyncio.shield(answering)  # a component outlives its link

    async def swapped(self) -> Swapped:
        asking = asyncio.create_task(swapped_by(self.asker, self.clock, UNIT, ASKED, within_s=60.0))
        await self.clock.sleep_s(BREAKS_S)
        await self.bus.close()
        await self.clock.sleep_s(BREAKS_S)
        return await asking


def test_an_exchange_that_outlasts_its_link_is_reported_once_it_is_over() -> None:
    async def scene() -> None:
        unit = Unit()
        asyncio.get_running_loop().call_later(2 * BREAKS_S, unit.up)
        assert await unit.swapped() == PROVED
        assert unit.begun == 1
        assert unit.clock.now_s() == pytest.approx(LASTS_S, abs=0.01)

    run_virtual(scene())


def test_an_answer_that_was_ready_while_the_link_was_broken_is_given_later() -> None:
    async def scene() -> None:
        unit = Unit()
        asyncio.get_running_loop().call_later(2 * LASTS_S, unit.up)
        assert await unit.swapped() == PROVED
        assert unit.begun == 1

    run_virtual(scene())


def test_a_lost_refusal_is_repeated() -> None:
    async def scene() -> None:
        unit = Unit(refuses=True)
        asyncio.get_running_loop().call_later(2 * LASTS_S, unit.up)
        with pytest.raises(ExchangeRunning):
            await unit.swapped()

    run_virtual(scene())


def test_a_component_that_was_started_again_begins_no_second_exchange() -> None:
    async def scene() -> None:
        unit = Unit()

        def started_again() -> None:
            unit.answering[0].cancel()
            unit.answers = ExchangeAnswers()
            unit.up()

        asyncio.get_running_loop().call_later(2 * BREAKS_S, started_again)
        with pytest.raises(UnknownExchange, match="started again"):
            await unit.swapped()
        assert unit.begun == 1

    run_virtual(scene())


def test_a_component_that_does_not_come_back_is_not_waited_for_ever() -> None:
    async def scene() -> None:
        unit = Unit()
        with pytest.raises(LinkError):
            await unit.swapped()
        assert unit.clock.now_s() < 30.0

    run_virtual(scene())


def test_two_requests_without_an_id_are_two_exchanges() -> None:
    async def scene() -> None:
        unit = Unit()
        for _again in range(2):
            await unit.asker.ask(UNIT, ASKED, Swapped, within_s=60.0)
        assert unit.begun == 2

    run_virtual(scene())
