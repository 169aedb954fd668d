"""What is set while an RC runs counts at once, or is refused; nothing is taken over by half."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.messages import AskParameters, Parameters, SetParameter, WrongParameter
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import RcState
from backbone.scheduling.requests import PathNode, Usage
from resource_pool.arc_client import claim_parameters
from resource_pool.drivers.interface import DriverSite, Picture, UnknownDriver
from resource_pool.messages import NeedsRestart
from resource_pool.rcs.framegrabber import Framegrabber
from resource_pool.rcs.video_frequency import VideoFrequency
from scout_model.radio_link import ScoutReply, encode_drive, encode_reply, packet_bits


class PatientGrabber:
    """A driver that can change its rate, but not go faster than it can."""

    rates: list[float] = []
    broken: set[float] = set()

    def __init__(self, site: DriverSite) -> None:
        self._site = site

    def adjust(self, site: DriverSite) -> None:
        if site.parameters.frame_rate_hz in self.broken:
            raise ZeroDivisionError("this driver is broken on purpose")
        if site.parameters.frame_rate_hz > 20:
            raise NeedsRestart("too fast for this grabber")
        self.rates.append(site.parameters.frame_rate_hz)

    async def open(self) -> None:
        pass

    def tune(self, frequency: str, deliver: Any) -> None:
        pass

    def stop(self) -> None:
        pass

    async def close(self) -> None:
        pass

    def picture(self) -> Picture:
        return Picture(0.0, memoryview(b""), 0, 0)


class WaitingGrabber(PatientGrabber):
    """A driver whose RC would call these methods without effect."""

    async def adjust(self, site: DriverSite) -> None:  # type: ignore[override]
        super().adjust(site)

    async def stop(self) -> None:  # type: ignore[override]
        pass


async def set_parameter(pool: Pool, rc: str, name: str, value: Any) -> dict[str, Any]:
    at = address(Subsystem.RESOURCE_POOL, rc)
    return (await pool.ear.ask(at, SetParameter(name, value), Parameters, within_s=1)).values


async def parameters(pool: Pool, rc: str) -> dict[str, Any]:
    at = address(Subsystem.RESOURCE_POOL, rc)
    return (await pool.ear.ask(at, AskParameters(), Parameters, within_s=1)).values


def test_a_new_capacity_is_said_to_whoever_listens_to_the_rc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            heard: list[float] = []
            pool.ear.subscribe(
                "resource_pool/radio", Conversation.TELEMETRY, RcState, lambda e: heard.append(e.body.capacity)
            )
            await set_parameter(pool, "radio", "capacity", 0.25)
            await pool.clock.sleep_s(0.1)
            assert heard[-1] == 0.25

    run_virtual(main())


@pytest.mark.parametrize("wrong", [-0.1, 1.1, float("nan"), "half"])
def test_a_capacity_that_is_none_is_refused(local_mission: Any, wrong: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            with pytest.raises(WrongParameter):
                await set_parameter(pool, "radio", "capacity", wrong)
            assert (await parameters(pool, "radio"))["capacity"] == 1.0

    run_virtual(main())


@pytest.mark.parametrize(
    ("rc", "name", "value"),
    [
        ("radio", "driver", "other:Radio"),
        ("radio", "sharable", False),
        ("radio", "world", "elsewhere"),
        ("scout1", "network_id", 7),
        ("scout1", "options", {"port": "x"}),
        ("grabber", "frame_rate_hz", 5.0),
        ("grabber", "camera", "gl"),
    ],
)
def test_what_cannot_be_taken_over_is_refused_and_stays_as_it_was(
    local_mission: Any, rc: str, name: str, value: Any
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [rc], manager=False) as pool:
            before = await parameters(pool, rc)
            with pytest.raises(NeedsRestart, match=name):
                await set_parameter(pool, rc, name, value)
            assert await parameters(pool, rc) == before

    run_virtual(main())


def test_the_radio_sends_at_its_new_rate_from_the_next_packet_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(1.0, 1.0)
            drive, reply = encode_drive(1.0, 1.0), encode_reply(ScoutReply(1.0, 0.0, 0.0))
            fast_s = (packet_bits(drive) + packet_bits(reply)) / 115200
            assert pool.running["radio"].statistics()["worst_packet_s"] == pytest.approx(fast_s)
            await set_parameter(pool, "radio", "options", {"bits_per_s": 57600})
            await arc.drive(1.0, 1.0)
            await pool.clock.sleep_s(0.2)  # in which no packet asks for a reply
            assert pool.running["radio"].statistics()["worst_packet_s"] == pytest.approx(packet_bits(drive) / 57600)
            await arc.drive(1.0, 1.0)
            await pool.clock.sleep_s(0.4)
            assert pool.running["radio"].statistics()["worst_packet_s"] == pytest.approx(2 * fast_s)
            with pytest.raises(WrongParameter):
                await set_parameter(pool, "radio", "options", {"baud": 9600})
            assert (await parameters(pool, "radio"))["options"] == {"bits_per_s": 57600}

    run_virtual(main())


def test_the_frame_rate_reaches_a_driver_that_can_take_it_over_and_its_refusal_reaches_who_set_it(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            PatientGrabber.rates.clear()
            given = {"driver": f"{__name__}:PatientGrabber", "links": {"video_frequency": ["video"]}}
            await pool.start(Framegrabber, "grabber", given)
            await set_parameter(pool, "grabber", "frame_rate_hz", 5.0)
            with pytest.raises(NeedsRestart):
                await set_parameter(pool, "grabber", "frame_rate_hz", 25.0)
            with pytest.raises(WrongParameter):
                await set_parameter(pool, "grabber", "frame_rate_hz", 0.0)
            assert (await parameters(pool, "grabber"))["frame_rate_hz"] == 5.0
            await set_parameter(pool, "grabber", "frame_rate_hz", 6.0)
            assert PatientGrabber.rates == [5.0, 6.0]

    run_virtual(main())


@pytest.mark.parametrize(("broken", "told"), [({7.0}, "on purpose"), ({7.0, 5.0}, "kept a part")])
def test_a_driver_that_fails_while_it_changes_is_a_refusal_and_the_rc_works_on(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, broken: set[float], told: str
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            given = {"driver": f"{__name__}:PatientGrabber", "links": {"video_frequency": ["video"]}}
            await pool.start(Framegrabber, "grabber", given)
            await set_parameter(pool, "grabber", "frame_rate_hz", 5.0)
            monkeypatch.setattr(PatientGrabber, "broken", broken)
            with pytest.raises(WrongParameter, match=told):
                await set_parameter(pool, "grabber", "frame_rate_hz", 7.0)
            assert (await parameters(pool, "grabber"))["frame_rate_hz"] == 5.0
            monkeypatch.setattr(PatientGrabber, "broken", set())
            await set_parameter(pool, "grabber", "frame_rate_hz", 6.0)
            assert (await parameters(pool, "grabber"))["frame_rate_hz"] == 6.0

    run_virtual(main())


def test_a_driver_that_waits_where_its_rc_does_not_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            given = {"driver": f"{__name__}:WaitingGrabber", "links": {"video_frequency": ["video"]}}
            with pytest.raises(UnknownDriver, match=r"stop is an 'async def'.*; adjust is an 'async def'"):
                await pool.start(Framegrabber, "grabber", given)

    run_virtual(main())


@pytest.mark.parametrize(
    ("given", "fault"), [({"driver": "sim"}, UnknownDriver), ({"driver": "simulated", "color": "red"}, WrongParameter)]
)
def test_a_video_frequency_checks_its_driver_as_others_do(
    local_mission: Any, given: dict[str, Any], fault: type[Exception]
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            with pytest.raises(fault):
                await pool.start(VideoFrequency, "video", given)

    run_virtual(main())


def test_every_kind_of_request_an_owner_claims_reaches_the_radio(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            usages = [Usage(0.5, 0.002, kind="drive"), Usage(2.0, 0.002, 0.1, 0.01, "jump")]
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1", usage=usages)
            await arc.wait_granted()
            await arc.drive(1.0, 1.0)
            await pool.clock.sleep_s(0.1)
            asked_s = pool.clock.now_s()
            await arc.jump()  # in a stream of its own: the next turn of the other is in 0.4 s
            assert pool.clock.now_s() - asked_s < 0.01
            assert pool.radio_driver.heard_by(1)[-1].payload == b"J"

    run_virtual(main())


@pytest.mark.parametrize("usages", [[], [Usage(0.1, 0.002, kind="drive"), Usage(0.2, 0.002, kind="drive")]])
def test_usages_that_cannot_be_told_apart_are_a_mistake_of_the_claimer(usages: list[Usage]) -> None:
    with pytest.raises(ValueError, match="kinds"):
        claim_parameters("mission_control/x", path=[PathNode("x", 1)], minimum_runtime_s=1.0, usage=usages)
