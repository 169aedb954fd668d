"""``start``, ``stop`` and ``why`` of a name say what is really the matter with it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from backbone.addresses import DEPENDENCY_DATABASE, LAUNCHER, NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.ordering import running_otherwise
from backbone.component.messages import ComponentState, LifeState
from backbone.component_database.messages import UnknownType
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.launcher.start_by_hand import named_in_place_of_its_type
from backbone.nameserver.messages import Resolve, Resolved, UnknownName
from backbone.picture.reasons import reasons_for
from backbone.placer.messages import AskDeclared, AskPlacement, DeclaredOrder, NotPlaced, Start
from backbone.placer.placement_book import PlacementBook
from backbone.wire import Envelope

WORLD = Start("simulated_world", "world")
RUNS = ComponentState(NAMESERVER, "nameserver", "base", 1, LifeState.READY, 0.0)


def scene(work: Callable[[Bus], Awaitable[None]]) -> None:
    book = PlacementBook()
    book.stop_ordered("watch1", "by command")

    async def answer(question: Envelope[Any]) -> Any:
        match question.body:
            case AskResources():
                return Resources([Resource("scout1", "scout")])
            case AskDeclared(name=name):
                return DeclaredOrder(WORLD if name == WORLD.name else None)
            case AskPlacement(name=name):
                return book.record(name).placement()
            case Resolve(name=name) if name == "nameserver":
                return Resolved(RUNS)
            case Resolve(name=name):
                raise UnknownName(f"no component is registered as {name!r}")

    async def main() -> None:
        network, clock = LocalNetwork("m"), VirtualClock()
        answered: dict[str, Any] = {
            DEPENDENCY_DATABASE: AskResources,
            LAUNCHER: AskDeclared,
            PLACER: AskPlacement,
            NAMESERVER: Resolve,
        }
        for address, question in answered.items():
            network.join(address, clock).serve(address, question, answer)
        await work(network.join("ui_console/cli-1", clock))

    run_virtual(main())


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("world", "scout-backbone start simulated_world --name world"),
        ("scout1", "scout-backbone start scout --name scout1"),
        ("nothing", "Declare the type"),
    ],
)
def test_a_name_in_place_of_a_type_gets_the_order_that_was_meant(name: str, told: str) -> None:
    async def work(bus: Bus) -> None:
        refusal = await named_in_place_of_its_type(bus, UnknownType(f"no component type {name!r} exists"), Start(name))
        assert told in refusal.remedy

    scene(work)


@pytest.mark.parametrize(("name", "told"), [("nameserver", "'scout-backbone down'"), ("nothing", "See 'scout-")])
def test_what_the_placer_did_not_start_ends_otherwise(name: str, told: str) -> None:
    async def work(bus: Bus) -> None:
        assert told in (await running_otherwise(bus, NotPlaced(f"{name!r} was not placed"), name)).remedy

    scene(work)


def test_why_of_a_stopped_component_says_by_what_it_was_stopped() -> None:
    async def work(bus: Bus) -> None:
        reasons = await reasons_for(bus, "watch1", VirtualClock())
        assert reasons.lines(1.0) == ["'watch1' was stopped, by command"]

    scene(work)
