"""Claims and releases that follow each other faster than the placer answers."""

from __future__ import annotations

from typing import Any

import pytest
from driven_console import console, grant_at_once
from fake_resource_pool import FakePlacer

from backbone.component.messages import Parameters, SetParameter


@pytest.mark.parametrize(
    ("pressed", "is_held"), [("rrt", True), ("rt", True), ("rtr", False), ("rtrt", True), ("trr", False), ("rtt", True)]
)
def test_of_releases_and_claims_in_a_row_the_last_one_counts(
    placer_world: Any, beside: Any, pressed: str, is_held: bool
) -> None:
    """All are pressed while the first release waits for the placer."""

    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: driven.is_held)
            placer.stop_takes_s = dict.fromkeys(placer.arcs, 0.5)
            for key in pressed:
                driven.take() if key == "t" else driven.begin_release()
                await placer.clock.sleep_s(0.05)
            await placer.clock.sleep_s(3.0)
            assert driven.is_held == is_held
            assert bool(placer.arcs) == is_held

    placer_world(scene)


@pytest.mark.parametrize(
    ("pressed", "wish"), [("sr", None), ("ssr", None), ("srt", "scout2"), ("srs", "scout4"), ("rs", "scout3")]
)
def test_of_switches_and_releases_in_a_row_the_last_one_counts(
    placer_world: Any, beside: Any, pressed: str, wish: str | None
) -> None:
    """All are pressed while the first release waits for the placer; each switch goes to a robot of its own."""

    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: driven.is_held)
            placer.stop_takes_s = dict.fromkeys(placer.arcs, 0.5)
            for number, key in enumerate(pressed, 2):
                match key:
                    case "t":
                        driven.take()
                    case "r":
                        driven.begin_release()
                    case _:
                        driven.start_task(driven.switch(f"scout{number}"), "switch")
                await placer.clock.sleep_s(0.05)
            await placer.clock.sleep_s(3.0)
            assert driven.is_held == (wish is not None)
            assert [arc.parameters["wish"]["robot"] for arc in placer.arcs.values()] == ([wish] if wish else [])

    placer_world(scene)


def test_a_console_outlives_a_placer_that_does_not_confirm_the_end_of_an_arc_that_rested(
    placer_world: Any, beside: Any
) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None, keeps_arc=True)) as driven:
            await placer.wait(lambda: driven.is_held)
            await driven.give_back()
            await placer.bus.ask(driven.address, SetParameter("priority", 7, "anna"), Parameters, within_s=1)
            placer.silence()
            driven.take()
            await placer.clock.sleep_s(1.0)
            placer.speak()
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            assert arc.parameters["path"] == [["console-7", 7]]

    placer_world(scene)
