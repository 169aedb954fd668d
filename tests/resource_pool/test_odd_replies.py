"""Radios and protocols without replies, with wrong ones, or with wrappers around them."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import msgspec
import numpy as np
import pytest
from pool_on_local_network import WiretappedRadio, a_pool
from replying_pool import (
    AIR,
    DEAF,
    RADIO,
    RCS,
    SCOUT1,
    asked,
    counts,
    drive,
    granted,
    overhear,
    said,
)

from backbone.bus.clock import run_virtual
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from resource_pool.arc_client import Readings
from resource_pool.drivers.interface import DriverSite, ScoutReports
from resource_pool.drivers.simulated import SimulatedScoutProtocol
from resource_pool.drivers.world_messages import RadioPacket
from resource_pool.messages import Reply
from resource_pool.rcs.scout import Scout
from scout_model import radio_link

HERE = "test_odd_replies"


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


class CarelessProtocol(SimulatedScoutProtocol):
    """Reads something that is no report of a Scout."""

    report: ClassVar[Any] = None

    def read(self, payload: bytes) -> Any:
        return self.report


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


@pytest.mark.parametrize(
    "report",
    [None, {"battery_share": 0.5}, 0.5, ScoutReports(np.float32(0.5), 0.0, 0.0)],  # type: ignore[arg-type]
    ids=["None", "a mapping", "a number", "a value that no message carries"],
)
def test_a_report_that_is_none_is_malformed_and_ends_no_rc(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, report: object
) -> None:
    monkeypatch.setattr(CarelessProtocol, "report", report)

    async def main() -> None:
        async with a_pool(local_mission, ["radio"]) as pool:
            await pool.rc("scout1", protocol=f"{HERE}:CarelessProtocol")
            events = overhear(pool, SCOUT1, Conversation.LOG, StoryEvent)
            for _reply in range(3):
                pool.voice("radio").publish(RADIO, Conversation.REPLIES, Reply(1, b"any"))
            await pool.clock.sleep_s(1.0)
            assert counts(pool, "scout1")["replies_malformed"] == 3
            [warning] = said(events)
            assert warning[2].startswith("its replies cannot be decoded: ")
            assert (await asked(pool)).values == {}

    run_virtual(main())
