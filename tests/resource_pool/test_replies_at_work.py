"""Robots reply on their radio: from the simulated air to readings, counts and alarms."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from pool_on_local_network import OnAir, a_pool
from replying_pool import (
    AIR,
    BITS_PER_S,
    DEAF,
    HEARING,
    RADIO,
    RCS,
    SCOUT1,
    asked,
    counts,
    drive,
    granted,
    other_world,
    overhear,
    pool_in,
    said,
    world_with,
)

from backbone.bus.clock import run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from resource_pool.arc_client import Readings, watch_readings
from resource_pool.drivers.simulated import REPLY_EVERY_S
from resource_pool.drivers.world_messages import RadioPacket, ReplyOnAir
from resource_pool.rcs.scout import Scout
from scout_model import radio_link

REPLY_BITS = radio_link.packet_bits(radio_link.encode_reply(radio_link.ScoutReply(1.0, 0.0, 0.0)))


def test_a_scout_lists_its_reports_with_units_and_ranges() -> None:
    forms = [(form.name, form.unit, form.least, form.most) for form in Scout.abilities().reports]
    assert forms == [
        ("battery_share", "", 0.0, 1.0),
        ("tilt_rad", "rad", 0.0, math.pi),
        ("motor_load_share", "", 0.0, 1.0),
    ]
    assert all(form.doc for form in Scout.abilities().reports)


def test_the_battery_falls_while_the_robot_drives_and_its_readings_come_twice_a_second_at_most(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with(battery_j=20.0)) as pool:
            assert (await asked(pool)).at_s < 0
            published: list[Readings] = []
            watch_readings(pool.voice_of("ui_console/ear"), published.append)
            times_s: list[float] = []
            pool.voice_of("ui_console/ear").subscribe(
                SCOUT1, Conversation.READINGS, Readings, lambda heard: times_s.append(heard.stamp_s)
            )
            await drive(pool, 20.0, await granted(pool))
            charges = [readings.values["battery_share"] for readings in published]
            assert charges == sorted(charges, reverse=True)
            assert charges[0] > 0.95
            assert charges[-1] < 0.75
            assert {readings.rc for readings in published} == {"scout1"}
            assert set(published[0].values) == {"battery_share", "tilt_rad", "motor_load_share"}
            assert 30 <= len(times_s) <= 41
            assert min(after - before for before, after in itertools.pairwise(times_s)) >= REPLY_EVERY_S - 1e-9
            newest = await asked(pool)
            assert newest.values["battery_share"] <= charges[-1]
            assert newest.at_s == pytest.approx(pool.clock.now_s(), abs=2 * REPLY_EVERY_S)
            assert (await asked(pool, "scout2")).at_s < 0

    run_virtual(main())


def test_a_low_battery_is_one_alarm_and_its_charging_one_notice(local_mission: Any) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with(battery_j=6.0)) as pool:
            events = overhear(pool, SCOUT1, Conversation.LOG, StoryEvent)
            arc = await granted(pool)
            await drive(pool, 8.0, arc)
            assert not said(events)
            await drive(pool, 7.0, arc)
            [(level, subject, what)] = said(events)
            assert (level, subject) == (LogLevel.ALARM, "scout1")
            assert what.startswith("its battery is low: ")
            await other_world(pool, world_with(battery_j=500.0))
            await drive(pool, 3.0, arc)
            assert said(events)[1:] == [(LogLevel.NOTICE, "scout1", "its battery is charged again: 100%")]

    run_virtual(main())


def test_the_alarms_share_is_a_parameter_of_the_robot(local_mission: Any) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with(battery_j=6.0)) as pool:
            events = overhear(pool, SCOUT1, Conversation.LOG, StoryEvent)
            await pool.end("scout1")
            await pool.rc("scout1", battery_alarm_share=0.9)
            await drive(pool, 5.0, await granted(pool))
            [(level, _, what)] = said(events)
            assert level is LogLevel.ALARM
            assert what in {"its battery is low: 89% left", "its battery is low: 90% left"}

    run_virtual(main())


def test_the_radio_counts_the_replies_time_on_the_air(local_mission: Any) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with()) as pool:
            packets = overhear(pool, AIR, Conversation.COMMAND, RadioPacket)
            await drive(pool, 5.0, await granted(pool))
            asking = [packet for packet in packets if packet.asks]
            assert 9 <= len(asking) <= 11
            bits = sum(radio_link.packet_bits(packet.payload) for packet in packets) + len(asking) * REPLY_BITS
            assert counts(pool, "radio")["on_air_s"] == pytest.approx(bits / BITS_PER_S)
            worst_bits = max(radio_link.packet_bits(packet.payload) for packet in asking) + REPLY_BITS
            assert counts(pool, "radio")["worst_packet_s"] == pytest.approx(worst_bits / BITS_PER_S)
            assert all(packet.air_time_s == radio_link.packet_bits(packet.payload) / BITS_PER_S for packet in packets)

    run_virtual(main())


async def driven(mission: Any, driver: str, bits_per_s: float) -> tuple[list[OnAir], list[Any]]:
    """Drive two robots at once; return the packets, and where the robots were meanwhile."""
    async with a_pool(mission, RCS) as pool:
        await pool.end("radio")
        await pool.rc("radio", driver=driver, options={"bits_per_s": bits_per_s})
        places: list[Any] = []
        arcs = [await granted(pool, robot) for robot in ("scout1", "scout2")]
        for _ in range(20):
            await drive(pool, 0.25, *arcs)
            places.append((await pool.pose("scout1"), await pool.pose("scout2")))
        return [*pool.radio_driver.heard], places


def test_replies_within_the_declared_time_change_neither_packets_nor_motion(local_mission: Any) -> None:
    with_replies = run_virtual(driven(local_mission, HEARING, BITS_PER_S))
    without = run_virtual(driven(local_mission, DEAF, BITS_PER_S))
    assert len(with_replies[0]) > 180
    assert with_replies == without


def test_replies_beyond_the_declared_time_delay_packets_by_no_more_than_their_own(local_mission: Any) -> None:
    slow = 30_000.0
    with_replies, _ = run_virtual(driven(local_mission, HEARING, slow))
    without, _ = run_virtual(driven(local_mission, DEAF, slow))
    late_s = [
        reply.at_s - alone.at_s
        for robot in (1, 2)
        for reply, alone in zip(
            (packet for packet in with_replies if packet.network_id == robot),
            (packet for packet in without if packet.network_id == robot),
            strict=True,
        )
    ]
    assert min(late_s) > -1e-9
    assert max(late_s) == pytest.approx(REPLY_BITS / slow)


def test_replies_pass_the_same_air_as_packets_and_what_is_lost_is_counted_for_each_robot(local_mission: Any) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with(radio_loss=0.3)) as pool:
            packets = overhear(pool, AIR, Conversation.COMMAND, RadioPacket)
            arrived = overhear(pool, RADIO, Conversation.COMMAND, ReplyOnAir)
            await drive(pool, 60.0, await granted(pool), await granted(pool, "scout2"))
            found, air = counts(pool, "radio"), counts(pool, "world")
            asks = {
                robot: [packet for packet in packets if packet.asks and packet.network_id == robot] for robot in (1, 2)
            }
            assert found["replies"] == len(arrived) == air["replies_delivered"]
            assert air["replies_lost"] > 10
            for robot in (1, 2):
                came = sum(reply.network_id == robot for reply in arrived)
                assert len(asks[robot]) - came - 1 <= found[f"replies_lost_scout{robot}"] <= len(asks[robot]) - came
                assert came / len(asks[robot]) == pytest.approx(0.7 * 0.7, abs=0.12)
            assert {(reply.radio, reply.number) for reply in arrived} <= {
                (packet.radio, packet.number) for packet in packets if packet.asks
            }

    run_virtual(main())


def test_a_robot_that_does_not_answer_is_one_warning_and_one_notice_when_it_answers_again(local_mission: Any) -> None:
    async def main() -> None:
        async with pool_in(local_mission, world_with(radio_loss=1.0)) as pool:
            events = overhear(pool, RADIO, Conversation.LOG, StoryEvent)
            arc = await granted(pool)
            await drive(pool, 1.25, arc)
            assert not said(events)
            await drive(pool, 4.0, arc)
            assert said(events) == [(LogLevel.WARNING, "scout1", "does not answer on radio")]
            assert counts(pool, "radio")["replies_lost_scout1"] >= 9
            await other_world(pool, world_with())
            await drive(pool, 4.0, arc)
            assert said(events)[1:] == [(LogLevel.NOTICE, "scout1", "answers again on radio")]

    run_virtual(main())
