"""An ARC opens its gate only when its whole set has settled."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool
from pool_orders import ROBOTS, at, connect, connect_robot

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal, ReplyTimeout
from backbone.rc_manager.messages import CloseGate, GateClosed, GateOpens, OpenGate
from backbone.wire import Envelope
from resource_pool.messages import LoadPacket, PacketLoaded, SwappedOut


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


def test_a_close_that_is_late_does_not_shut_the_next_connection(local_mission: Any) -> None:
    """The owner takes all its time to stop; the RC manager no longer waits for that, and connects the ARC anew."""

    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            arc = await waiting_arc(pool, "drive")
            owner, manager = pool.running["watcher"], pool.manager_voice
            for epoch in (1, 2):
                epochs = {"scout1": epoch, "radio": epoch}
                await connect_robot(pool, arc.arc, epoch)
                await manager.ask(arc.address, OpenGate(epochs, 0.0, 10.0), GateOpens, within_s=2)
                if epoch == 1:
                    await pool.clock.sleep_s(0.1)
                    owner.slow_s = 1.0
                    close = CloseGate("slice", "other", 0.2, -1.0)
                    with pytest.raises(ReplyTimeout):
                        await manager.ask(arc.address, close, GateClosed, within_s=0.15)
            await pool.clock.sleep_s(1.5)
            assert (await arc.state()).epochs == epochs
            assert (await arc.drive(1.0, 1.0)).epoch == 2
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
