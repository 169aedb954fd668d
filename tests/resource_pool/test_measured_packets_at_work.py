"""A radio measures longer packets than were declared: its RC says so, and the RC manager plans with the longer time."""

from __future__ import annotations

import contextlib
from typing import Any

from pool_on_local_network import Pool, a_pool
from test_radio_at_work import ASK, DRIVE, RADIO, connect, disconnect, load

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.rc_manager.messages import AskAttributes, AskRc, AskWhy, RcState, TraceLine
from backbone.scheduling.requests import MeasuredPackets
from backbone.scheduling.views import Attributes, Why
from resource_pool.messages import SwappedOut


async def measured(pool: Pool) -> list[MeasuredPackets]:
    return (await pool.ear.ask(RADIO, AskRc(), RcState, within_s=1)).measured


async def why(pool: Pool, name: str) -> list[str]:
    return (await pool.ear.ask(RC_MANAGER, AskWhy(name), Why, within_s=1)).lines


def test_the_radio_tells_the_longest_of_each_kind_until_the_arc_is_disconnected(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            published: list[list[MeasuredPackets]] = []
            pool.ear.subscribe(RADIO, Conversation.TELEMETRY, RcState, lambda e: published.append(e.body.measured))
            await connect(pool, "one", 1, DRIVE, ASK)
            await load(pool, "one", 1, b"D")
            await pool.clock.sleep_s(1.0)
            assert await measured(pool) == []
            pool.radio_driver.slow_s = 0.0043
            await pool.clock.sleep_s(1.0)
            assert await measured(pool) == [MeasuredPackets("one", "drive", 0.0043)]
            assert published[-1] == await measured(pool)
            pool.radio_driver.slow_s = 0.001
            await pool.clock.sleep_s(2.0)
            assert await measured(pool) == [MeasuredPackets("one", "drive", 0.0043)]
            await disconnect(pool, "one", 1)
            assert await measured(pool) == []

    run_virtual(main())


def test_two_arcs_whose_packets_are_too_long_for_one_radio_take_turns(local_mission: Any) -> None:
    """By what they declared they take 8 % of the radio together; by what is measured each takes 60 %."""

    async def main() -> None:
        async with a_pool(local_mission, ["radio", "scout1", "scout2"]) as pool:
            pool.radio_driver.slow_s = 0.03
            lines: list[dict[str, Any]] = []
            pool.ear.subscribe(RC_MANAGER, Conversation.EVENTS, TraceLine, lambda e: lines.append(e.body.line))
            arcs = {}
            for number in (1, 2):
                owner = await pool.owner(f"walk{number}")
                arcs[number] = await pool.arc(owner, "drive", f"scout{number}", usage=[DRIVE])
            for _ in range(200):
                for arc in arcs.values():
                    with contextlib.suppress(SwappedOut):
                        await arc.drive(1.0, 1.0)
                await pool.clock.sleep_s(0.1)
            running: set[str] = set()
            together_s = [line["t"] for line in lines if _together(running, line)]
            began_s = next(line["t"] for line in lines if line["ev"] == "grant")
            assert all(at_s < began_s + 1.0 for at_s in together_s), "until the first packets were measured"
            assert all(sum(_is(line, "grant", f"walk{n}-drive") for line in lines) >= 2 for n in (1, 2))
            [asked] = (await pool.ear.ask(RC_MANAGER, AskAttributes("walk1"), Attributes, within_s=1)).requests
            assert asked.uses["radio"].streams[0].packet_time_s == 0.03
            line = "its drive packets on radio take 30 ms, it declared 2: the longer time counts"
            assert line in await why(pool, "walk1-drive")

    run_virtual(main())


def _is(line: dict[str, Any], event: str, arc: str) -> bool:
    return (line["ev"], line.get("arc")) == (event, arc)


def _together(running: set[str], line: dict[str, Any]) -> bool:
    """Take in a line; return whether it grants an ARC while the other runs."""
    match line["ev"]:
        case "grant":
            running.add(line["arc"])
            return len(running) == 2
        case "revoke":
            running.discard(line["arc"])
    return False
