"""RCs, ARCs and the RC manager accept from each component only the messages of its role."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import (
    AskRc,
    AskRequest,
    ChangeRuntime,
    CloseGate,
    Connect,
    Connected,
    CurrentRequest,
    Disconnect,
    Disconnected,
    Done,
    Extend,
    GateClosed,
    GateOpens,
    NotThatArc,
    OpenGate,
    RcState,
    SetIdle,
    Withdraw,
)
from backbone.scheduling.requests import RcUse, Scheduled, Usage
from backbone.wire import Message
from resource_pool.commands import Drive, Tune
from resource_pool.messages import Applied, LoadPacket, NotFromYou, PacketLoaded
from scout_model.radio_link import encode_drive, encode_safe

STRANGERS = [
    "mission_control/watcher",
    "ui_console/console",
    "resource_pool/one",
    "resource_pool/scout2",
    "resource_pool/rc_manager",
    "backbone/placer",
]


def at(name: str) -> str:
    return address(Subsystem.RESOURCE_POOL, name)


async def state_of(pool: Pool, rc: str) -> RcState:
    return await pool.ear.ask(at(rc), AskRc(), RcState, within_s=1)


async def connect_robot(pool: Pool, arc: str, epoch: int) -> None:
    companions = {"scout1": epoch, "radio": epoch + 1}
    for rc, use in (("radio", RcUse([Usage(0.05, 0.002)])), ("scout1", RcUse())):
        order = Connect(arc, companions[rc], 60.0, use, companions)
        await pool.manager_voice.ask(at(rc), order, Connected, within_s=1)


async def refused(pool: Pool, source: str, to: str, question: Message, reply: type[Any]) -> None:
    with pytest.raises(NotFromYou):
        await pool.voice_of(source).ask(at(to), question, reply, within_s=1)


@pytest.mark.parametrize("stranger", STRANGERS)
def test_only_the_rc_manager_gives_and_takes_an_rc(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await refused(pool, stranger, "scout1", Connect("one", 5, 60.0, RcUse(), {}), Connected)
            assert not (await state_of(pool, "scout1")).holders
            await connect_robot(pool, "one", 5)
            before = await state_of(pool, "scout1")
            await refused(pool, stranger, "scout1", Disconnect("one", 99), Disconnected)
            await refused(pool, stranger, "scout1", Connect("two", 99, 60.0, RcUse(), {}), Connected)
            assert await state_of(pool, "scout1") == before
            assert pool.running["scout1"].statistics()["refused_strangers"] == 3

    run_virtual(main())


@pytest.mark.parametrize("stranger", [*STRANGERS[:2], "resource_pool/two", "backbone/rc_manager"])
def test_only_the_arc_that_holds_an_rc_commands_it_under_its_name(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "grabber"], manager=False) as pool:
            await connect_robot(pool, "one", 5)
            await pool.manager_voice.ask(at("grabber"), Connect("one", 7, 60.0, RcUse(), {}), Connected, within_s=1)
            await refused(pool, stranger, "scout1", Drive(9.0, 9.0).under("one", 5), Applied)
            await refused(pool, stranger, "grabber", Tune("video").under("one", 7), Applied)
            await pool.clock.sleep_s(0.3)
            assert not pool.radio_driver.heard
            assert pool.grabber_driver.frequency == ""
            assert (await state_of(pool, "scout1")).applied == 0
            await pool.voice("one").ask(at("scout1"), Drive(1.0, 1.0).under("one", 5), Applied, within_s=1)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_drive(1.0, 1.0)

    run_virtual(main())


def test_a_command_that_names_no_arc_is_refused_with_its_sender(local_mission: Any) -> None:
    """As of ``inject``; it was refused as stale, "scout1:  commands under epoch 0", in an event about no name."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            with pytest.raises(NotFromYou, match="scout1 does not take Drive for no ARC from command_line/inject"):
                await pool.voice_of("command_line/inject").ask(at("scout1"), Drive(1.0, 1.0), Applied, within_s=1)
            assert (await state_of(pool, "scout1")).refused_stale == 0
            assert all(event.subject for event in pool.running["scout1"].story.of())

    run_virtual(main())


@pytest.mark.parametrize(
    ("source", "robot_epoch"),
    [
        ("resource_pool/one", 5),  # the ARC itself: it has no business with packets
        ("resource_pool/scout2", 5),  # a robot of somebody else
        ("resource_pool/scout1", 4),  # the right robot, under an earlier grant
        ("ui_console/scout1", 5),
        ("backbone/rc_manager", 5),
    ],
)
def test_the_radio_takes_packets_only_from_a_robot_connected_together_with_it(
    local_mission: Any, source: str, robot_epoch: int
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            order = Connect("one", 6, 60.0, RcUse([Usage(0.05, 0.002)]), {"scout1": 5, "radio": 6})
            await pool.manager_voice.ask(at("radio"), order, Connected, within_s=1)
            for at_once in (False, True):
                packet = LoadPacket("one", 6, 1, encode_drive(9.0, 9.0), encode_safe(), robot_epoch, at_once)
                await refused(pool, source, "radio", packet, PacketLoaded)
            await pool.clock.sleep_s(0.3)
            assert not pool.radio_driver.heard
            packet = LoadPacket("one", 6, 1, encode_drive(1.0, 1.0), encode_safe(), 5)
            await pool.voice("scout1").ask(at("radio"), packet, PacketLoaded, within_s=1)
            await pool.clock.sleep_s(0.1)
            assert pool.radio_driver.heard

    run_virtual(main())


@pytest.mark.parametrize("stranger", ["mission_control/watcher", "ui_console/console", "resource_pool/scout1"])
def test_only_the_rc_manager_opens_and_shuts_a_gate_and_asks_for_the_request(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            granted = await arc.wait_granted()
            await refused(pool, stranger, arc.arc, CloseGate("higher", "me", 0.0, -1.0), GateClosed)
            await refused(pool, stranger, arc.arc, OpenGate({"scout1": 99, "radio": 99}, 0.0, 9e9), GateOpens)
            await refused(pool, stranger, arc.arc, AskRequest(), CurrentRequest)
            state = await arc.state()
            assert (state.granted, state.epochs) == (True, granted.epochs)
            assert (await arc.drive(1.0, 1.0)).epoch == granted.epochs["scout1"]

    run_virtual(main())


@pytest.mark.parametrize("stranger", ["mission_control/watcher", "ui_console/console", "resource_pool/scout1"])
def test_only_an_arc_itself_sends_changes_and_withdraws_its_request(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            current = await pool.manager_voice.ask(arc.address, AskRequest(), CurrentRequest, within_s=1)
            name = arc.arc
            for order in (SetIdle(name, True), ChangeRuntime(name, 0.1), Extend(name, 9e3), Withdraw(name)):
                with pytest.raises(NotThatArc):
                    await pool.voice_of(stranger).ask(RC_MANAGER, order, Done, within_s=1)
            with pytest.raises(NotThatArc):
                await pool.voice_of(stranger).ask(RC_MANAGER, current.request, Scheduled, within_s=1)
            await pool.clock.sleep_s(1.0)
            assert owner.heard() == ["Resumed"]

    run_virtual(main())
