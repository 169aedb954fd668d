"""A walker under its ARC, on its radio beside a Scout: it walks as commanded, at its rate."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import msgspec
import pytest
from pool_on_local_network import Pool
from walker_pool import ROOM, Trunk, assert_stands, claim, move_for, play, sent, walker_pool

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.exchange import SwapClass, Swapped
from backbone.wire import Envelope, Message
from resource_pool.arc_client import ArcClient, ask_readings
from resource_pool.commands import Drive, Jump, SwitchTransmitter
from resource_pool.messages import NoSuchAction
from resource_pool.rcs.command_radio import CommandRadio
from resource_pool.robots.walker.gait import MAX_FORWARD_M_S, MAX_TURN_RAD_S, TROT, WALK, ImpossibleMove
from resource_pool.robots.walker.motion import STEP_S
from resource_pool.robots.walker.rc import WalkerRc
from scout_model.description import AirDescription
from scout_model.radio_link import HaltPacket, Safe, TransmitterOn

EVERYTHING = ["walker1", "scout1", "radio", "video", "grabber"]


def test_it_walks_as_commanded_then_turns_then_stands(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        assert (await arc.move(0.3)).values == {"forward_m_s": 0.3, "turn_rad_s": 0.0}
        await move_for(pool, arc, 3.0, 0.3)
        await arc.halt()
        await assert_stands(pool, trunk)
        assert trunk.x_m - 2.0 == pytest.approx(0.9, rel=0.15)
        assert abs(trunk.y_m - 3.0) < 0.1
        turned_rad = trunk.turned_rad
        await move_for(pool, arc, 2.0, 0.0, 1.2)
        await arc.halt()
        await assert_stands(pool, trunk)
        assert trunk.turned_rad - turned_rad == pytest.approx(2.4, rel=0.15)
        assert sent(pool)[-1] == HaltPacket()
        assert pool.running["walker1"].statistics()["late"] == 0

    play(local_mission, scene)


@pytest.mark.slow
@pytest.mark.parametrize("forward_m_s", [-0.3, -0.15, 0.0, 0.15, 0.3])
@pytest.mark.parametrize("turn_rad_s", [-1.2, -0.6, 0.0, 0.6, 1.2])
def test_it_reaches_each_commanded_speed(local_mission: Any, forward_m_s: float, turn_rad_s: float) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        applied = (await arc.move(forward_m_s, turn_rad_s)).values
        await move_for(pool, arc, 1.0, forward_m_s, turn_rad_s)
        x_m, y_m, turned_rad = trunk.x_m, trunk.y_m, trunk.turned_rad
        await move_for(pool, arc, 2.0, forward_m_s, turn_rad_s)
        turned_rad = trunk.turned_rad - turned_rad
        chord_m = math.dist((trunk.x_m, trunk.y_m), (x_m, y_m))
        half_rad = applied["turn_rad_s"] * 2.0 / 2
        arc_to_chord = math.sin(half_rad) / half_rad if half_rad else 1.0
        assert turned_rad == pytest.approx(applied["turn_rad_s"] * 2.0, rel=0.2, abs=0.25)
        assert chord_m == pytest.approx(abs(applied["forward_m_s"]) * 2.0 * arc_to_chord, rel=0.2, abs=0.08)

    play(local_mission, scene)


def test_a_mission_file_may_choose_the_walk_which_is_slower(local_mission: Any) -> None:
    async def main() -> None:
        async with walker_pool(local_mission, ["walker1", "radio"]) as pool:
            await pool.end("walker1")
            await pool.rc("walker1", gait="walk")
            arc = await claim(pool, "patrol", "walker1")
            await arc.wait_granted()
            applied = (await arc.move(0.3)).values
            assert applied["forward_m_s"] == pytest.approx(WALK.longest_stride_m / (WALK.duty * WALK.period_s))
            assert applied["forward_m_s"] < TROT.longest_stride_m / (TROT.duty * TROT.period_s)

    run_virtual(main())


@pytest.mark.parametrize(
    ("forward_m_s", "turn_rad_s", "applied"),
    [
        (50.0, 0.0, {"forward_m_s": MAX_FORWARD_M_S, "turn_rad_s": 0.0}),
        (0.0, -50.0, {"forward_m_s": 0.0, "turn_rad_s": -MAX_TURN_RAD_S}),
        (0.0, 0.0, {"forward_m_s": 0.0, "turn_rad_s": 0.0}),
    ],
)
def test_what_is_beyond_its_limits_is_clipped(
    local_mission: Any, forward_m_s: float, turn_rad_s: float, applied: dict[str, float]
) -> None:
    async def scene(_pool: Pool, arc: ArcClient, _trunk: Trunk) -> None:
        assert (await arc.move(forward_m_s, turn_rad_s)).values == applied

    play(local_mission, scene)


def test_what_is_no_number_is_refused_and_it_stands(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        with pytest.raises(ImpossibleMove):
            await arc.move(math.nan)
        await assert_stands(pool, trunk)
        assert sent(pool) == []

    play(local_mission, scene)


def test_it_has_no_command_of_a_scout(local_mission: Any) -> None:
    async def scene(_pool: Pool, arc: ArcClient, _trunk: Trunk) -> None:
        for missing in (Drive(1.0, 1.0), Jump(), SwitchTransmitter(True, "video")):
            with pytest.raises(NoSuchAction):
                await arc.command(missing)

    play(local_mission, scene)


def test_its_readings_have_the_state_of_its_motion_with_each_protocol(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 2.0, 0.3)
        person = pool.voice_of("ui_console/anna")
        told = (await ask_readings(person, "walker1")).values
        assert told["commanded_m_s"] == pytest.approx(0.3)
        assert told["way_m"] == pytest.approx(trunk.x_m - 2.0, abs=0.2)
        exchange = SwapClass("resource_pool.robots.walker.rc:WalkerProtocol", {}, 0.5, 2.0)
        swapping = asyncio.create_task(person.ask("resource_pool/walker1", exchange, Swapped, within_s=10.0))
        await move_for(pool, arc, 3.0, 0.2)
        assert (await swapping).is_proved
        assert (await ask_readings(person, "walker1")).values["commanded_m_s"] == pytest.approx(0.2)
        assert pool.running["walker1"].statistics()["replies_malformed"] == 0

    play(local_mission, scene)


class SlowRadio(CommandRadio):
    """Answers later than a step lasts."""

    async def command(self, asked: Envelope[Message]) -> Message:
        await self.clock.sleep_s(1.5 * STEP_S)
        return await super().command(asked)


def test_a_slow_radio_delays_no_step(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 3.0, 0.3)
        found = pool.running["walker1"].statistics()
        assert (found["steps"], found["late"], found["worst_ms"]) == (pytest.approx(150, abs=3), 0, 0.0)
        assert trunk.x_m > 2.6

    play(local_mission, scene, command_radio=SlowRadio)


class LateClock(VirtualClock):
    """Wakes its sleepers late, as a machine does that has too much to do."""

    async def sleep_until_s(self, at_s: float) -> None:
        await super().sleep_until_s(at_s + 0.6 * STEP_S)


class LateWalker(WalkerRc):
    """Lives on a busy machine."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, LateClock())


def test_late_steps_are_counted_and_it_walks_on(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 3.0, 0.3)
        found = pool.running["walker1"].statistics()
        assert (found["steps"], found["late"]) == (pytest.approx(150, abs=3), found["steps"])
        assert found["worst_ms"] == pytest.approx(0.6 * STEP_S * 1e3)
        assert trunk.x_m > 2.6

    play(local_mission, scene, walker=LateWalker)


@pytest.mark.slow
@pytest.mark.parametrize(("loss", "least_m"), [(0.1, 0.6), (0.3, 0.35), (0.5, 0.1)])
@pytest.mark.parametrize("seed", range(5))
def test_with_packets_lost_it_is_slower_and_does_not_fall(
    local_mission: Any, loss: float, least_m: float, seed: int
) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 4.0, 0.3)
        assert pool.audit["packets_lost"] > 0
        assert trunk.x_m - 2.0 > least_m

    lossy = msgspec.structs.replace(ROOM, seed=seed, air=AirDescription(radio_loss=loss))
    play(local_mission, scene, lossy)


def test_a_scout_and_a_walker_share_one_radio(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        scout = await claim(pool, "other", "scout1")
        await scout.wait_granted()
        assert arc.granted is not None
        for _ in range(20):
            await arc.move(0.3)
            await scout.move(0.2)
            await pool.clock.sleep_s(0.1)
        assert trunk.x_m > 2.4
        assert (await pool.pose("scout1"))[0] > 2.3
        found = pool.running["radio"].statistics()
        assert not any(late for name, late in found.items() if "overruns" in name)
        assert found["worst_packet_s"] == pytest.approx((29 + 36) * 10 / 115_200)  # joint targets, and the reply
        assert pool.audit["packets_for_no_robot"] == pool.audit["stale_packets"] == 0
        times_s = [packet.at_s for packet in pool.radio_driver.heard_by(5)]
        assert len(times_s) == pytest.approx(40, abs=2)

    play(local_mission, scene)


def test_it_transmits_while_it_walks(local_mission: Any) -> None:
    async def main() -> None:
        async with walker_pool(local_mission, EVERYTHING) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "walker_capture", "walker1")
            await arc.wait_granted()
            await pool.clock.sleep_s(0.3)
            assert TransmitterOn("video") in sent(pool)
            assert pool.grabber_driver.frequency == "video"
            await move_for(pool, arc, 1.0, 0.3)
            assert pool.running["world"].statistics()["jammed_frames"] == 0
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            assert sent(pool)[-1] == Safe()

    run_virtual(main())


def test_a_standing_walker_loads_nothing(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 0.5, 0.2)
        await arc.halt()
        await assert_stands(pool, trunk)
        loaded = pool.running["radio"].statistics()["applied"]
        await pool.clock.sleep_s(2.0)
        assert pool.running["radio"].statistics()["applied"] == loaded
        assert pool.running["world"].statistics()["packets"] > 0

    play(local_mission, scene)
