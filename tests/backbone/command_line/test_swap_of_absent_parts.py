"""``swap`` of a module or behavior whose component is placed, and is being started again just now."""

from __future__ import annotations

import asyncio
import re

import pytest

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.module_commands import class_path_of
from backbone.command_line.swapping import addressed, swapped_by
from backbone.command_line.wrong_words import WrongUsage
from backbone.component.messages import (
    Absence,
    AskParameters,
    AskState,
    AskTime,
    ComponentState,
    LifeState,
    MissionTime,
)
from backbone.errors import Refusal
from backbone.exchange import Silent, SwapModule, UnknownModule
from backbone.mission.model import EXECUTION_UNIT
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.placer.messages import AskDeclared, DeclaredOrder, ListPlacements, Placement, Placements, Start
from backbone.reading_anew import WrongClass
from backbone.wire import Envelope, Message


@pytest.mark.parametrize(
    ("placed", "refused", "told"),
    [
        ({"waves": EXECUTION_UNIT}, Silent, "smoothing is not known: waves is not up and may run it"),
        ({"smoothing": "patrol"}, Silent, "smoothing is not up"),
        ({"radio": "command_radio"}, UnknownModule, "'smoothing' runs"),
        ({"lost": EXECUTION_UNIT}, Silent, "lost was lost with the creator of far .Check the link to far; then swap"),
    ],
)
def test_what_is_being_started_again_is_not_called_unknown(
    placed: dict[str, str], refused: type[Refusal], told: str
) -> None:
    async def listed(_asked: Envelope[Message]) -> Message:
        return Components([], complete=True, hub_since_s=0.0)

    async def placer(asked: Envelope[Message]) -> Message:
        if isinstance(asked.body, AskState):
            away = Absence("lost", 0.0, "was lost with the creator of far", "waits", "check the link to far")
            return ComponentState(PLACER, "placer", "base", 1, LifeState.READY, 0.0, absent=[away])
        return Placements([Placement(name, kind, "base", "", 0.0, []) for name, kind in placed.items()])

    async def scene() -> None:
        bus = LocalNetwork("m").join(NAMESERVER, VirtualClock())
        bus.serve(NAMESERVER, ListComponents, listed)
        bus.serve(PLACER, ListPlacements | AskState, placer)
        with pytest.raises(refused) as caught:
            await addressed(bus, SwapModule("smoothing", "pair:Smoothing"))
        assert re.search(told, str(caught.value))
        await bus.close()

    run_virtual(scene())


@pytest.mark.parametrize(("at", "is_refused"), [("resource_pool/radio", False), ("mission_control/radio", True)])
def test_only_the_driver_of_a_resource_is_exchanged_by_the_name_of_a_built_in_one(at: str, is_refused: bool) -> None:
    there = ComponentState(at, "command_radio", "base", 1, LifeState.READY, 0.0)

    async def listed(_asked: Envelope[Message]) -> Message:
        return Components([there], complete=True, hub_since_s=0.0)

    async def state(_asked: Envelope[Message]) -> Message:
        return there

    async def scene() -> None:
        bus = LocalNetwork("m").join(NAMESERVER, VirtualClock())
        bus.serve(NAMESERVER, ListComponents, listed)
        bus.serve(at, AskState, state)
        asked = SwapModule("radio", class_path_of("simulated"))
        if is_refused:
            with pytest.raises(WrongUsage, match=r"'simulated' is no class.*package\.module:Class"):
                await addressed(bus, asked)
        else:
            assert (await addressed(bus, asked))[1].class_path == "simulated"
        await bus.close()

    run_virtual(scene())


def test_a_module_of_a_stopped_unit_is_refused_with_the_stop() -> None:
    async def answer(asked: Envelope[Message]) -> Message:
        match asked.body:
            case ListComponents():
                return Components([], complete=True, hub_since_s=0.0)
            case ListPlacements():
                return Placements([], {"waves": "by ann"})
            case _:
                return DeclaredOrder(Start(EXECUTION_UNIT, "waves", {"modules": [{"name": "smoothing"}]}))

    async def scene() -> None:
        bus = LocalNetwork("m").join(NAMESERVER, VirtualClock())
        for served, questions in ((NAMESERVER, ListComponents), (PLACER, ListPlacements), (LAUNCHER, AskDeclared)):
            bus.serve(served, questions, answer)
        with pytest.raises(Silent, match="a module of waves, which was stopped, by ann; start it by"):
            await addressed(bus, SwapModule("smoothing", "pair:Smoothing"))
        await bus.close()

    run_virtual(scene())


@pytest.mark.parametrize(("kind", "name"), [(EXECUTION_UNIT, "mission_control/unit"), ("scout", "resource_pool/rover")])
@pytest.mark.parametrize(
    ("creator_answers", "told"),
    [
        (True, "The creator replaces a process that hangs"),
        (False, "nor does the creator of far, so that host cannot be reached .Check the link to far, then swap again"),
    ],
)
def test_a_part_on_a_host_that_cannot_be_reached_is_not_called_a_process_that_hangs(
    kind: str, name: str, creator_answers: bool, told: str
) -> None:
    async def listed(_asked: Envelope[Message]) -> Message:
        return Components([ComponentState(name, kind, "far", 1, LifeState.READY, 0.0)], complete=True, hub_since_s=0.0)

    async def never(_asked: Envelope[Message]) -> Message:
        await asyncio.Event().wait()
        raise AssertionError("waits for ever")

    async def its_time(_asked: Envelope[Message]) -> Message:
        return MissionTime(0.0, 1.0, 0.0)

    async def scene() -> None:
        bus = LocalNetwork("m").join(NAMESERVER, VirtualClock())
        bus.serve(NAMESERVER, ListComponents, listed)
        bus.serve(name, AskState | AskParameters, never)
        bus.serve("backbone/creator-far", AskTime, its_time if creator_answers else never)
        with pytest.raises(Silent) as caught:
            await addressed(bus, SwapModule("rover", "pair:Smoothing"))
        assert re.search(told, str(caught.value))
        await bus.close()

    run_virtual(scene())


@pytest.mark.parametrize("knows_it", [True, False])
def test_a_class_that_a_host_lacks_is_refused_with_the_name_of_the_host(knows_it: bool) -> None:
    unit = "mission_control/waves"

    async def refuse(_asked: Envelope[Message]) -> Message:
        raise WrongClass("pair:Smoothing: No module named 'pair'", class_path="pair:Smoothing")

    async def resolve(_asked: Envelope[Message]) -> Message:
        if not knows_it:
            raise UnknownName("waves has left")
        return Resolved(ComponentState(unit, EXECUTION_UNIT, "far", 1, LifeState.READY, 0.0))

    async def scene() -> None:
        clock = VirtualClock()
        bus = LocalNetwork("m").join(NAMESERVER, clock)
        bus.serve(NAMESERVER, Resolve, resolve)
        bus.serve(unit, SwapModule, refuse)
        with pytest.raises(WrongClass) as caught:
            await swapped_by(bus, clock, unit, SwapModule("smoothing", "pair:Smoothing"), within_s=5.0)
        told = "on host far: " if knows_it else ""
        assert str(caught.value).startswith(f"{told}pair:Smoothing: No module named 'pair' (")
        await bus.close()

    run_virtual(scene())
