"""Commands of past epochs are refused, and the last a robot hears of a grant is the safe packet."""

from __future__ import annotations

import asyncio
import random
from typing import Any

import pytest
from examples import share
from pool_on_local_network import a_pool
from pool_orders import ROBOTS, at, command, connect, connect_robot, disconnect, drive_always, state_of

from backbone.bus.clock import run_virtual
from backbone.rc_manager.messages import StaleEpoch
from backbone.scheduling.requests import RcUse, Usage
from resource_pool.commands import Drive
from resource_pool.messages import Accepted, LoadPacket, PacketLoaded, Release
from scout_model.radio_link import encode_drive, encode_safe

TURNS = share(60)


def test_a_stale_command_is_refused_counted_and_not_applied(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(1.0, 1.0))
            await disconnect(pool, "scout1", "one", 1)
            await disconnect(pool, "radio", "one", 1)
            await connect_robot(pool, "two", 2)
            for arc, epoch in [("one", 1), ("one", 2), ("two", 1), ("two", 3)]:
                with pytest.raises(StaleEpoch):
                    await command(pool, arc, epoch, Drive(9.0, 9.0))
            assert (await state_of(pool, "scout1")).refused_stale == 4
            assert (await state_of(pool, "scout1")).applied == 1
            packet = LoadPacket("one", 1, 1, encode_drive(9.0, 9.0), encode_safe(), 1)
            with pytest.raises(StaleEpoch):
                await pool.voice("scout1").ask(at("radio"), packet, PacketLoaded, within_s=1)
            await pool.clock.sleep_s(0.3)
            assert encode_drive(9.0, 9.0) not in {heard.payload for heard in pool.radio_driver.heard}

    run_virtual(main())


@pytest.mark.parametrize("seed", range(3))
def test_over_hundreds_of_switches_no_packet_of_a_past_epoch_is_heard(local_mission: Any, seed: int) -> None:
    """Consoles take robots from behaviors at random moments, release them or die; everybody drives all the time."""

    async def main() -> None:
        rng = random.Random(seed)
        async with a_pool(local_mission, [*ROBOTS, "video"]) as pool:
            behaviors = [
                await pool.arc(await pool.owner(f"watch{n}"), "video_drive", f"scout{n}", minimum_runtime_s=0.5)
                for n in (1, 2)
            ]
            driving = [asyncio.create_task(drive_always(pool, arc, rng.randrange(1, 9))) for arc in behaviors]
            for turn in range(TURNS):
                name = f"console{turn}"
                kind = rng.choice(["drive", "video_drive"])
                owner, arc = await pool.console(name, kind, rng.choice(["scout1", "scout2"]))
                busy = asyncio.create_task(drive_always(pool, arc, 10))
                await pool.clock.sleep_s(rng.uniform(0.0, 0.4))
                if rng.random() < 0.5:
                    await owner.bus.ask(at(arc.arc), Release(), Accepted, within_s=1)
                    await pool.outcome(arc.arc)
                    await pool.end(name)
                else:
                    await pool.kill(name)
                    await pool.kill(arc.arc)
                await pool.clock.sleep_s(rng.uniform(0.0, 0.8))
                busy.cancel()
                await asyncio.gather(busy, return_exceptions=True)
            for task in driving:
                task.cancel()
            await asyncio.gather(*driving, return_exceptions=True)
            manager = pool.running["rc_manager"]
            assert manager.statistics()["switches"] >= TURNS
            assert pool.audit["packets"] > 8 * TURNS
            assert pool.audit["stale_packets"] == 0
            assert pool.audit["jammed_frames"] == 0
            epochs: dict[int, int] = {}
            for packet in pool.radio_driver.heard:
                assert packet.robot_epoch >= epochs.get(packet.network_id, 0)
                epochs[packet.network_id] = packet.robot_epoch

    run_virtual(main())


def test_the_last_a_robot_hears_of_a_grant_is_the_safe_packet(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _owner, arc = await pool.console("console", "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(3.0, 3.0)
            await pool.clock.sleep_s(0.2)
            await pool.running["console"].bus.ask(arc.address, Release(), Accepted, within_s=1)
            await pool.outcome(arc.arc)
            await pool.clock.sleep_s(1.0)
            heard = pool.radio_driver.heard_by(1)
            assert heard[-1].payload == encode_safe()
            assert [packet.payload for packet in heard].count(encode_safe()) == 1
            assert not pool.radio_driver.heard_by(2)
            assert not (await state_of(pool, "scout1")).holders

    run_virtual(main())


def test_connecting_the_same_arc_again_first_makes_safe_what_it_held(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            await connect(pool, "radio", "one", 2, use=RcUse([Usage(0.05, 0.002)]))
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_safe()
            await pool.clock.sleep_s(0.3)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_safe()

    run_virtual(main())
