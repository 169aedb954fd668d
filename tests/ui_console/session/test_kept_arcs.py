"""A console that keeps its ARC between two holds."""

from __future__ import annotations

from typing import Any

from driven_console import console, grant_at_once
from fake_resource_pool import FakePlacer

from backbone.component.messages import Parameters, SetParameter
from resource_pool.arc_client import Suspended
from ui_console.model.driving import MoveWish
from ui_console.model.events import ConsoleEvent, GivenBack, said

FORWARD = MoveWish(0.1, 0.0)


def test_a_console_that_keeps_its_arc_asks_again_without_a_new_one(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        async with beside(console(placer, events.append, keeps_arc=True)) as driven:
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            for turn in range(1, 4):
                await arc.grant()
                assert await driven.do(FORWARD)
                await driven.give_back()
                assert (arc.is_idle, arc.granted, driven.is_held) == (True, False, False)
                assert events[-1] == GivenBack(placer.clock.now_s(), "released", True)
                assert not await driven.do(FORWARD)
                driven.take()
                await placer.wait(lambda: not arc.is_idle)
                assert len([event for event in events if isinstance(event, GivenBack)]) == turn
            assert placer.started == [arc.name]
            assert not [event for event in events if isinstance(said(event), Suspended)]
        assert not placer.arcs, "nothing is left behind"

    placer_world(scene)


def test_an_arc_that_rested_and_is_gone_is_started_anew(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None, keeps_arc=True)) as driven:
            await placer.wait(lambda: driven.is_held)
            await driven.give_back()
            [name] = placer.arcs
            await placer.kill(name)
            driven.take()
            await placer.wait(lambda: driven.is_held)
            assert placer.started == [name, name]

    placer_world(scene)


def test_an_arc_that_does_not_confirm_that_it_rests_is_ended(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        placer.on_arc = grant_at_once
        async with beside(console(placer, events.append, keeps_arc=True)) as driven:
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            arc.stays = True
            await driven.give_back()
            assert events[-1] == GivenBack(placer.clock.now_s(), "released", True)
            assert (arc.released, placer.ended) == ("released", [arc.name])
            driven.take()
            await placer.wait(lambda: driven.is_held)
            assert placer.started == [arc.name, arc.name]

    placer_world(scene)


def test_an_arc_that_rested_is_ended_when_something_else_is_asked_for(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None, keeps_arc=True)) as driven:
            await placer.wait(lambda: driven.is_held)
            await driven.give_back()
            await placer.bus.ask(driven.address, SetParameter("priority", 7, "anna"), Parameters, within_s=1)
            driven.take()
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            assert arc.parameters["path"] == [["console-7", 7]]
            await driven.give_back()
            await driven.switch("scout2")
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            assert arc.parameters["wish"] == {"robot": "scout2"}

    placer_world(scene)
