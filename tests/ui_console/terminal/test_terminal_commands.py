"""The dialog of commands: every command of the robot is given from it, with its fields, and stops work in it."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from console_scenes import ASK, GRANT, model
from fake_resource_pool import FakePlacer
from known_arcs import lit_types, serve_types
from screen_text import screen_text
from textual.pilot import Pilot
from textual.widgets import Input
from written_session import WrittenSession, settle

from backbone.addresses import COMPONENT_DATABASE
from backbone.bus.clock import VirtualClock
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from resource_pool.messages import GiveCommand
from ui_console.model.arc_abilities import ArcAbilities, arc_abilities
from ui_console.model.driving import GiveWish
from ui_console.model.events import AbilitiesKnown, MomentBegan
from ui_console.session.teleoperation import Teleoperation
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.session import TerminalSession

SIZE = (120, 36)
LIT = arc_abilities("lit", lit_types("lit"))
DIMMED = GiveWish("shine", {"brightness": 0.3}, "lamp")


def lit_session(abilities: ArcAbilities | None = LIT) -> WrittenSession:
    return WrittenSession(shown=model(ASK, AbilitiesKnown(10.0, abilities), GRANT))


async def shown_after(pilot: Pilot[Any], *keys: str) -> str:
    await pilot.press(*keys)
    await settle(pilot)
    return screen_text(pilot.app)


async def test_the_list_names_every_command_and_one_without_fields_is_given_by_enter() -> None:
    session = lit_session()
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        listed = await shown_after(pilot, "o")
        assert "which command for scout1?" in listed
        assert "jump  Wind the spring foot and kick" in listed
        assert "shine  Set the lamp's brightness" in listed
        await shown_after(pilot, "enter")
        assert session.wanted == [GiveWish("jump", {}, "scout")]


async def test_a_command_with_fields_asks_for_each_with_its_range_and_refuses_a_wrong_value_in_a_sentence() -> None:
    session = lit_session()
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        asked = await shown_after(pilot, "o", "down", "enter")
        assert "brightness, 0 to 1" in asked
        assert "brightness needs a value." in await shown_after(pilot, "enter")
        assert "brightness, 0 to 1: 3 is beyond that." in await shown_after(pilot, "3", "enter")
        assert session.wanted == []
        await shown_after(pilot, "backspace", *"0.3", "enter")
        assert session.wanted == [DIMMED]


async def test_a_device_that_cannot_drive_offers_its_commands_and_no_key_to_drive() -> None:
    """At 80 columns a siren offered the arrows, hid the key of its commands, and cut why it has no pictures."""
    assert LIT is not None
    device = msgspec.structs.replace(LIT, reach=None, can_halt=False)
    async with ConsoleApp(lit_session(device)).run_test(size=(80, 24)) as pilot:
        shown = await shown_after(pilot)
        assert "o command" in shown
        assert "drive  " not in shown
        assert "space halt" not in shown
        assert "no pictures: this kind of ARC has no camera" in shown
        assert "framegrabber" in shown


@pytest.mark.parametrize("keys", [["o"], ["o", "down", "enter"]], ids=["list", "fields"])
async def test_the_emergency_stop_works_in_the_dialog_and_escape_gives_nothing(keys: list[str]) -> None:
    session = lit_session()
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await shown_after(pilot, *keys)
        await shown_after(pilot, "x", "X")
        assert session.wanted == ["stop", ("stop robot", "scout1"), "stop", "stop all"]
        assert [field.value for field in pilot.app.screen.query(Input)] == [""] * (len(keys) > 1)
        await shown_after(pilot, "escape")
        assert len(session.wanted) == 4
        assert len(pilot.app.screen_stack) == 1


async def test_a_command_chosen_before_a_stop_or_another_grant_is_not_given_after_it() -> None:
    session = lit_session()
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await shown_after(pilot, "o")
        session.model.apply(MomentBegan(11.0))
        assert "not given: the robot was" in await shown_after(pilot, "enter")
        assert session.wanted == []
        await shown_after(pilot, "o", "enter")
        assert session.wanted == [GiveWish("jump", {}, "scout")]


@pytest.mark.parametrize(
    ("abilities", "told"),
    [(None, "has not told its"), (ArcAbilities(None, False, []), "has no other commands")],
)
async def test_without_commands_the_key_says_so(abilities: ArcAbilities | None, told: str) -> None:
    session = lit_session(abilities)
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        assert told in await shown_after(pilot, "o")
        assert len(pilot.app.screen_stack) == 1


async def test_without_a_robot_the_key_says_so_and_a_robot_that_cannot_jump_is_not_told_to() -> None:
    session = WrittenSession(shown=model(ASK, AbilitiesKnown(10.0, ArcAbilities(None, False, []))))
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        assert "you hold no robot" in await shown_after(pilot, "o")
        assert "cannot jump" in await shown_after(pilot, "j")
        assert session.wanted == []


async def test_a_lamp_beside_the_robot_is_dimmed_over_the_bus(local_mission: Any) -> None:
    async with local_mission("local") as network:
        clock = VirtualClock()
        placer = FakePlacer(network, clock, {})
        placer.on_arc = lambda arc: arc.bus.start(arc.grant())  # type: ignore[attr-defined]
        serve_types(network.join(COMPONENT_DATABASE, clock), lit_types("lit"))
        session = TerminalSession("console-7", user="anna")
        parameters = {"robot": "scout1", "kind": "lit", "priority": 100}
        launch = Launch("local", Subsystem.UI_CONSOLE, "console-7", "console", "x:Y", "local", "", 0.0, 1.0, parameters)
        console = Teleoperation(launch, network.join(launch.address, clock), clock, show=session.show, watches=False)

        async def dim(pilot: Pilot[Any]) -> None:
            await placer.wait(lambda: console.is_held and session.model.abilities)
            await shown_after(pilot, "o", "down", "enter", *"0.3", "enter")
            [arc] = placer.arcs.values()
            await placer.wait(lambda: arc.commands)
            assert arc.commands[-1][2] == GiveCommand("shine", {"brightness": 0.3}, "lamp")
            assert session.model.own(clock.now_s()).applied == "shine brightness 0.3"
            await pilot.press("q")

        await session.run(console, pilot=dim, size=SIZE)
        await placer.close()
