"""The life of a component on the local bus, in virtual time."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from component_stage import READY_S, TOWER, WALKER, Poke, Poked, Quiet, Stage, Walker, launch, live

from backbone.bus.clock import VirtualClock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import (
    AskParameters,
    AskState,
    ComponentState,
    LifeState,
    Parameters,
    Stop,
    Stopping,
)
from backbone.errors import NoResponder
from backbone.wire import UnknownMessage

# Order of life


def test_the_hooks_run_in_order_and_the_world_sees_each_state() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.end("enough")
        await life
        assert stage.walker.diary == ["connect connecting", "serve ready", "serve cancelled draining", "drain draining"]
        assert stage.observed == ["ready", "token", "draining", "stopped", "no token"]
        assert stage.walker.state is LifeState.STOPPED

    live(law())


def test_whoever_sees_the_token_can_ask() -> None:
    async def law() -> None:
        stage = Stage()
        answers: list[Any] = []

        def ask_at_once(_address: str, alive: bool) -> None:
            if alive:
                asking.append(asyncio.create_task(stage.ask(AskState(), ComponentState)))

        asking: list[asyncio.Task[Any]] = []
        stage.tower.watch_alive(WALKER, ask_at_once)
        life = await stage.begin()
        answers = await asyncio.gather(*asking)
        assert [answer.state for answer in answers] == [LifeState.READY]
        stage.walker.end("enough")
        await life

    live(law())


def test_before_it_is_ready_nobody_can_ask() -> None:
    async def law() -> None:
        stage = Stage(hold="connect")
        life = await stage.begin()
        with pytest.raises(NoResponder):
            await stage.ask(AskState(), ComponentState)
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.virtual_limit(4e3)
def test_a_component_whose_work_is_done_lives_on() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.clock.sleep_s(3600.0)
        assert (await stage.ask(AskState(), ComponentState)).state is LifeState.READY
        stage.walker.end("enough")
        await life

    live(law())


def test_while_it_drains_it_still_stands_and_answers() -> None:
    """A token that fell before the hardware is safe would let a successor begin too early."""

    async def law() -> None:
        stage = Stage(hold="drain")
        life = await stage.begin()
        stage.walker.end("enough")
        await stage.clock.sleep_s(1.0)
        assert stage.observed == ["ready", "token", "draining"]
        assert (await stage.ask(AskState(), ComponentState)).state is LifeState.DRAINING
        life.cancel()
        with pytest.raises(asyncio.CancelledError):
            await life

    live(law())


def test_told_to_end_while_it_connects_it_ends_without_draining() -> None:
    async def law() -> None:
        stage = Stage(hold="connect")
        life = await stage.begin()
        stage.walker.end("SIGTERM")
        await asyncio.wait_for(life, 1.0)
        assert stage.walker.diary == ["connect connecting"]
        assert stage.observed == ["stopped"]

    live(law())


def test_told_to_end_before_it_began_it_never_appears() -> None:
    async def law() -> None:
        stage = Stage()
        stage.walker.end("SIGTERM")
        life = await stage.begin()
        await life
        assert (stage.observed, stage.walker.diary) == ([], [])

    live(law())


def test_cancelled_it_dies_like_a_killed_process() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        life.cancel()
        with pytest.raises(asyncio.CancelledError):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.observed == ["ready", "token", "no token"]
        assert "drain draining" not in stage.walker.diary

    live(law())


def test_a_component_without_hooks_lives_and_stops() -> None:
    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        quiet: Quiet = Quiet(launch(), network.join(WALKER, clock), clock)
        life = asyncio.create_task(quiet.run())
        await clock.sleep_s(READY_S)
        tower = network.join(TOWER, clock)
        with pytest.raises(UnknownMessage):
            await tower.ask(WALKER, Poke("x"), Poked, within_s=1.0)
        assert (await tower.ask(WALKER, AskParameters(), Parameters, within_s=1.0)).values == {}
        assert await tower.ask(WALKER, Stop(), Stopping, within_s=1.0) == Stopping()
        await life

    live(law())


# Stop


def test_stop_is_answered_and_ends_it() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        assert await stage.ask(Stop("the mission is over"), Stopping) == Stopping()
        await asyncio.wait_for(life, 1.0)
        assert stage.observed[-2:] == ["stopped", "no token"]
        ends = [event for event in stage.walker.story.of() if event.what.startswith("ends")]
        assert [event.what for event in ends] == ["ends: the mission is over"]
        assert ends[0].cause.startswith(f"{TOWER}#")

    live(law())


def test_stop_without_a_reason_names_who_asked() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.ask(Stop(), Stopping)
        await life
        assert f"ends: stopped by {TOWER}" in [event.what for event in stage.walker.story.of("walker")]

    live(law())


def test_a_task_asked_for_while_it_drains_does_not_begin_and_is_no_bug() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")

        async def poke_while_draining() -> None:
            await stage.ask(Poke("task"), Poked)
            await stage.clock.sleep_s(0.1)

        stage.walker.drain = poke_while_draining  # type: ignore[method-assign]
        life = await stage.begin()
        stage.walker.end("enough")
        await life
        assert "task draining" not in stage.walker.diary
        assert stage.walker.state is LifeState.STOPPED

    live(law())


def test_a_task_can_be_started_while_it_connects() -> None:
    class Eager(Walker):
        async def connect(self) -> None:
            self.start_task(self.note_later(), "early")

    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        eager = Eager(launch(), network.join(WALKER, clock), clock)
        life = asyncio.create_task(eager.run())
        await clock.sleep_s(READY_S)
        assert [event.what for event in eager.story.of("way")] == ["was walked"]
        eager.end("enough")
        await life

    live(law())


def test_a_task_before_life_is_a_bug() -> None:
    async def law() -> None:
        stage = Stage()
        with pytest.raises(RuntimeError, match="before it connects"):
            stage.walker.start_task(stage.walker.at("task"), "early")

    live(law())
