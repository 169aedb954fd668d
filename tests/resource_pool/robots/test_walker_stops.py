"""However a walk ends, the walker stands upright afterwards, and no step of it follows."""

from __future__ import annotations

import random
from typing import Any, cast

import pytest
from pool_on_local_network import Pool
from walker_pool import (
    OPERATOR,
    STANDS_S,
    Trunk,
    assert_stands,
    move_for,
    play,
    sent,
    steps,
    take_over,
)

from backbone.errors import LinkError, Refusal
from backbone.rc_manager.messages import Disconnect, Disconnected
from backbone.wire import Envelope, Message
from resource_pool.arc_client import ArcClient, lift_stop, stop_robot
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import COMMAND_TIMEOUT_S, NoTurnSoon
from resource_pool.rcs.command_radio import CommandRadio
from resource_pool.robots.walker.gait import TROT
from resource_pool.robots.walker.link import JointTargets
from resource_pool.stop_messages import EmergencyStopped
from scout_model.radio_link import HaltPacket, Safe


def test_silence_walks_it_to_a_stand(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 1.0, 0.3)
        await pool.clock.sleep_s(COMMAND_TIMEOUT_S - 0.2)
        assert isinstance(sent(pool)[-1], JointTargets)
        await assert_stands(pool, trunk)
        assert sent(pool)[-1] == HaltPacket()
        assert pool.running["walker1"].statistics()["command_timeouts"] == 1
        await move_for(pool, arc, 1.0, 0.3)
        assert steps(pool) > 100

    play(local_mission, scene)


def test_an_emergency_stop_ends_the_walk_between_two_steps(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 1.0, 0.3)
        packets = len(sent(pool))
        stop = await stop_robot(pool.voice_of(OPERATOR), "walker1", "child in the room", "anna")
        assert (stop.is_stopped, stop.is_confirmed) == (True, True)
        stepped = steps(pool)
        with pytest.raises(EmergencyStopped):
            await arc.move(0.3)
        await assert_stands(pool, trunk)
        assert steps(pool) == stepped
        assert set(sent(pool)[packets:]) == {HaltPacket()}
        arc.heard_stop(await lift_stop(pool.voice_of(OPERATOR), stop, "anna"))
        began_m = trunk.x_m
        await move_for(pool, arc, 1.0, 0.3)
        assert trunk.x_m > began_m + 0.1
        assert pool.audit["overtaken_packets"] == pool.audit["stale_packets"] == 0

    play(local_mission, scene)


def test_the_end_of_its_grant_puts_its_legs_down(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 1.0, 0.3)
        await arc.idle()
        stepped = steps(pool)
        await assert_stands(pool, trunk)
        assert sent(pool)[-1] == Safe()
        assert steps(pool) - stepped <= 1
        assert pool.audit["stale_packets"] == 0

    play(local_mission, scene)


def test_no_step_follows_the_end_of_its_hold_even_if_its_radio_still_takes_packets(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 1.0, 0.3)
        order = Disconnect(arc.arc, arc.epochs["walker1"])
        await pool.manager_voice.ask("resource_pool/walker1", order, Disconnected, within_s=1)
        stepped = steps(pool)
        await pool.clock.sleep_s(0.1)
        assert steps(pool) == stepped

    play(local_mission, scene)


async def hand_over(pool: Pool, arc: ArcClient, trunk: Trunk, share: float) -> None:
    """Let a person take the walker over at this share of a round of its feet, and walk the other way."""
    await move_for(pool, arc, 1.0, 0.3)
    await pool.clock.sleep_s(share * TROT.period_s)
    person = await take_over(pool, "anna")
    began_m = trunk.x_m
    await move_for(pool, person, 2.0, -0.3)
    assert trunk.x_m < began_m - 0.3
    assert pool.audit["stale_packets"] == 0


@pytest.mark.parametrize("share", [0.1, 0.6])
def test_a_take_over_in_the_middle_of_a_step_hands_it_over_upright(local_mission: Any, share: float) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await hand_over(pool, arc, trunk, share)

    play(local_mission, scene)


@pytest.mark.slow
@pytest.mark.parametrize("twentieth", range(20))
def test_it_is_handed_over_upright_at_every_phase(local_mission: Any, twentieth: int) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await hand_over(pool, arc, trunk, twentieth / 20)

    play(local_mission, scene)


async def end_walk(pool: Pool, arc: ArcClient, how: str) -> None:
    match how:
        case "halt":
            await arc.halt()
        case "still":
            await arc.move(0.0)
        case "stop":
            await stop_robot(pool.voice_of(OPERATOR), "walker1", "child in the room", "anna")
        case "idle":
            await arc.idle()
        case "take over":
            await take_over(pool, "anna")
        case "kill":
            await pool.kill("walker1")
        case "kill radio":
            await pool.kill("radio")


@pytest.mark.slow
@pytest.mark.parametrize("how", ["halt", "still", "silence", "stop", "idle", "take over", "kill", "kill radio"])
@pytest.mark.parametrize("seed", range(10))
def test_whatever_ends_a_walk_at_whatever_moment_it_stands_upright(local_mission: Any, how: str, seed: int) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        rng = random.Random(seed)
        for _ in range(3):
            forward_m_s, turn_rad_s = rng.uniform(-0.4, 0.4), rng.uniform(-2.0, 2.0)
            await move_for(pool, arc, rng.uniform(0.1, 1.5), forward_m_s, turn_rad_s)
        await pool.clock.sleep_s(rng.uniform(0.0, 0.1))
        await end_walk(pool, arc, how)
        await pool.clock.sleep_s(COMMAND_TIMEOUT_S + STANDS_S)
        stood = (trunk.x_m, trunk.y_m)
        await pool.clock.sleep_s(1.0)
        assert (trunk.x_m, trunk.y_m) == pytest.approx(stood, abs=2e-3)

    play(local_mission, scene)


@pytest.mark.parametrize("fault", ["breaks", "hangs"])
def test_a_walker_whose_radio_fails_puts_its_legs_down(local_mission: Any, fault: str) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        await move_for(pool, arc, 1.0, 0.3)
        setattr(pool.radio_driver, fault, True)
        with pytest.raises((Refusal, LinkError)):
            await move_for(pool, arc, 3.0, 0.3)
        await assert_stands(pool, trunk)
        assert isinstance(await pool.outcome("radio"), HardwareFault)

    play(local_mission, scene)


class RefusingRadio(CommandRadio):
    """Refuses packets when the test says so, and keeps its holders."""

    refuses = False

    async def command(self, asked: Envelope[Message]) -> Message:
        if self.refuses:
            raise NoTurnSoon(f"{self.name} has no turn")
        return await super().command(asked)


def test_a_walk_whose_packets_are_refused_ends_and_its_sender_learns_why(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, trunk: Trunk) -> None:
        radio = cast(RefusingRadio, pool.running["radio"])
        await move_for(pool, arc, 1.0, 0.3)
        radio.refuses = True
        await assert_stands(pool, trunk)
        notes = [event.what for event in pool.running["walker1"].story.of(arc.arc)]
        assert [note for note in notes if note.startswith("its walk ended: radio has no turn")]
        with pytest.raises(NoTurnSoon):
            await arc.move(0.3)
        radio.refuses = False
        began_m = trunk.x_m
        await move_for(pool, arc, 1.0, 0.3)
        assert trunk.x_m > began_m + 0.1

    play(local_mission, scene, command_radio=RefusingRadio)
