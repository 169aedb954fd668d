"""An operator stops a robot without a grant; nothing moves it until that very stop is lifted."""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.inbox import reader_of
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.ranges import LONGEST_LEASE_S
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected
from backbone.scheduling.requests import RcUse, Usage
from backbone.wire import Envelope, Message, write
from resource_pool.arc_client import EmergencyStopped, StopState, ask_stop, lift_stop, stop_robot, watch_stops
from resource_pool.commands import Drive, Jump
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied, LoadPacket, NotFromYou, NoTurnSoon, PacketLoaded
from resource_pool.stop_messages import EmergencyStop, GivenBeforeStop, OtherStop
from scout_model.radio_link import encode_drive, encode_halt, encode_jump, encode_transmitter_on

RCS = ["scout1", "scout2", "radio"]
OPERATOR = "ui_console/console-1"


def payloads(pool: Pool, network_id: int) -> list[bytes]:
    return [packet.payload for packet in pool.radio_driver.heard_by(network_id)]


def test_a_stop_without_a_grant_halts_the_holders_robot_and_tells_the_holder_who_and_why(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            arc = await pool.arc(await pool.owner("patrol"), "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(4.0, 4.0)
            await pool.clock.sleep_s(0.1)
            operator = pool.voice_of(OPERATOR)
            heard: list[StopState] = []
            watch_stops(operator, heard.append)
            state = await stop_robot(operator, "scout1", "child in the room", "anna")
            assert (state.is_stopped, state.by, state.is_confirmed) == (True, "anna", True)
            await pool.clock.sleep_s(0.1)
            sent = payloads(pool, 1)
            assert sent[-1] == encode_halt()
            with pytest.raises(EmergencyStopped) as refusal:
                await arc.drive(4.0, 4.0)
            assert (refusal.value.facts["by"], refusal.value.facts["reason"]) == ("anna", "child in the room")
            with pytest.raises(EmergencyStopped):
                await arc.jump()
            await arc.halt()
            await pool.clock.sleep_s(1.0)
            assert set(payloads(pool, 1)[len(sent) :]) == {encode_halt()}
            assert arc.granted is not None
            assert heard == [state]

    run_virtual(main())


def test_other_robots_of_the_same_radio_drive_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            arc = await pool.arc(await pool.owner("patrol"), "drive", "scout2")
            await arc.wait_granted()
            await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            await arc.drive(4.0, 4.0)
            await pool.clock.sleep_s(0.1)
            assert payloads(pool, 2)[-1] == encode_drive(4.0, 4.0)

    run_virtual(main())


def test_whoever_holds_the_robot_next_cannot_move_it_either_until_the_stop_is_lifted(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            operator = pool.voice_of(OPERATOR)
            stop = await stop_robot(operator, "scout1", "")
            assert not payloads(pool, 1)
            _owner, arc = await pool.console("console-9", "drive", "scout1")
            await arc.wait_granted()
            with pytest.raises(EmergencyStopped):
                await arc.drive(1.0, 1.0)
            lifted = await lift_stop(operator, stop, "ben")
            assert (lifted.is_stopped, lifted.by) == (False, "ben")
            await arc.wait_stop_lifted("scout1")
            await arc.drive(1.0, 1.0)

    run_virtual(main())


def test_a_lift_that_was_overtaken_by_another_stop_lifts_nothing(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            operator = pool.voice_of(OPERATOR)
            first = await stop_robot(operator, "scout1", "")
            await lift_stop(operator, first)
            second = await stop_robot(pool.voice_of("ui_console/console-2"), "scout1", "again")
            with pytest.raises(OtherStop):
                await lift_stop(operator, first)
            assert await ask_stop(operator, "scout1") == second

    run_virtual(main())


@pytest.mark.parametrize("stranger", ["mission_control/patrol", "resource_pool/scout2", "ui_consoles/x"])
def test_only_operators_stop_and_lift(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            voice = pool.voice_of(stranger)
            with pytest.raises(NotFromYou):
                await stop_robot(voice, "scout1", "")
            stop = await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            with pytest.raises(NotFromYou):
                await lift_stop(voice, stop)
            assert (await ask_stop(voice, "scout1")).is_stopped

    run_virtual(main())


def test_a_stop_the_radio_does_not_take_is_told_as_unconfirmed_and_the_robot_stands_by_itself(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool:
            companions = {"scout1": 5, "radio": 6}
            for rc, use in (("radio", RcUse([Usage(0.05, 0.002)])), ("scout1", RcUse())):
                order = Connect("one", companions[rc], 60.0, use, companions)
                await pool.manager_voice.ask(f"resource_pool/{rc}", order, Connected, within_s=1)
            drive = Drive(4.0, 4.0).under("one", 5)
            await pool.voice("one").ask("resource_pool/scout1", drive, Applied, within_s=1)
            await pool.clock.sleep_s(0.1)
            began = await pool.pose("scout1")
            await pool.kill("radio")
            state = await stop_robot(pool.voice_of(OPERATOR), "scout1", "")
            assert (state.is_stopped, state.is_confirmed) == (True, False)
            await pool.clock.sleep_s(COMMAND_TIMEOUT_S + 1.0)
            stood = await pool.pose("scout1")
            await pool.clock.sleep_s(1.0)
            assert await pool.pose("scout1") == pytest.approx(stood, abs=1e-3)
            assert stood != pytest.approx(began, abs=1e-2)

    run_virtual(main())


@asynccontextmanager
async def held_by_hand(pool: Pool, drive_period_s: float = 0.05) -> AsyncIterator[Bus]:
    """Give the voice of an ARC that holds scout1 and the radio, whose commands the test sends when it likes."""
    streams = [Usage(drive_period_s, 0.002), Usage(0.25, 0.002, kind="jump")]
    companions = {"scout1": 5, "radio": 6}
    for rc, use in (("radio", RcUse(streams)), ("scout1", RcUse())):
        order = Connect("one", companions[rc], LONGEST_LEASE_S, use, companions)
        await pool.manager_voice.ask(f"resource_pool/{rc}", order, Connected, within_s=1)
    yield pool.voice("one")


async def command(voice: Bus, what: Drive | Jump) -> Applied:
    return await voice.ask("resource_pool/scout1", what.under("one", 5), Applied, within_s=1)


def test_a_drive_sent_before_a_stop_that_arrives_after_its_lift_is_never_applied(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool, held_by_hand(pool) as voice:
            before = Drive(4.0, 4.0)
            operator = pool.voice_of(OPERATOR)
            stop = await stop_robot(operator, "scout1", "", "anna")
            await lift_stop(operator, stop)
            with pytest.raises(EmergencyStopped) as refusal:
                await command(voice, before)
            assert (refusal.value.code, refusal.value.facts["number"]) == (GivenBeforeStop.code, stop.number)
            await pool.clock.sleep_s(0.5)
            assert set(payloads(pool, 1)) <= {encode_halt()}
            await command(voice, Drive(4.0, 4.0, after_stop=stop.number))
            await pool.clock.sleep_s(0.1)
            assert payloads(pool, 1)[-1] == encode_drive(4.0, 4.0)

    run_virtual(main())


def test_a_jump_that_waits_at_the_radio_when_the_stop_comes_is_not_sent(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool, held_by_hand(pool) as voice:
            await command(voice, Jump())
            jumping = asyncio.create_task(command(voice, Jump()))
            await pool.clock.sleep_s(0.05)
            jumps = payloads(pool, 1).count(encode_jump())
            operator = pool.voice_of(OPERATOR)
            stop = await stop_robot(operator, "scout1", "", "anna")
            with pytest.raises(EmergencyStopped):
                await jumping
            await lift_stop(operator, stop)
            await pool.clock.sleep_s(1.0)
            assert payloads(pool, 1).count(encode_jump()) == jumps == 1

    run_virtual(main())


def test_a_packet_that_overtook_the_stop_on_its_way_to_the_radio_is_refused_there(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool, held_by_hand(pool):
            await stop_robot(pool.voice_of(OPERATOR), "scout1", "", "anna")
            await pool.clock.sleep_s(0.1)
            late = LoadPacket("one", 6, 1, encode_drive(9.0, 9.0), encode_halt(), 5, moves=True, robot_stop=0)
            with pytest.raises(GivenBeforeStop):
                await pool.voice("scout1").ask("resource_pool/radio", late, PacketLoaded, within_s=1)
            await pool.clock.sleep_s(0.2)
            assert set(payloads(pool, 1)) == {encode_halt()}

    run_virtual(main())


def test_a_picture_that_is_being_switched_on_comes_although_the_robot_is_stopped(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "video"]) as pool:
            operator = pool.voice_of(OPERATOR)
            owner = await pool.owner("patrol")
            claiming = pool.arc(owner, "video_drive", "scout1")
            arc, stop = await asyncio.gather(claiming, stop_robot(operator, "scout1", ""))
            await arc.wait_granted()
            assert stop.is_stopped
            assert encode_transmitter_on("video") in payloads(pool, 1)

    run_virtual(main())


def test_a_commander_that_was_refused_for_a_stop_it_did_not_know_of_knows_of_it_then(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            arc = await pool.arc(await pool.owner("patrol"), "drive", "scout1")
            await arc.wait_granted()
            operator = pool.voice_of(OPERATOR)
            await lift_stop(operator, await stop_robot(operator, "scout1", ""))
            with pytest.raises(GivenBeforeStop):
                await arc.drive(1.0, 1.0)
            assert (await arc.drive(1.0, 1.0)).command == "drive"

    run_virtual(main())


def speed_for(known: int) -> float:
    """A wheel speed whose packet names the stop after which its command was given."""
    return 1.0 + known / 200


@pytest.mark.thorough
def test_in_a_thousand_random_stops_nothing_from_before_a_stop_is_on_the_air_after_it(local_mission: Any) -> None:
    """By what the radio sent, and by the world's own audit of the numbers that packets carry."""
    rng = random.Random(12)

    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool, held_by_hand(pool, drive_period_s=0.02) as voice:
            operator, known = pool.voice_of(OPERATOR), 0
            stopped_s: dict[int, float] = {}
            sent: list[tuple[int, asyncio.Task[Applied]]] = []
            for _stop in range(1000):
                for _command in range(rng.randrange(4)):
                    what = (
                        Jump(after_stop=known) if rng.random() < 0.3 else Drive(speed_for(known), 1.0, after_stop=known)
                    )
                    sent.append((known, asyncio.create_task(late(pool, rng.uniform(0, 0.08), voice, what))))
                await pool.clock.sleep_s(rng.uniform(0, 0.12))
                stop = await stop_robot(operator, "scout1", "")
                stopped_s[known] = pool.clock.now_s()
                if rng.random() < 0.5:
                    await pool.clock.sleep_s(rng.uniform(0, 0.12))
                known = (await lift_stop(operator, stop)).number
                if rng.random() < 0.3:
                    await pool.clock.sleep_s(0.1)
            await pool.clock.sleep_s(1.0)
            drives = {encode_drive(speed_for(number), 1.0): number for number in range(known + 1)}
            driven = [
                (packet, drives[packet.payload]) for packet in pool.radio_driver.heard_by(1) if packet.payload in drives
            ]
            assert len({number for _, number in driven}) > 300
            assert not [packet for packet, number in driven if packet.at_s > stopped_s.get(number, math.inf)]
            done = [(number, task.result()) for number, task in sent if task.exception() is None]
            assert {applied.command for _, applied in done} == {"drive", "jump"}
            assert not [one for number, one in done if one.at_s > stopped_s.get(number, math.inf)]
            refusals = {type(task.exception()) for _, task in sent} - {type(None)}
            assert refusals == {EmergencyStopped, GivenBeforeStop, NoTurnSoon}
            assert pool.audit["overtaken_packets"] == 0

    run_virtual(main())


async def late(pool: Pool, on_the_way_s: float, voice: Bus, what: Drive | Jump) -> Applied:
    """A command that takes its time on the way."""
    await pool.clock.sleep_s(on_the_way_s)
    return await command(voice, what)


LONG = {"a report": "x" * 5_000, "controls": "\U000e0001" * 5_000, "no UTF-8": "a file \udcff", "usual": "a child"}


@pytest.mark.parametrize("reason", LONG.values(), ids=LONG)
def test_a_stop_is_carried_out_whatever_its_reason_is(reason: str) -> None:
    async def main() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        robot, operator = network.join("resource_pool/scout1", clock), network.join(OPERATOR, clock)

        async def answer(asked: Envelope[Any]) -> Message:
            read = reader_of(EmergencyStop).read(write(asked)).body
            return StopState("scout1", True, 1, "anna", read.reason, 0.0)

        robot.serve("resource_pool/scout1", EmergencyStop, answer)
        state = await stop_robot(operator, "scout1", reason, "anna")
        assert state.is_stopped
        assert state.reason[:3] == reason[:3] or not reason.isprintable()
        await robot.close()
        await operator.close()

    run_virtual(main())


def test_a_stop_that_is_pressed_again_when_no_holder_is_left_is_confirmed(local_mission: Any) -> None:
    """As when the radio was lost: first the stop is not sure, then the RC manager ends the grant."""

    async def main() -> None:
        async with a_pool(local_mission, RCS, manager=False) as pool, held_by_hand(pool) as voice:
            operator = pool.voice_of(OPERATOR)
            await command(voice, Drive(4.0, 4.0))
            await pool.kill("radio")
            assert not (await stop_robot(operator, "scout1", "")).is_confirmed
            assert not (await stop_robot(operator, "scout1", "")).is_confirmed
            over = Disconnect("one", 5, "its radio is gone")
            await pool.manager_voice.ask("resource_pool/scout1", over, Disconnected, within_s=5)
            await pool.clock.sleep_s(2 * COMMAND_TIMEOUT_S)  # until then its last packet may move it
            again = await stop_robot(operator, "scout1", "")
            assert (again.is_stopped, again.number, again.is_confirmed) == (True, 3, True)

    run_virtual(main())
