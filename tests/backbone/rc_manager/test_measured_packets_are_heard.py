"""A radio's RC says how long packets take: the RC manager plans by it, also after its restart; nonsense it refuses."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace
from rc_manager_at_work import PlainArc, Pool, a_pool, request
from test_credibility import why

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.rc_manager.messages import LONGEST_PACKET_S, RcState
from backbone.scheduling.requests import Holder, MeasuredPackets

Scene = Callable[[Pool], Awaitable[None]]
LINE = "its packets on radio take 30 ms, it declared 2: the longer time counts"


@pytest.fixture
def play(local_mission: Any, beside: Any, tmp_path: Path) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here:
                await scene(here)

        run_virtual(main())

    return run


def measure(here: Pool, *packets: tuple[str, float], kind: str = "") -> None:
    """Let the radio say from now on that packets of these ARCs take so long, and publish it."""
    radio = here.rcs["radio"]

    def measured(state: RcState) -> RcState:
        told = [MeasuredPackets(arc, kind, takes_s) for arc, takes_s in packets if arc in radio.holders]
        return replace(state, measured=told)

    radio.tells = measured
    holders = [Holder(arc, epoch, 0.0, 0.0) for arc, epoch in radio.holders.items()]
    state = RcState("radio", "command_radio", True, 1.0, holders, radio.last_epoch, 0, 0)
    radio.bus.publish(radio.address, Conversation.TELEMETRY, measured(state))


async def two_on_the_radio(here: Pool) -> tuple[PlainArc, PlainArc]:
    one, two = await here.arc("one"), await here.arc("two")
    await one.ask_for(request("one", "left", "radio"))
    await two.ask_for(request("two", "right", "radio"))
    await here.clock.sleep_s(1.0)
    assert one.is_open
    assert two.is_open
    return one, two


def test_two_that_are_too_much_for_the_radio_take_turns(play: Callable[[Scene], None]) -> None:
    async def scene(here: Pool) -> None:
        async with here.beside(here.manager()):
            one, two = await two_on_the_radio(here)
            measure(here, ("one", 0.03), ("two", 0.03))
            for _ in range(200):
                await here.clock.sleep_s(0.1)
                assert not (one.is_open and two.is_open)
            assert LINE in (await why(here, "one")).lines
            assert "packets" in {what for arc in (one, two) for what, _, _ in arc.log}
            for arc in (one, two):
                assert len([at_s for what, _, at_s in arc.log if what == "open"]) >= 2

    play(scene)


def test_an_rc_manager_that_starts_later_hears_it_too(play: Callable[[Scene], None]) -> None:
    async def scene(here: Pool) -> None:
        async with here.beside(here.manager()):
            one, two = await two_on_the_radio(here)
        measure(here, ("one", 0.03), ("two", 0.03))
        async with here.beside(here.manager()):
            await here.clock.sleep_s(3.0)
            assert one.is_open is not two.is_open
            assert any(line.startswith(LINE[:30]) for line in (await why(here, "one")).lines)

    play(scene)


@pytest.mark.parametrize("takes_s", [0.0, LONGEST_PACKET_S * 2, math.nan, math.inf, -1.0, 1e300])
def test_a_time_that_no_packet_takes_cuts_no_slice(play: Callable[[Scene], None], takes_s: float) -> None:
    """The publication is refused; the RC itself is asked, and answers with sense."""

    async def scene(here: Pool) -> None:
        async with here.beside(here.manager()):
            one, two = await two_on_the_radio(here)
            measure(here, ("one", takes_s))
            here.rcs["radio"].tells = lambda state: state
            await here.clock.sleep_s(2.0)
            assert one.is_open
            assert two.is_open
            assert len((await why(here, "one")).lines) == 1

    play(scene)


def test_packets_that_nobody_asked_for_change_nothing(play: Callable[[Scene], None]) -> None:
    async def scene(here: Pool) -> None:
        async with here.beside(here.manager()):
            one, two = await two_on_the_radio(here)
            measure(here, ("one", 0.03), ("two", 0.03), kind="jump")
            await here.clock.sleep_s(2.0)
            assert one.is_open
            assert two.is_open

    play(scene)
