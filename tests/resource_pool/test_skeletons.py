"""RC and ARC to be copied: the lamp obeys one holder, shines while its robot is granted, and stands in a mission."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool
from rehearsed_missions import assert_each_gets_its_turn

from backbone.bus.clock import run_virtual
from backbone.component.messages import WrongParameter
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected, StaleEpoch
from backbone.scheduling.requests import RcUse
from resource_pool.drivers.interface import UnknownDriver
from resource_pool.messages import Applied
from resource_pool.rcs.scout import Scout
from resource_pool.rcs.skeleton import Lamp, Shine

TOP = Path(__file__).parents[2]
DRIVER = "resource_pool.rcs.skeleton:PaintedLamp"


def said(pool: Pool) -> list[str]:
    """Return the lamp's events, oldest first."""
    events = [event.what for event in pool.running["lamp1"].story.of("lamp1")]
    return [what for what in events if what.startswith(("shines", "is dark"))]


def test_the_lamp_shines_for_its_holder_only_and_is_dark_afterwards(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            await pool.start(Lamp, "lamp1", {"driver": DRIVER, "color": "green"})
            manager, one, two = pool.manager_voice, pool.voice("one"), pool.voice("two")
            await manager.ask("resource_pool/lamp1", Connect("one", 1, 2.0, RcUse(), {}), Connected, within_s=1)
            applied = await one.ask("resource_pool/lamp1", Shine(7.0).under("one", 1), Applied, within_s=1)
            assert applied.values == {"brightness": 1.0}
            with pytest.raises(StaleEpoch):
                await two.ask("resource_pool/lamp1", Shine(0.5).under("two", 1), Applied, within_s=1)
            await manager.ask("resource_pool/lamp1", Disconnect("one", 1), Disconnected, within_s=1)
            assert said(pool) == ["shines green at 100%", "is dark"]

    run_virtual(scene())


def test_the_lamp_of_a_lit_robot_shines_while_the_robot_is_granted(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "lit_drive", "scout1")
            await pool.clock.sleep_s(1.0)
            assert said(pool) == ["shines green at 100%"]
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            assert said(pool) == ["shines green at 100%", "is dark"]

    run_virtual(scene())


def test_each_piece_of_mission_file_in_the_guide_stands_in_the_example() -> None:
    example = " ".join((TOP / "docs/examples/lamp.xml").read_text().split())
    pieces = re.findall(r"```xml\n(.*?)```", (TOP / "docs/how-to/write-a-driver.md").read_text(), re.S)
    of_the_lamp = [" ".join(part.split()) for piece in pieces if "lamp" in piece for part in piece.split("…")]
    assert len(of_the_lamp) == 3
    assert [part for part in of_the_lamp if part not in example] == []


def test_the_example_is_sound_and_both_robots_get_the_lamp() -> None:
    assert_each_gets_its_turn(TOP / "docs/examples/lamp.xml")


@pytest.mark.parametrize(
    ("component", "parameters", "fault"),
    [
        (Lamp, {"driver": DRIVER, "colour": "green"}, WrongParameter),
        (Lamp, {"driver": DRIVER, "color": 3}, WrongParameter),
        (Lamp, {"driver": "simulated"}, UnknownDriver),
        (Lamp, {"driver": "resource_pool.rcs.skeleton:NoLamp"}, UnknownDriver),
        (Scout, {"network_id": 1, "port": "/dev/null"}, WrongParameter),
    ],
)
def test_what_neither_rc_nor_driver_understands_keeps_it_from_starting(
    local_mission: Any, component: Any, parameters: dict[str, Any], fault: type[Exception]
) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            with pytest.raises(fault):
                await pool.start(component, "lamp1", parameters)

    run_virtual(scene())
