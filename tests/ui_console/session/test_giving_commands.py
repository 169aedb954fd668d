"""A console sends what the ARC of its robot takes: halts, and single commands that may or may not move the robot."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakeArc, FakePlacer
from known_arcs import serve_types

from backbone.addresses import COMPONENT_DATABASE
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.abilities import Abilities, CommandForm
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem
from backbone.wire import Message
from resource_pool.commands import Halt, Move
from resource_pool.messages import GiveCommand
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import KEYS_LET_GO_S, GiveWish, HaltWish
from ui_console.session.teleoperation import Teleoperation

SHINE, JUMP = GiveWish("shine", {"brightness": 0.5}), GiveWish("jump")
Scene = Callable[["Stage"], Awaitable[None]]


class Stage:
    """A console that holds a robot; the ARC's kind takes these words, the robot's body moves if ``move`` is one."""

    def __init__(self, network: Any, words: list[str]) -> None:
        self.placer = FakePlacer(network, VirtualClock(), {})
        self.placer.on_arc = lambda arc: arc.bus.start(arc.grant())  # type: ignore[attr-defined]
        self.acts: list[OperatorActed] = []
        self.placer.bus.subscribe(
            "*/*", Conversation.OPERATORS, OperatorActed, lambda said: self.acts.append(said.body)
        )
        forms = [CommandForm(word, moves=word in ("move", "jump"), roles=["body"]) for word in words]
        able = Abilities(body="body", commands=forms)
        kind = ComponentType("drive", "x:Y", Subsystem.RESOURCE_POOL, needs={"body": "any"}, abilities=able)
        serve_types(network.join(COMPONENT_DATABASE, self.placer.clock), [kind])
        parameters = {"robot": "scout1", "kind": "drive", "priority": 100}
        launch = Launch("local", Subsystem.UI_CONSOLE, "console-7", "console", "x:Y", "local", "", 0.0, 1.0, parameters)
        bus = network.join(launch.address, self.placer.clock)
        self.model = ConsoleModel("console-7", "anna")
        self.console = Teleoperation(launch, bus, self.placer.clock, show=self.model.apply, watches=False, user="anna")

    @property
    def arc(self) -> FakeArc:
        return self.placer.arcs["console-7-drive"]

    @property
    def given(self) -> list[Any]:
        return [command for _at_s, _epoch, command in self.arc.commands]

    async def moment(self) -> None:
        await self.placer.clock.sleep_s(0.05)


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[..., None]:
    def run(scene: Scene, *words: str) -> None:
        async def main() -> None:
            async with local_mission("local") as network:
                on = Stage(network, list(words))
                async with beside(on.console):
                    await on.placer.wait(lambda: on.console.is_held and on.console.arc_abilities)
                    await scene(on)
                await on.placer.close()

        run_virtual(main())

    return run


@pytest.mark.parametrize(("words", "sent"), [(["move", "halt"], [Halt()]), (["move"], [Move(0.0)]), (["shine"], [])])
def test_a_halt_stops_whatever_moves_and_asks_nothing_of_what_cannot(
    stage: Callable[..., None], words: list[str], sent: list[Message]
) -> None:
    async def scene(on: Stage) -> None:
        assert await on.console.do(HaltWish())
        assert on.given == sent
        assert not on.model.alarm_views()

    stage(scene, *words)


def test_a_command_is_given_by_its_word_recorded_and_its_applied_values_are_shown(stage: Callable[..., None]) -> None:
    async def scene(on: Stage) -> None:
        on.console.give(SHINE)
        await on.moment()
        assert on.given == [GiveCommand("shine", {"brightness": 0.5})]
        assert on.model.own(1.0).applied == "shine brightness 0.5"
        [act] = [act for act in on.acts if act.action is OperatorAction.COMMAND]
        assert (act.subject, act.sentence) == ("scout1", "anna commands it: shine brightness 0.5")

    stage(scene, "move", "halt", "shine")


def test_once_controls_must_be_let_go_only_commands_that_move_the_robot_wait_for_a_fresh_press(
    stage: Callable[..., None],
) -> None:
    async def scene(on: Stage) -> None:
        on.console.give(JUMP)
        await on.moment()
        on.console.require_let_go()
        for wish in (JUMP, SHINE):
            on.console.give(wish)
        await on.moment()
        assert [one.word for one in on.given] == ["jump", "shine"]
        await on.placer.clock.sleep_s(KEYS_LET_GO_S)
        on.console.give(JUMP)
        await on.moment()
        assert [one.word for one in on.given] == ["jump", "shine", "jump"]

    stage(scene, "move", "halt", "jump", "shine")
