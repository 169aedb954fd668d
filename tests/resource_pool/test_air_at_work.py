"""The air between real drivers and the simulated world: what a packet and a picture become on their way."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import Connect, Connected
from backbone.scheduling.requests import RcUse
from resource_pool.commands import Tune
from resource_pool.drivers.interface import DriverSite, Picture
from resource_pool.drivers.simulated import SimulatedRadio
from resource_pool.drivers.simulated_video import SimulatedFramegrabber
from resource_pool.drivers.world_messages import WorldState
from resource_pool.messages import Applied
from resource_pool.simulated_world import SimulatedWorld
from scout_model import radio_link
from scout_model.description import CLEAN_AIR, AirDescription, RobotPlace, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.video_link import SETTLING_S

ROOM = WorldDescription(
    8.0,
    8.0,
    seed=5,
    robots=[RobotPlace("scout1", 1, 2.0, 2.0, 0.0), RobotPlace("scout2", 2, 6.0, 6.0, 0.0)],
    air=CLEAN_AIR,
)
DRIVE, HALT = radio_link.encode_drive(10.0, 10.0), radio_link.encode_halt()
SETTLED = round(SETTLING_S * FRAMES_PER_S)
STILL_M = 0.001  # while a world begins its robots settle on the floor


@dataclass
class Played:
    """A world that runs, and drivers of its hardware, without the resource controllers between."""

    pool: Pool
    bugs: list[BaseException]

    def site(self, resource: str, **parameters: Any) -> DriverSite:
        given = {"world": "world", "options": {}, "camera": "paint", "frame_rate_hz": 30.0, **parameters}
        bus = self.pool.voice(resource)
        return DriverSite(resource, bus, self.pool.clock, SimpleNamespace(**given), lambda what: None, self.bugs.append)

    async def send(self, radio: SimulatedRadio, network_id: int, payload: bytes) -> float:
        took_s = await radio.transmit(network_id, payload, arc="one", robot_epoch=1)
        assert took_s is not None
        return took_s

    async def moved_m(self, body: str, seconds: float) -> float:
        before_m, _ = await self.pool.pose(body)
        await self.pool.clock.sleep_s(seconds)
        after_m, _ = await self.pool.pose(body)
        return after_m - before_m


@asynccontextmanager
async def played(mission: Any, room: WorldDescription = ROOM) -> AsyncIterator[Played]:
    clock = VirtualClock()
    async with mission(clock=clock) as network:
        pool = Pool(network, clock, [])
        await pool.start(SimulatedWorld, "world", {"world": msgspec.to_builtins(room)})
        yield Played(pool, [])
        await pool.close()


def room_with(**air: Any) -> WorldDescription:
    return msgspec.structs.replace(ROOM, air=msgspec.structs.replace(CLEAN_AIR, **air))


def test_a_packet_moves_its_own_robot_and_no_other(local_mission: Any) -> None:
    async def main() -> None:
        async with played(local_mission) as here:
            radio = SimulatedRadio(here.site("radio"))
            for _ in range(5):
                await here.send(radio, 2, DRIVE)
                assert abs(await here.moved_m("scout1", 0.1)) < STILL_M
            assert await here.moved_m("scout2", 0.2) > 0.005
            audit = here.pool.audit
            assert (audit["packets_delivered_scout1"], audit["packets_delivered_scout2"]) == (0, 5)
            assert (audit["packets"], audit["packets_lost"], audit["packets_for_no_robot"]) == (5, 0, 0)

    run_virtual(main())


class AwayClock:
    """A component's clock that finds itself later than it was: the component was not run meanwhile."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock, self._away_s = clock, 0.0
        self.rate = clock.rate

    def was_away(self, seconds: float) -> None:
        self._away_s += seconds

    def now_s(self) -> float:
        return self._clock.now_s() + self._away_s

    async def sleep_s(self, seconds: float) -> None:
        await self._clock.sleep_s(seconds)

    async def sleep_until_s(self, time_s: float) -> None:
        await self._clock.sleep_until_s(time_s - self._away_s)


@pytest.mark.parametrize("away_s", [0.05, 0.4, 3.0])
def test_after_a_world_was_away_its_robots_still_do_what_they_are_told(local_mission: Any, away_s: float) -> None:
    """A robot stops by itself when it hears nothing; that the world was not run is no silence."""

    async def scene() -> None:
        async with played(local_mission) as here:
            world = here.pool.running["world"]
            world.clock = clock = AwayClock(here.pool.clock)
            radio = SimulatedRadio(here.site("radio"))
            await here.send(radio, 1, radio_link.encode_transmitter_on("video1"))
            states: list[WorldState] = []
            here.pool.voice("ear").subscribe(
                world.address, Conversation.BODIES, WorldState, lambda heard: states.append(heard.body)
            )
            for number in range(10):
                if number == 4:
                    clock.was_away(away_s)
                await here.send(radio, 1, HALT)
                await here.pool.clock.sleep_s(0.1)
            on_air = [state for state in states if state.transmitting]
            assert on_air, "the transmitter never came on"
            assert states[states.index(on_air[0]) :] == on_air, "the transmitter went off"
            assert states[-1].at_s == pytest.approx(clock.now_s(), abs=0.05), "it does not keep the mission's pace"

    run_virtual(scene())


def test_a_packet_to_an_id_nobody_has_is_counted_and_moves_nobody(local_mission: Any) -> None:
    async def main() -> None:
        async with played(local_mission) as here:
            await here.send(SimulatedRadio(here.site("radio")), 77, DRIVE)
            assert abs(await here.moved_m("scout1", 0.3)) < STILL_M
            assert here.pool.audit["packets_for_no_robot"] == 1

    run_virtual(main())


def test_a_robot_obeys_only_when_the_packets_bits_have_arrived(local_mission: Any) -> None:
    async def main() -> None:
        async with played(local_mission, room_with(radio_delay_s=0.5)) as here:
            radio = SimulatedRadio(here.site("radio", options={"bits_per_s": 600.0}))
            assert await here.send(radio, 1, DRIVE) == pytest.approx(120 / 600)
            assert abs(await here.moved_m("scout1", 0.66)) < STILL_M
            assert await here.moved_m("scout1", 0.3) > 0.01

    run_virtual(main())


def test_beyond_the_radios_reach_packets_are_lost_and_counted(local_mission: Any) -> None:
    async def main() -> None:
        far = room_with(weak_signal=1.0, antenna_x_m=-200.0)
        async with played(local_mission, far) as here:
            radio = SimulatedRadio(here.site("radio"))
            for _ in range(20):
                await here.send(radio, 1, DRIVE)
            assert abs(await here.moved_m("scout1", 0.3)) < STILL_M
            audit = here.pool.audit
            assert audit["packets_lost"] == audit["packets_lost_scout1"] == 20

    run_virtual(main())


def test_the_same_packets_are_lost_in_each_run_of_a_seed_whatever_another_radio_sends(local_mission: Any) -> None:
    async def delivered(seed: int, beside: bool) -> tuple[float, float]:
        room = msgspec.structs.replace(room_with(radio_loss=0.3), seed=seed)
        async with played(local_mission, room) as here:
            radio, other = SimulatedRadio(here.site("radio")), SimulatedRadio(here.site("radio2"))
            for number in range(60):
                await here.send(radio, 1, HALT)
                if beside and number % 3 == 0:
                    await here.send(other, 2, HALT)
                await here.pool.clock.sleep_s(0.01)
            await here.pool.clock.sleep_s(0.1)
            audit = here.pool.audit
            assert audit["packets"] == audit["packets_lost"] + sum(
                audit[f"packets_delivered_{robot}"] for robot in ("scout1", "scout2")
            )
            return audit["packets_delivered_scout1"], (await here.pool.pose("scout1"))[0]

    one = run_virtual(delivered(1, beside=False))
    assert one == run_virtual(delivered(1, beside=True))
    assert len({run_virtual(delivered(seed, beside=False))[0] for seed in range(6)}) > 1
    assert 25 < one[0] < 58


async def watched(here: Played, radio: SimulatedRadio, seconds: float, wheels_rad_s: float = 0.0) -> list[Picture]:
    """Let robot 1 transmit and turn, and return the pictures taken meanwhile; its transmitter stays on."""
    grabber = SimulatedFramegrabber(here.site("grabber"))
    await grabber.open()
    pictures: list[Picture] = []
    grabber.tune("video", pictures.append)
    end_s = here.pool.clock.now_s() + seconds
    await here.send(radio, 1, radio_link.encode_transmitter_on("video"))
    while here.pool.clock.now_s() < end_s:
        await here.send(radio, 1, radio_link.encode_drive(wheels_rad_s, -wheels_rad_s))
        await here.pool.clock.sleep_s(0.2)
    await grabber.close()
    assert not here.bugs
    return pictures


def test_a_picture_settles_after_the_transmitter_comes_on_and_again_after_the_receiver_is_tuned(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with played(local_mission, room_with(settling=1.0)) as here:
            radio = SimulatedRadio(here.site("radio"))
            for _ in range(2):  # the second time only the receiver is new
                kinds = [picture.kind for picture in await watched(here, radio, 1.0) if picture.transmitters]
                assert kinds[:SETTLED] == ["settling"] * SETTLED
                assert set(kinds[SETTLED:]) == {"clean"}

    run_virtual(main())


def test_lines_come_while_the_robot_turns(local_mission: Any) -> None:
    async def torn(wheels_rad_s: float) -> float:
        async with played(
            local_mission, room_with(noise=1.0, white_noise=0, ghosts=0, fades=0, partial_frames=0)
        ) as here:
            pictures = await watched(here, SimulatedRadio(here.site("radio")), 2.0, wheels_rad_s)
            return sum(picture.kind == "torn" for picture in pictures) / len(pictures)

    assert run_virtual(torn(0.0)) < 0.1
    assert run_virtual(torn(10.0)) > 0.7


def test_far_from_the_antenna_fewer_frames_are_clean(local_mission: Any) -> None:
    async def clean(antenna_x_m: float) -> float:
        air = AirDescription(noise=1.0, settling=0.0, antenna_x_m=antenna_x_m, antenna_y_m=2.0)
        async with played(local_mission, msgspec.structs.replace(ROOM, air=air)) as here:
            seen = [p for p in await watched(here, SimulatedRadio(here.site("radio")), 4.0) if p.transmitters]
            return sum(picture.kind == "clean" for picture in seen) / len(seen)

    assert run_virtual(clean(3.0)) > 0.8
    assert run_virtual(clean(12.0)) < 0.4


def test_pictures_of_a_run_repeat_byte_for_byte_and_differ_with_the_worlds_seed(local_mission: Any) -> None:
    async def pictures(seed: int) -> list[bytes]:
        room = msgspec.structs.replace(ROOM, seed=seed, air=AirDescription(noise=1.0))
        async with played(local_mission, room) as here:
            taken = await watched(here, SimulatedRadio(here.site("radio")), 1.0, 3.0)
            return [bytes(picture.pixels) for picture in taken]

    assert run_virtual(pictures(1)) == run_virtual(pictures(1)) != run_virtual(pictures(2))


def test_a_framegrabber_counts_its_pictures_by_kind(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            grabber = address(Subsystem.RESOURCE_POOL, "grabber")
            order = Connect("one", 1, lease_s=2.0, use=RcUse(), companions={})
            await pool.manager_voice.ask(grabber, order, Connected, within_s=1)
            await pool.voice("one").ask(grabber, Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            assert driver.deliver is not None
            for kind, transmitters in (("clean", 1), ("torn", 1), ("clean", 1), ("snow", 0), ("", 1)):
                driver.deliver(replace(driver.picture(transmitters), kind=kind))
            counted = pool.running["grabber"].statistics()
            kinds = {
                name: count for name, count in counted.items() if name in ("frames_clean", "frames_torn", "frames_snow")
            }
            assert kinds == {"frames_clean": 2, "frames_torn": 1, "frames_snow": 1}
            assert counted["frames_delivered"] == 4

    run_virtual(main())
