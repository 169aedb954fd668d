"""A console that was told no kind of ARC asks the mission for one that suits its robot, anew for each robot.

From the same answers it knows what its operator can do with the ARC; told a kind, it asks for that alone.
"""

from __future__ import annotations

from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.addresses import COMPONENT_DATABASE, DEPENDENCY_DATABASE
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.abilities import Abilities, CommandForm
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType, ListTypes, TypeCount, Types
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from ui_console.model.arc_abilities import SLOW, ArcAbilities
from ui_console.model.events import AbilitiesKnown, Asked, CommandRefused
from ui_console.session.teleoperation import Teleoperation

HARDWARE = [Resource("scout1", "scout", is_robot=True), Resource("rover1", "rover", is_robot=True)]


def arc_kind(name: str, body: str) -> TypeCount:
    """Return a kind of ARC whose body moves; the RC declares no limits."""
    move = CommandForm("move", moves=True, roles=[body])
    able = Abilities(body=body, commands=[move])
    return TypeCount(ComponentType(name, "x:Y", Subsystem.RESOURCE_POOL, needs={body: body}, abilities=able), 0)


class Mission:
    """Two robots, each with a kind of ARC, and a console without a kind."""

    def __init__(self, network: Any, robot: str, *, answers: bool = True, kind: str = "") -> None:
        self.placer = FakePlacer(network, VirtualClock(), {})
        self.asked: list[type[Message]] = []
        self.shown: list[Any] = []
        if answers:
            self.serve(COMPONENT_DATABASE, ListTypes, Types([arc_kind("wheels", "rover"), arc_kind("legs", "scout")]))
            self.serve(DEPENDENCY_DATABASE, AskResources, Resources(HARDWARE))
        parameters = {"robot": robot, "priority": 100, "kind": kind}
        launch = Launch("local", Subsystem.UI_CONSOLE, "console-7", "console", "x:Y", "local", "", 0.0, 1.0, parameters)
        bus = network.join(launch.address, self.placer.clock)
        self.console = Teleoperation(launch, bus, self.placer.clock, show=self.shown.append, watches=False)

    @property
    def known(self) -> list[ArcAbilities | None]:
        """What was shown as the operator's abilities, in order."""
        return [one.abilities for one in self.shown if isinstance(one, AbilitiesKnown)]

    def serve(self, at: str, question: type[Message], reply: Message) -> None:
        async def answer(asked: Envelope[Message]) -> Message:
            self.asked.append(type(asked.body))
            return reply

        bus = self.placer.network.join(at, self.placer.clock)
        bus.serve(at, question, answer)
        bus.declare_alive(at)


def test_each_robot_is_claimed_with_a_kind_that_has_it(local_mission: Any, beside: Any) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1")
            async with beside(mission.console):
                await mission.placer.wait(lambda: "console-7-wheels" in mission.placer.arcs)
                await mission.console.switch("scout1")
                await mission.placer.wait(lambda: "console-7-legs" in mission.placer.arcs)
                assert mission.placer.arcs["console-7-legs"].parameters["wish"] == {"robot": "scout1"}
            await mission.placer.close()

    run_virtual(scene())


def test_a_release_while_the_kind_is_sought_claims_nothing(local_mission: Any, beside: Any) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1", answers=False)
            async with beside(mission.console):
                await mission.placer.clock.sleep_s(1.0)
                await mission.console.give_back()
                await mission.placer.clock.sleep_s(30.0)
                assert not mission.placer.arcs
            await mission.placer.close()

    run_virtual(scene())


def test_a_claim_whose_parameters_change_while_the_kind_is_sought_is_made_with_the_new_ones(
    local_mission: Any, beside: Any
) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1", answers=False)
            async with beside(mission.console):
                await mission.placer.clock.sleep_s(1.0)
                mission.console.change_parameters({"priority": 7})
                mission.serve(COMPONENT_DATABASE, ListTypes, Types([arc_kind("wheels", "rover")]))
                mission.serve(DEPENDENCY_DATABASE, AskResources, Resources(HARDWARE))
                await mission.placer.wait(lambda: mission.placer.arcs)
                assert mission.placer.arcs["console-7-wheels"].parameters["path"] == [["console-7", 7]]
            await mission.placer.close()

    run_virtual(scene())


def test_without_an_answer_the_claim_is_refused_with_a_remedy_and_can_be_repeated(
    local_mission: Any, beside: Any
) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1", answers=False)
            async with beside(mission.console):
                await mission.placer.wait(lambda: mission.console.refusal)
                [refused] = [one for one in mission.shown if isinstance(one, CommandRefused)]
                assert (refused.code, refused.ends_claim) == ("console.no_arc_kind", True)
                assert "status" in refused.remedy
                mission.serve(COMPONENT_DATABASE, ListTypes, Types([arc_kind("wheels", "rover")]))
                mission.serve(DEPENDENCY_DATABASE, AskResources, Resources(HARDWARE))
                mission.console.take()
                await mission.placer.wait(lambda: mission.placer.arcs)
            await mission.placer.close()

    run_virtual(scene())


def test_a_console_asks_once_for_each_take_and_knows_the_abilities_before_the_grant(
    local_mission: Any, beside: Any
) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1")
            async with beside(mission.console):
                await mission.placer.wait(lambda: mission.placer.arcs)
                assert mission.known == [ArcAbilities(SLOW, False, [])]
                assert sorted(kind.__name__ for kind in mission.asked) == ["AskResources", "ListTypes"]
                await mission.console.give_back()
                mission.console.take()
                await mission.placer.wait(lambda: mission.placer.arcs and len(mission.known) == 3)
                assert None not in mission.known, "the last answer counts until the next one is there"
                assert mission.asked.count(ListTypes) == 2
            await mission.placer.close()

    run_virtual(scene())


@pytest.mark.parametrize("answers", [True, False])
def test_with_a_kind_given_the_claim_waits_for_no_database(local_mission: Any, beside: Any, answers: bool) -> None:
    async def scene() -> None:
        async with local_mission("local") as network:
            mission = Mission(network, "rover1", answers=answers, kind="wheels")
            async with beside(mission.console):
                await mission.placer.wait(lambda: "console-7-wheels" in mission.placer.arcs, within_s=0.5)
                await mission.placer.clock.sleep_s(30.0)
                assert mission.known == [None, ArcAbilities(SLOW, False, [])][: 1 + answers]
                assert len([one for one in mission.shown if isinstance(one, Asked)]) == 1
                assert not mission.console.refusal
            await mission.placer.close()

    run_virtual(scene())
