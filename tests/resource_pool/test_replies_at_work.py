"""Robots reply on their radio: from the simulated air to readings, counts and alarms."""

from __future__ import annotations

import itertools
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import pytest
from pool_on_local_network import WORLD, OnAir, Pool, WiretappedRadio, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from resource_pool.arc_client import ArcClient, Readings, ask_readings, watch_readings
from resource_pool.drivers.interface import DriverSite, ScoutReports
from resource_pool.drivers.simulated import REPLY_EVERY_S, SimulatedScoutProtocol
from resource_pool.drivers.world_messages import RadioPacket, ReplyOnAir
from resource_pool.messages import Reply
from resource_pool.rcs.scout import Scout
from resource_pool.simulated_world import SimulatedWorld
from scout_model import radio_link
from scout_model.description import AirDescription, RobotPlace, WorldDescription

RADIO, SCOUT1, AIR = (address(Subsystem.RESOURCE_POOL, name) for name in ("radio", "scout1", "world"))
BITS_PER_S = 115_200.0
REPLY_BITS = radio_link.packet_bits(radio_link.encode_reply(radio_link.ScoutReply(1.0, 0.0, 0.0)))
RCS = ["scout1", "scout2", "radio"]
HERE = "test_replies_at_work"
HEARING, DEAF = "pool_on_local_network:WiretappedRadio", f"{HERE}:DeafRadio"


class DeafRadio:
    """A radio of before there were replies."""

    options_type = WiretappedRadio.options_type

    def __init__(self, site: DriverSite) -> None:
        self._radio = WiretappedRadio(site)

    async def open(self) -> None:
        await self._radio.open()

    async def transmit(self, network_id: int, payload: bytes, **audit: Any) -> float | None:
        return await self._radio.transmit(network_id, payload, **audit)

    async def close(self) -> None:
        await self._radio.close()


class WildProtocol(SimulatedScoutProtocol):
    """Reads whatever it hears as a battery that is too full."""

    def read(self, payload: bytes) -> ScoutReports:
        return ScoutReports(5.0, 0.0, 0.0)


class Sonars(msgspec.Struct, frozen=True):
    """Reports of a robot with sonars, without ranges in their types."""

    battery_share: float
    ahead_m: float
    heading_rad: float
    echoes: int


class SonarProtocol(SimulatedScoutProtocol):
    """Reads an empty room, without an echo and without a compass, whatever it hears."""

    def read(self, payload: bytes) -> Any:
        return Sonars(0.5, math.inf, math.nan, 2**70)


class SonarScout(Scout):
    reports = Sonars


class SilentProtocol:
    """A protocol of before there were replies."""

    def __init__(self, site: DriverSite) -> None:
        self._protocol = SimulatedScoutProtocol(site)

    def __getattr__(self, word: str) -> object:
        if word == "read":
            raise AttributeError(word)
        return getattr(self._protocol, word)


class PassesOn:
    """Has no methods of its own: it passes all calls on, as a wrapper that counts them does."""

    def __init__(self, works: object) -> None:
        self._works = works

    def __getattr__(self, word: str) -> Any:
        return getattr(self._works, word)


class WrappedRadio(PassesOn):
    options_type = WiretappedRadio.options_type

    def __init__(self, site: DriverSite) -> None:
        super().__init__(WiretappedRadio(site))


class WrappedProtocol(PassesOn):
    def __init__(self, site: DriverSite) -> None:
        super().__init__(SimulatedScoutProtocol(site))


class ReportsNothing(Scout):
    """A kind of robot without gauges."""

    reports = None


def world_with(battery_j: float | None = None, **air: Any) -> WorldDescription:
    scouts = [
        RobotPlace("scout1", 1, 2.0, 2.0, 0.0, battery_j=battery_j),
        RobotPlace("scout2", 2, 4.0, 4.0, 0.0),
    ]
    return msgspec.structs.replace(WORLD, robots=scouts, air=AirDescription(**air), seed=3)


async def other_world(pool: Pool, world: WorldDescription) -> None:
    """Replace the world by another one, whose robots begin anew."""
    await pool.kill("world")
    await pool.start(SimulatedWorld, "world", {"world": msgspec.to_builtins(world)})


@asynccontextmanager
async def pool_in(mission: Any, world: WorldDescription) -> AsyncIterator[Pool]:
    async with a_pool(mission, RCS) as pool:
        await other_world(pool, world)
        yield pool


async def granted(pool: Pool, robot: str = "scout1") -> ArcClient:
    arc = await pool.arc(await pool.owner(f"driver-of-{robot}"), "drive", robot)
    await arc.wait_granted()
    return arc


async def drive(pool: Pool, seconds: float, *arcs: ArcClient) -> None:
    """Drive in circles."""
    end_s = pool.clock.now_s() + seconds
    while pool.clock.now_s() < end_s:
        for arc in arcs:
            await arc.drive(6.0, 9.0)
        await pool.clock.sleep_s(0.25)


def overhear(pool: Pool, of: str, conversation: Conversation, kind: Any) -> list[Any]:
    """Return the publications from now on; grows."""
    heard: list[Any] = []
    pool.voice_of("ui_console/ear").subscribe(of, conversation, kind, lambda envelope: heard.append(envelope.body))
    return heard


def said(events: list[StoryEvent]) -> list[tuple[LogLevel, str, str]]:
    return [(event.level, event.subject, event.what) for event in events if event.level is not LogLevel.INFO]


async def asked(pool: Pool, rc: str = "scout1") -> Readings:
    return await ask_readings(pool.voice_of("ui_console/ear"), rc)


def counts(pool: Pool, rc: str) -> dict[str, float]:
    return pool.running[rc].statistics()


# ---------------------------------------------------------------------- readings
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


# ---------------------------------------------------------------------- what a reply costs
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


# ---------------------------------------------------------------------- what is lost
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


# ---------------------------------------------------------------------- without replies, and with wrong ones
@pytest.mark.parametrize(
    ("rc", "changed"),
    [("radio", {"driver": DEAF}), ("scout1", {"protocol": f"{HERE}:SilentProtocol"})],
)
def test_radio_or_protocol_without_replies_work_as_before(local_mission: Any, rc: str, changed: dict[str, str]) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            await pool.end(rc)
            await pool.rc(rc, **changed)
            packets = overhear(pool, AIR, Conversation.COMMAND, RadioPacket)
            events = overhear(pool, RADIO, Conversation.LOG, StoryEvent)
            before = await pool.pose("scout1")
            await drive(pool, 3.0, await granted(pool))
            assert await pool.pose("scout1") != before
            assert packets
            assert not any(packet.asks for packet in packets)
            assert (await asked(pool)).at_s < 0
            found = counts(pool, "radio")
            assert (found["replies"], found["replies_lost"]) == (0, 0)
            assert not said(events)

    run_virtual(main())


@pytest.mark.parametrize(
    ("rc", "changed"),
    [("radio", {"driver": f"{HERE}:WrappedRadio"}), ("scout1", {"protocol": f"{HERE}:WrappedProtocol"})],
)
def test_replies_come_through_what_passes_calls_on(local_mission: Any, rc: str, changed: dict[str, str]) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            await pool.end(rc)
            await pool.rc(rc, **changed)
            await drive(pool, 3.0, await granted(pool))
            assert (await asked(pool)).at_s > 0
            assert counts(pool, "radio")["replies"] > 0

    run_virtual(main())


def test_a_robot_whose_kind_reports_nothing_is_never_asked(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            packets = overhear(pool, AIR, Conversation.COMMAND, RadioPacket)
            await pool.end("scout1")
            given = {"network_id": 1, "links": {"command_radio": ["radio"]}}
            await pool.start(ReportsNothing, "scout1", given, kind="scout")
            await drive(pool, 2.0, await granted(pool))
            assert packets
            assert not any(packet.asks for packet in packets)
            assert (await asked(pool)).values == {}

    run_virtual(main())


def test_malformed_replies_are_counted_and_change_nothing(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            radio, stranger = pool.voice("radio"), pool.voice("other_radio")
            good = radio_link.encode_reply(radio_link.ScoutReply(0.5, 0.1, 0.2))
            radio.publish(RADIO, Conversation.REPLIES, Reply(1, good))
            await pool.clock.sleep_s(0.1)
            before = await asked(pool)
            assert before.values["battery_share"] == pytest.approx(0.5, abs=0.01)
            published = overhear(pool, SCOUT1, Conversation.READINGS, Readings)
            for wrong in (b"R", b"R123456", b"noise", good[:-1], b"D" + good[1:]):
                radio.publish(RADIO, Conversation.REPLIES, Reply(1, wrong))
            radio.publish(
                RADIO, Conversation.REPLIES, Reply(2, radio_link.encode_reply(radio_link.ScoutReply(0.1, 0, 0)))
            )
            stranger.publish(
                RADIO, Conversation.REPLIES, Reply(1, radio_link.encode_reply(radio_link.ScoutReply(0, 0, 0)))
            )
            await pool.clock.sleep_s(2.0)
            assert await asked(pool) == before
            assert not published
            found = counts(pool, "scout1")
            assert (found["replies_read"], found["replies_malformed"]) == (1, 5)
            assert counts(pool, "scout2")["replies_read"] == 1

    run_virtual(main())


def test_values_out_of_their_range_are_malformed_whatever_the_protocol_reads(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            await pool.end("scout1")
            await pool.rc("scout1", protocol=f"{HERE}:WildProtocol")
            await drive(pool, 2.0, await granted(pool))
            found = counts(pool, "scout1")
            assert found["replies_read"] == 0
            assert found["replies_malformed"] >= 3
            assert (await asked(pool)).values == {}

    run_virtual(main())


def test_a_number_that_no_message_carries_is_left_out_of_the_readings(local_mission: Any) -> None:
    """Between processes one infinite value would cost the whole message, and every console all gauges of the robot."""

    async def main() -> None:
        async with a_pool(local_mission, ["radio"], rc_classes={"scout": SonarScout}) as pool:
            await pool.rc("scout1", protocol=f"{HERE}:SonarProtocol")
            published = overhear(pool, SCOUT1, Conversation.READINGS, Readings)
            pool.voice("radio").publish(RADIO, Conversation.REPLIES, Reply(1, b"any"))
            await pool.clock.sleep_s(2.0)
            assert [told.values for told in published] == [{"battery_share": 0.5}]
            assert (await asked(pool)).values == {"battery_share": 0.5}

    run_virtual(main())
