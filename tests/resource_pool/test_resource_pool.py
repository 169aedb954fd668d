"""RC manager, RCs, ARCs and the simulated world together, on virtual time."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
import random
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import (
    AskRc,
    CloseGate,
    Connect,
    Connected,
    Disconnect,
    Disconnected,
    GateClosed,
    GateOpens,
    OpenGate,
    RcState,
    StaleEpoch,
)
from backbone.scheduling.requests import RcUse, Usage
from backbone.wire import Envelope
from resource_pool.commands import Drive, Halt, Jump, Tune
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import (
    Accepted,
    Applied,
    Frame,
    LoadPacket,
    NotYours,
    PacketLoaded,
    Release,
    Suspended,
    SwappedOut,
)
from scout_model.radio_link import encode_drive, encode_halt, encode_safe

ROBOTS = ["scout1", "scout2", "radio"]
EVERYTHING = [*ROBOTS, "video", "grabber"]


def at(name: str) -> str:
    return address(Subsystem.RESOURCE_POOL, name)


async def state_of(pool: Pool, rc: str) -> RcState:
    return await pool.ear.ask(at(rc), AskRc(), RcState, within_s=1)


async def connect(pool: Pool, rc: str, arc: str, epoch: int, **more: Any) -> None:
    given = {"lease_s": 2.0, "use": RcUse(), "companions": {}} | more
    await pool.manager_voice.ask(at(rc), Connect(arc, epoch, **given), Connected, within_s=1)


async def disconnect(pool: Pool, rc: str, arc: str, epoch: int) -> None:
    await pool.manager_voice.ask(at(rc), Disconnect(arc, epoch), Disconnected, within_s=1)


async def connect_robot(pool: Pool, arc: str, epoch: int, scout: str = "scout1", period_s: float = 0.05) -> None:
    """Connect a scout and the radio to the ARC under one epoch, as the RC manager does."""
    companions = {scout: epoch, "radio": epoch}
    await connect(pool, "radio", arc, epoch, use=RcUse([Usage(period_s, 0.002)]), companions=companions)
    await connect(pool, scout, arc, epoch, companions=companions)


async def command(pool: Pool, arc: str, epoch: int, what: Any, scout: str = "scout1") -> Applied:
    return await pool.voice(arc).ask(at(scout), what.under(arc, epoch), Applied, within_s=1)


# ---------------------------------------------------------------------- driving
def test_a_drive_command_turns_the_wheels_of_the_robot_that_is_held(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            before, other = await pool.pose("scout1"), await pool.pose("scout2")
            for _ in range(10):
                applied = await arc.drive(8.0, 8.0)
                await pool.clock.sleep_s(0.1)
            assert applied.values == {"left_rad_s": 8.0, "right_rad_s": 8.0}
            after = await pool.pose("scout1")
            assert after[0] - before[0] > 0.1
            assert await pool.pose("scout2") == pytest.approx(other, abs=1e-3)
            assert pool.audit["stale_packets"] == 0

    run_virtual(main())


def test_a_speed_that_is_no_number_is_refused_and_moves_nothing(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            for speed in (math.nan, math.inf):
                with pytest.raises(Refusal) as refused:
                    await arc.drive(speed, 1.0)
                assert refused.value.code == "scout.not_finite"
            await pool.clock.sleep_s(0.3)
            assert not pool.radio_driver.heard_by(1)

    run_virtual(main())


def test_wheels_stop_when_commands_stay_away(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(8.0, 8.0)
            commanded_s = pool.clock.now_s()
            await pool.clock.sleep_s(1.0)
            stopped = await pool.pose("scout1")
            await pool.clock.sleep_s(1.0)
            assert await pool.pose("scout1") == pytest.approx(stopped, abs=2e-3)
            halts = [heard.at_s for heard in pool.radio_driver.heard_by(1) if heard.payload == encode_halt()]
            assert commanded_s + 0.5 <= halts[0] <= commanded_s + 0.6
            assert pool.running["scout1"].statistics()["command_timeouts"] == 1

    run_virtual(main())


def test_repeated_commands_keep_the_wheels_turning(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            for _ in range(8):
                await arc.drive(4.0, 4.0)
                await pool.clock.sleep_s(0.4)
            assert pool.running["scout1"].statistics()["command_timeouts"] == 0
            assert {heard.payload for heard in pool.radio_driver.heard_by(1)} == {encode_drive(4.0, 4.0)}

    run_virtual(main())


def test_a_command_that_ends_after_its_hold_leaves_no_dead_man_behind(local_mission: Any) -> None:
    """The robot is taken away while the radio still takes the packet; nothing must spin or halt the next holder."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            radio = pool.network.join(at("radio"), pool.clock)

            async def slow(asked: Envelope[Any]) -> PacketLoaded:
                await pool.clock.sleep_s(0.2)
                return PacketLoaded()

            radio.serve(at("radio"), LoadPacket, slow)
            await connect(pool, "scout1", "one", 1, companions={"radio": 1})
            driving = asyncio.create_task(command(pool, "one", 1, Drive(5.0, 5.0)))
            await pool.clock.sleep_s(0.1)
            await disconnect(pool, "scout1", "one", 1)
            await driving
            await connect(pool, "scout1", "two", 2, companions={"radio": 2})
            await asyncio.wait_for(pool.clock.sleep_s(1.5), 2.0)
            assert pool.running["scout1"].statistics()["command_timeouts"] == 0
            await radio.close()

    run_virtual(main())


def test_a_jump_is_not_called_off_by_packets_repeated_for_the_robots_sake(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [*ROBOTS, "video"]) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "video_drive", "scout1")
            await arc.wait_granted()
            await arc.halt()
            await pool.clock.sleep_s(0.2)
            await arc.jump()
            await pool.clock.sleep_s(1.0)
            heard = [h.payload for h in pool.radio_driver.heard_by(1)]
            later = heard[heard.index(b"J") :]
            assert later.count(b"J") == 1
            assert not {encode_halt(), encode_safe()} & set(later)
            assert len(later) > 10, "the robot must go on hearing that it is not forgotten"
            await arc.drive(1.0, 1.0)
            await pool.clock.sleep_s(0.2)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_drive(1.0, 1.0)

    run_virtual(main())


# ---------------------------------------------------------------------- fences
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
            for turn in range(60):
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
            assert manager.statistics()["switches"] >= 60
            assert pool.audit["packets"] > 500
            assert pool.audit["stale_packets"] == 0
            assert pool.audit["jammed_frames"] == 0
            epochs: dict[int, int] = {}
            for packet in pool.radio_driver.heard:
                assert packet.robot_epoch >= epochs.get(packet.network_id, 0)
                epochs[packet.network_id] = packet.robot_epoch

    run_virtual(main())


async def drive_always(pool: Pool, arc: Any, speed: int) -> None:
    while True:
        with contextlib.suppress(Refusal, LinkError):
            await arc.drive(float(speed), float(-speed))
        await pool.clock.sleep_s(0.03)


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


# ---------------------------------------------------------------------- leases
def test_when_the_rc_manager_dies_for_good_every_rc_makes_itself_safe(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            busy = asyncio.create_task(drive_always(pool, arc, 5))
            await pool.clock.sleep_s(1.0)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(2.1)
            for rc in ROBOTS:
                assert not (await state_of(pool, rc)).holders, rc
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_safe()
            with pytest.raises(SwappedOut):
                await arc.drive(5.0, 5.0)
            assert pool.running["scout1"].statistics()["lease_ends"] == 1
            busy.cancel()
            await asyncio.gather(busy, return_exceptions=True)

    run_virtual(main())


def test_a_lease_runs_from_the_moment_it_was_given_not_from_its_arrival(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            await connect(pool, "scout1", "one", 1, lease_s=1.0)
            given_s = pool.clock.now_s()
            holder = (await state_of(pool, "scout1")).holders[0]
            assert holder.lease_until_s <= given_s + 1.0
            await pool.clock.sleep_s(1.01)
            assert not (await state_of(pool, "scout1")).holders

    run_virtual(main())


@pytest.mark.parametrize("lease_s", [0.0, -1.0, math.nan, math.inf])
def test_a_lease_that_is_no_span_of_time_is_refused(local_mission: Any, lease_s: float) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            with pytest.raises(Refusal):
                await connect(pool, "scout1", "one", 1, lease_s=lease_s)
            assert not (await state_of(pool, "scout1")).holders

    run_virtual(main())


def test_a_granted_arc_goes_on_through_a_restart_of_the_rc_manager(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            before = await arc.wait_granted()
            await arc.drive(2.0, 2.0)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(0.5)
            await pool.manager()
            for _ in range(40):
                applied = await arc.drive(2.0, 2.0)
                await pool.clock.sleep_s(0.1)
            assert applied.epoch == before.epochs["scout1"]
            assert owner.heard() == ["Resumed"]
            assert encode_safe() not in {heard.payload for heard in pool.radio_driver.heard}

    run_virtual(main())


# ---------------------------------------------------------------------- owners
def test_the_arc_of_a_dead_owner_withdraws_and_ends_within_a_second(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await pool.console("console", "drive", "scout1")
            await arc.wait_granted()
            await pool.kill("console")
            async with asyncio.timeout(1.0):
                assert await pool.outcome(arc.arc) is None
                while (await state_of(pool, "scout1")).holders:
                    await pool.clock.sleep_s(0.01)

    run_virtual(main())


def test_the_rcs_of_a_hung_owner_go_to_the_next(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            hung, _ = await pool.owner("hung"), None
            first = await pool.arc(hung, "drive", "scout1", minimum_runtime_s=60.0)
            await first.wait_granted()
            second = await pool.arc(await pool.owner("next"), "drive", "scout1")
            await pool.clock.sleep_s(1.0)
            assert second.granted is None
            hung.hangs = True
            async with asyncio.timeout(4.0):
                await second.wait_granted()
            assert pool.is_alive(first.arc)
            hung.hangs = False

    run_virtual(main())


def test_release_ends_the_arc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await pool.console("console", "drive", "scout1")
            await arc.wait_granted()
            await owner.bus.ask(arc.address, Release("enough"), Accepted, within_s=1)
            async with asyncio.timeout(1.0):
                assert await pool.outcome(arc.arc) is None

    run_virtual(main())


def test_only_the_owner_commands_its_arc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            stranger = await pool.owner("stranger")
            for what, answer in [(Drive(1.0, 1.0), Applied), (Halt(), Applied), (Release(), Accepted)]:
                with pytest.raises(NotYours):
                    await stranger.bus.ask(arc.address, what, answer, within_s=1)
            assert (await arc.state()).granted

    run_virtual(main())


def test_a_swapped_out_owner_is_told_why_by_whom_and_until_when(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            _, console = await pool.console("console", "drive", "scout1")
            await console.wait_granted()
            with pytest.raises(SwappedOut) as refused:
                await arc.drive(1.0, 1.0)
            assert refused.value.facts["reason"] == "higher"
            assert refused.value.facts["by"] == "console-drive"
            assert "expected_start_s" in refused.value.facts
            suspended = owner.notices[-1]
            assert isinstance(suspended, Suspended)
            assert (suspended.reason, suspended.by) == ("higher", "console-drive")

    run_virtual(main())


def test_a_command_before_the_first_grant_is_refused_like_any_other(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            for act in (arc.halt, arc.jump):
                with pytest.raises(SwappedOut) as refused:
                    await act()
                assert refused.value.facts["reason"] == "waiting"
            assert pool.is_alive(arc.arc)
            await pool.kill(arc.arc)

    run_virtual(main())


def test_notices_reach_even_a_slow_owner_in_the_order_of_the_switches(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            owner.slow_s = 0.8
            arc = await pool.arc(owner, "drive", "scout1")
            while not (await state_of(pool, "scout1")).holders:
                await pool.clock.sleep_s(0.01)
            await pool.clock.sleep_s(0.05)
            _, console = await pool.console("console", "drive", "scout1")
            await console.wait_granted()
            await pool.clock.sleep_s(3.0)
            assert owner.heard() == ["Resumed", "Suspended"]
            assert arc.granted is None

    run_virtual(main())


# ---------------------------------------------------------------------- the gate
async def waiting_arc(pool: Pool, kind: str = "video_drive") -> Any:
    return await pool.arc(await pool.owner("watcher"), kind, "scout1")


def test_a_close_before_the_set_has_settled_wins(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [*ROBOTS, "video"], manager=False) as pool:
            arc = await waiting_arc(pool)
            owner = pool.running["watcher"]
            epochs = {"scout1": 1, "radio": 1, "video": 1}
            await connect_robot(pool, arc.arc, 1)
            settled_s = pool.clock.now_s() + 0.5
            await pool.manager_voice.ask(arc.address, OpenGate(epochs, settled_s, 10.0), GateOpens, within_s=2)
            with pytest.raises(SwappedOut):
                await arc.drive(1.0, 1.0)
            await pool.manager_voice.ask(arc.address, CloseGate("higher", "console", 0.0, -1.0), GateClosed, within_s=1)
            await pool.clock.sleep_until_s(settled_s + 0.2)
            with pytest.raises(SwappedOut):
                await arc.drive(1.0, 1.0)
            assert "Resumed" not in owner.heard()
            await pool.kill(arc.arc)

    run_virtual(main())


def test_an_order_to_open_for_a_set_that_was_never_asked_for_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            arc = await waiting_arc(pool, "drive")
            for epochs in ({}, {"scout2": 1}, {"scout1": 1, "radio": 1, "bridge": 1}):
                with pytest.raises(Refusal) as refused:
                    await pool.manager_voice.ask(arc.address, OpenGate(epochs, 0.0, 10.0), GateOpens, within_s=2)
                assert refused.value.code == "arc.not_my_set"
            assert pool.is_alive(arc.arc)
            await pool.kill(arc.arc)

    run_virtual(main())


def test_a_preparation_that_outlasts_the_rc_managers_patience_does_not_open(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [*ROBOTS, "video"], manager=False) as pool:
            await pool.end("radio")
            arc = await waiting_arc(pool)
            await connect(pool, "scout1", arc.arc, 1, companions={"scout1": 1, "radio": 1})
            radio = pool.network.join(at("radio"), pool.clock)

            async def never(asked: Envelope[Any]) -> PacketLoaded:
                await asyncio.Event().wait()
                raise AssertionError("unreachable")

            radio.serve(at("radio"), LoadPacket, never)
            order = OpenGate({"scout1": 1, "radio": 1, "video": 1}, 0.0, 10.0)
            with pytest.raises(Refusal):
                await pool.manager_voice.ask(arc.address, order, GateOpens, within_s=1.0)
            assert not (await arc.state()).granted
            assert "could not be prepared" in (await arc.state()).reason
            await radio.close()
            await pool.kill(arc.arc)

    run_virtual(main())


# ---------------------------------------------------------------------- hardware that fails
def test_a_radio_that_breaks_refuses_what_is_to_be_sent_at_once(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            pool.radio_driver.breaks = True
            packet = LoadPacket("one", 1, 1, b"J", encode_safe(), 1, at_once=True)
            with pytest.raises(HardwareFault):
                await pool.voice("scout1").ask(at("radio"), packet, PacketLoaded, within_s=1)
            assert pool.is_alive("radio")
            pool.radio_driver.breaks = False

    run_virtual(main())


def test_a_radio_that_breaks_while_it_sends_ends_as_failed_and_says_what_broke(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(1.0, 1.0))
            await pool.clock.sleep_s(0.2)
            pool.radio_driver.breaks = True
            bug = await pool.outcome("radio")
            assert isinstance(bug, HardwareFault)
            assert "antenna" in str(bug)
            assert pool.radio_driver.closed == 1

    run_virtual(main())


@pytest.mark.parametrize("fault", ["breaks", "hangs"])
def test_a_disconnection_that_reached_no_safe_state_is_refused_and_made_up_for(local_mission: Any, fault: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1, period_s=5.0)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            setattr(pool.radio_driver, fault, True)
            with pytest.raises(HardwareFault):
                await disconnect(pool, "radio", "one", 1)
            assert not (await state_of(pool, "radio")).holders
            with pytest.raises(HardwareFault):
                await connect(pool, "radio", "two", 2)
            assert not (await state_of(pool, "radio")).holders
            setattr(pool.radio_driver, fault, False)
            await connect(pool, "radio", "two", 3)
            assert [heard.payload for heard in pool.radio_driver.heard_by(1)][-1] == encode_safe()
            assert (await state_of(pool, "radio")).holders[0].arc == "two"

    run_virtual(main())


def test_after_a_hardware_fault_the_rc_manager_waits_out_the_lease(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1", usage=Usage(20.0, 0.002))
            await arc.wait_granted()
            await arc.drive(3.0, 3.0)
            pool.radio_driver.breaks = True
            taken_s = pool.clock.now_s()
            _, console = await pool.console("console", "drive", "scout1")
            await pool.clock.sleep_s(0.2)
            pool.radio_driver.breaks = False
            await console.wait_granted()
            assert 1.9 <= pool.clock.now_s() - taken_s <= 2.6
            assert pool.audit["stale_packets"] == 0

    run_virtual(main())


def test_a_lease_that_ends_on_broken_hardware_does_not_end_the_rc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1, period_s=5.0)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            pool.radio_driver.breaks = True
            await pool.clock.sleep_s(2.5)
            assert pool.is_alive("radio")
            assert not (await state_of(pool, "radio")).holders
            assert "not safe" in (await state_of(pool, "radio")).feedback
            pool.radio_driver.breaks = False

    run_virtual(main())


# ---------------------------------------------------------------------- the radio's air
def test_a_stream_that_joins_is_served_at_once_though_others_have_long_periods(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "slow", 1, "scout1", period_s=10.0)
            await command(pool, "slow", 1, Halt(), "scout1")
            await pool.clock.sleep_s(1.0)
            await connect_robot(pool, "quick", 2, "scout2", period_s=0.05)
            await command(pool, "quick", 2, Halt(), "scout2")
            joined_s = pool.clock.now_s()
            await pool.clock.sleep_s(1.0)
            heard = [packet.at_s for packet in pool.radio_driver.heard_by(2)]
            assert heard[0] - joined_s < 0.01
            assert len(heard) == 20
            assert pool.running["radio"].statistics()["overruns"] == 0

    run_virtual(main())


def test_time_in_which_nothing_was_loaded_is_no_overrun(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await pool.clock.sleep_s(0.7)
            await command(pool, "one", 1, Halt())
            await pool.clock.sleep_s(0.5)
            assert pool.running["radio"].statistics()["overruns"] == 0

    run_virtual(main())


def test_two_packets_are_never_on_the_air_at_once(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            for number, scout in ((1, "scout1"), (2, "scout2")):
                await connect_robot(pool, f"arc{number}", number, scout, period_s=0.01)
                await command(pool, f"arc{number}", number, Halt(), scout)
            for _ in range(20):
                await command(pool, "arc1", 1, Jump(), "scout1")
                await pool.clock.sleep_s(0.013)
            times = [packet.at_s for packet in pool.radio_driver.heard]
            assert all(later - earlier >= 0.002 - 1e-9 for earlier, later in itertools.pairwise(times))

    run_virtual(main())


def test_a_stream_without_a_period_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            for period_s in (0.0, -1.0, math.nan):
                with pytest.raises(Refusal):
                    await connect(pool, "radio", "one", 1, use=RcUse([Usage(period_s, 0.002)]))
            assert not (await state_of(pool, "radio")).holders
            await connect(pool, "radio", "one", 2, use=RcUse([Usage(0.1, 0.002)]))

    run_virtual(main())


# ---------------------------------------------------------------------- pictures
def test_pictures_arrive_under_the_arc_with_the_epoch_of_the_grant(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "capture", "scout1")
            seen: list[Frame] = []
            await arc.wait_granted()
            frames = arc.frames(seen.append)
            driver = pool.grabber_driver
            assert driver.frequency == "video"
            for _ in range(3):
                driver.deliver(driver.picture())
                await pool.clock.sleep_s(0.05)
            assert [frame.number for frame in seen] == [1, 2, 3]
            assert {frame.epoch for frame in seen} == {arc.granted.epochs["grabber"]}
            frames.close()

    run_virtual(main())


def test_no_picture_arrives_after_the_disconnection_even_if_the_driver_goes_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            late = driver.deliver
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            await disconnect(pool, "grabber", "one", 1)
            late(driver.picture())
            await connect(pool, "grabber", "one", 2)
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            assert [frame.epoch for frame in heard] == [1]
            assert driver.stops >= 1

    run_virtual(main())


def test_garbled_and_silent_pictures_are_counted_and_not_delivered(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            for transmitters in (0, 2, 1, 3, -1, 0):
                driver.deliver(driver.picture(transmitters))
                await pool.clock.sleep_s(0.01)
            statistics = pool.running["grabber"].statistics()
            assert len(heard) == 2
            assert (statistics["frames_delivered"], statistics["frames_garbled"], statistics["frames_silent"]) == (
                2,
                2,
                2,
            )

    run_virtual(main())


def test_a_frequency_the_framegrabber_does_not_receive_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            await connect(pool, "grabber", "one", 1)
            with pytest.raises(Refusal) as refused:
                await pool.voice("one").ask(at("grabber"), Tune("elsewhere").under("one", 1), Applied, within_s=1)
            assert refused.value.code == "framegrabber.frequency"
            assert pool.grabber_driver.deliver is None

    run_virtual(main())
