"""The command radio carries out what was admitted, and says when it cannot."""

from __future__ import annotations

import asyncio
import itertools
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.component.messages import AskStatistics, Statistics, StoryEvent
from backbone.keys import Conversation
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected, Leases, StaleEpoch
from backbone.scheduling.requests import Lease, RcUse, Usage
from resource_pool.messages import LoadPacket, NoTurnSoon, PacketLoaded
from resource_pool.published_motions import AskLastMove, LastMove
from resource_pool.rcs.command_radio import CommandRadio

RADIO = "resource_pool/radio"
DRIVE, ASK = Usage(0.05, 0.002, kind="drive"), Usage(0.2, 0.002, kind="ask")


async def connect(pool: Pool, arc: str, epoch: int, *streams: Usage, robot: str = "scout1", rank: int = 0) -> None:
    order = Connect(arc, epoch, 60.0, RcUse(list(streams)), {robot: epoch, "radio": epoch}, rank)
    await pool.manager_voice.ask(RADIO, order, Connected, within_s=1)


async def disconnect(pool: Pool, arc: str, epoch: int) -> None:
    await pool.manager_voice.ask(RADIO, Disconnect(arc, epoch), Disconnected, within_s=1)


async def load(pool: Pool, arc: str, epoch: int, payload: bytes, robot: str = "scout1", **more: Any) -> None:
    order = LoadPacket(arc, epoch, int(robot[-1]), payload, b"S", epoch, **more)
    await pool.voice(robot).ask(RADIO, order, PacketLoaded, within_s=1)


def radio_log(pool: Pool) -> list[tuple[str, str]]:
    """Return what the radio says from now on about whom; grows."""
    said: list[tuple[str, str]] = []

    def heard(envelope: Any) -> None:
        said.append((envelope.body.subject, envelope.body.what))

    pool.ear.subscribe(RADIO, Conversation.LOG, StoryEvent, heard)
    return said


async def statistics(pool: Pool) -> dict[str, float]:
    return (await pool.ear.ask(RADIO, AskStatistics(), Statistics, within_s=1)).values


def test_it_knows_when_it_last_took_a_packet_that_moves_a_robot(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:

            async def moved(network_id: int) -> LastMove:
                return await pool.ear.ask(RADIO, AskLastMove(network_id), LastMove, within_s=1)

            await connect(pool, "one", 1, DRIVE)
            await pool.clock.sleep_s(1.0)
            await load(pool, "one", 1, b"H")
            assert (await moved(1)).at_s is None
            before_s = pool.clock.now_s()
            await load(pool, "one", 1, b"D", moves=True)
            await pool.clock.sleep_s(1.0)
            await load(pool, "one", 1, b"H")
            told, other = await moved(1), await moved(2)
            assert told.at_s == pytest.approx(before_s, abs=0.1)
            assert (other.at_s, other.since_s) == (None, told.since_s)
            assert told.since_s < before_s

    run_virtual(main())


def test_a_radio_of_ones_own_answers_the_same_questions() -> None:
    class OwnRadio(CommandRadio):
        pass

    assert OwnRadio.accepts == CommandRadio.accepts


def test_each_kind_of_request_is_sent_at_its_own_constant_interval(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await connect(pool, "one", 1, DRIVE, ASK)
            await load(pool, "one", 1, b"D")
            await load(pool, "one", 1, b"A", kind="ask")
            await pool.clock.sleep_s(1.0)
            for payload, period_s in ((b"D", 0.05), (b"A", 0.2)):
                times = [heard.at_s for heard in pool.radio_driver.heard if heard.payload == payload]
                assert len(times) == pytest.approx(1.0 / period_s, abs=1)
                for nth, at_s in enumerate(times):
                    assert at_s - times[0] == pytest.approx(nth * period_s, abs=0.0021)
            found = await statistics(pool)
            assert (found["overruns"], found["overruns_one"]) == (0, 0)
            assert 0 < found["worst_packet_s_one"] < 0.002

    run_virtual(main())


def test_who_sends_at_once_as_often_as_it_can_takes_nobody_elses_turns(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await connect(pool, "greedy", 1, DRIVE)
            await connect(pool, "modest", 2, Usage(0.05, 0.04, kind="drive"), robot="scout2", rank=1)
            await load(pool, "modest", 2, b"M", "scout2")

            async def hurry() -> None:
                while True:
                    await load(pool, "greedy", 1, b"J", at_once=True)

            hurrying = [asyncio.create_task(hurry()) for _ in range(4)]
            await pool.clock.sleep_s(2.0)
            for task in hurrying:
                task.cancel()
            await asyncio.gather(*hurrying, return_exceptions=True)
            assert [heard.payload for heard in pool.radio_driver.heard].count(b"J") == pytest.approx(40, abs=1)
            found = await statistics(pool)
            assert (found["overruns_greedy"], found["overruns_modest"]) == (0, 0)

    run_virtual(main())


def test_a_packet_that_takes_longer_than_declared_raises_one_alarm_for_each_stream(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            said = radio_log(pool)
            await connect(pool, "one", 1, DRIVE, ASK)
            await load(pool, "one", 1, b"D")
            await pool.clock.sleep_s(0.5)
            assert not said
            pool.radio_driver.slow_s = 0.01
            await load(pool, "one", 1, b"A", kind="ask")
            await pool.clock.sleep_s(1.0)
            assert [(arc, what.partition(": ")[2].partition(",")[0]) for arc, what in said] == [
                ("one", "drive packets take 10 ms on the air"),
                ("one", "ask packets take 10 ms on the air"),
            ]
            found = await statistics(pool)
            assert found["worst_packet_s_one"] == found["worst_packet_s"] == 0.01
            times = [heard.at_s for heard in pool.radio_driver.heard][-10:]
            assert min(later - at_s for at_s, later in itertools.pairwise(times)) >= 0.01 - 1e-9
            pool.radio_driver.slow_s = 0.06
            await pool.clock.sleep_s(0.5)
            assert "not always done within 0.05 s" in said[2][1]
            await disconnect(pool, "one", 1)
            assert "of its packets on radio were late or lost" in said[-1][1]
            assert len([what for _, what in said if "declared" in what]) == 2
            assert (await statistics(pool))["overruns"] > 0

    run_virtual(main())


def test_a_simulated_radio_takes_as_long_as_the_bytes_at_its_rate(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            await pool.rc("radio", options={"bits_per_s": 9600})
            said = radio_log(pool)
            await connect(pool, "one", 1, DRIVE)
            await load(pool, "one", 1, b"D12345678")
            await pool.clock.sleep_s(0.2)
            assert (await statistics(pool))["worst_packet_s_one"] == pytest.approx(12 * 10 / 9600)
            assert "12.5 ms on the air, 2 ms were declared" in said[0][1]

    run_virtual(main())


def test_what_must_go_soon_is_refused_in_a_stream_too_slow_for_it_and_goes_in_one_of_its_own(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await connect(pool, "one", 1, Usage(5.0, 0.002, kind="drive"))
            await load(pool, "one", 1, b"D")
            await pool.clock.sleep_s(0.5)
            with pytest.raises(NoTurnSoon):
                await load(pool, "one", 1, b"J", at_once=True, kind="jump")
            await connect(pool, "one", 2, Usage(5.0, 0.002, kind="drive"), Usage(5.0, 0.002, kind="jump"))
            await load(pool, "one", 2, b"D")
            await pool.clock.sleep_s(0.5)
            await load(pool, "one", 2, b"J", at_once=True, kind="jump")
            assert pool.radio_driver.heard[-1].payload == b"J"
            assert [heard.payload for heard in pool.radio_driver.heard].count(b"J") == 1

    run_virtual(main())


def test_who_loses_the_radio_before_its_packets_turn_is_told_that_nothing_was_sent(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await connect(pool, "one", 1, Usage(0.25, 0.002, kind="drive"))
            await load(pool, "one", 1, b"D")
            await pool.clock.sleep_s(0.01)
            jumping = asyncio.create_task(load(pool, "one", 1, b"J", at_once=True))
            await pool.clock.sleep_s(0.01)
            await disconnect(pool, "one", 1)
            with pytest.raises(StaleEpoch):
                await jumping
            await pool.clock.sleep_s(1.0)
            assert [heard.payload for heard in pool.radio_driver.heard] == [b"D", b"S"]
            found = await statistics(pool)
            assert (found["applied"], found["refused_stale"]) == (1, 1)

    run_virtual(main())


def test_an_arc_that_others_come_before_gives_way_to_them_from_its_next_renewal_on(local_mission: Any) -> None:
    """Who was alone when it was connected has rank 0; that must not last."""

    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await connect(pool, "low", 1, Usage(0.05, 0.02, kind="drive"))
            await connect(pool, "high", 2, Usage(0.1, 0.02, kind="drive"), robot="scout2")
            await asyncio.gather(load(pool, "low", 1, b"L"), load(pool, "high", 2, b"H", "scout2"))
            await pool.clock.sleep_s(0.49)
            begun_s = pool.radio_driver.heard[0].at_s
            firsts = []
            for ranks in ({}, {"low": 1, "high": 0}, {"low": -1, "high": -1}):
                leases = [Lease("radio", arc, 1 + (arc == "high"), rank) for arc, rank in ranks.items()]
                pool.manager_voice.publish(RC_MANAGER, Conversation.LEASES, Leases(leases, 60.0))
                heard = len(pool.radio_driver.heard)
                await pool.clock.sleep_s(1.0)
                # Both are released at once every 0.1 s.
                both = [p for p in pool.radio_driver.heard[heard:] if round((p.at_s - begun_s) * 1e6) % 100_000 == 0]
                assert len(both) == 10
                firsts.append({packet.payload for packet in both})
            assert firsts == [{b"L"}, {b"H"}, {b"H"}]

    run_virtual(main())
