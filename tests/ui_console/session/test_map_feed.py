"""The map's feed hears localizers, asks silent ones, and asks the simulated world where there is none."""

from __future__ import annotations

import gc
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from msgspec.structs import replace

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import ComponentState, LifeState
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Disappeared
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from resource_pool.arc_client import AskFloorPlan, AskPose, FloorPlan, Pose, PoseSource
from ui_console.model.console import ConsoleModel
from ui_console.session.map_feed import AGAIN_S, QUIET_S, MapFeed
from ui_console.session.observer import Observer

Scene = Callable[["Stage"], Awaitable[None]]
PLAN = FloorPlan(6.0, 4.0)


class Robot(Component[Any]):
    """Is there."""

    is_robot = True


class Localizer(Component[Any]):
    """Knows one robot, and the plan unless told otherwise."""

    accepts = AskPose | AskFloorPlan
    source = PoseSource.TRACKING

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.x_m, self.plans = 1.0, 0
        self.asked: list[str] = []

    def pose(self) -> Pose:
        return Pose("scout1", self.clock.now_s(), self.x_m, 1.0, 0.0, self.source)

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case AskPose(body=body):
                self.asked.append(body)
                if body != "scout1":
                    raise Refusal(f"no body is named {body}")
                return self.pose()
            case AskFloorPlan():
                self.plans += 1
                return PLAN
        return await super().answer(asked)


class World(Localizer):
    """Knows no plan."""

    accepts = AskPose
    source = PoseSource.SIMULATOR


class Stage:
    """A mission with places, and an observer with a map."""

    def __init__(self, network: Any, beside: Any) -> None:
        self.network, self.beside, self.clock = network, beside, VirtualClock()
        self.model = ConsoleModel("console-1", "anna")

    def make(self, kind: type[Component[Any]], name: str, type_name: str, **more: Any) -> Any:
        subsystem = Subsystem.UI_CONSOLE if kind is Observer else Subsystem.RESOURCE_POOL
        launch = Launch(
            "local", subsystem, name, type_name, "x:Y", "local", "", 0.0, 1.0, requester="backbone/launcher"
        )
        return kind(launch, self.network.join(launch.address, self.clock), self.clock, **more)

    def observer(self) -> Any:
        made = self.make(Observer, "console-1", "console", show=self.model.apply, user="anna", has_map=True)
        made.map.watch(True)
        return made

    @property
    def source(self) -> str:
        """Of the place of scout1; empty: it has none."""
        return "".join(one.source for one in self.model.team.map.views(self.clock.now_s()) if one.name == "scout1")

    async def until(self, condition: Callable[[], Any], within_s: float = 10.0) -> None:
        deadline_s = self.clock.now_s() + within_s
        while not condition():
            assert self.clock.now_s() < deadline_s, "in time"
            await self.clock.sleep_s(0.01)


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission() as network:
                await scene(Stage(network, beside))

        run_virtual(main())

    return run


def test_where_no_localizer_is_the_world_is_asked_while_somebody_looks(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        world = on.make(World, "world", "simulated_world")
        async with on.beside(on.make(Robot, "scout1", "scout")), on.beside(world), on.beside(on.observer()) as watcher:
            await on.until(lambda: on.source == "from the simulator")
            world.x_m = 2.5
            await on.until(lambda: on.model.team.map.views(0.0)[0].x_m == 2.5, within_s=1.0)
            assert on.model.team.map.floor == FloorPlan(3.0, 2.0), "it told no plan"
            watcher.map.watch(False)
            await on.clock.sleep_s(1.0)
            before = len(world.asked)
            await on.clock.sleep_s(5.0)
            assert len(world.asked) == before

    stage(scene)


def test_a_localizer_is_heard_in_place_of_the_world_and_asked_once_it_is_silent(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        world, localizer = on.make(World, "world", "simulated_world"), on.make(Localizer, "eye", "localizer")
        robots = [on.make(Robot, name, "scout") for name in ("scout1", "scout2")]
        async with (
            on.beside(world),
            on.beside(localizer),
            on.beside(robots[0]),
            on.beside(robots[1]),
            on.beside(on.observer()),
        ):
            await on.until(lambda: on.source == "tracked from above")
            await on.until(lambda: on.model.team.map.floor == PLAN)
            for _turn in range(20):
                localizer.x_m += 0.1
                localizer.bus.publish(localizer.address, Conversation.POSES, localizer.pose())
                await on.clock.sleep_s(0.1)
            assert on.model.team.map.views(0.0)[0].x_m == pytest.approx(localizer.x_m)
            localizer.asked.clear()
            await on.clock.sleep_s(4 * QUIET_S + AGAIN_S)
            assert 4 <= localizer.asked.count("scout1") <= 4 + AGAIN_S / QUIET_S
            assert localizer.asked.count("scout2") <= 2, "it does not know that one"
            assert localizer.plans == 1
            assert world.asked == []
            assert not on.model.team.map.views(on.clock.now_s())[0].is_stale, "it stands"

    stage(scene)


def test_a_component_whose_last_state_comes_after_its_disappearance_is_not_kept() -> None:
    async def main() -> None:
        clock = VirtualClock()
        feed = MapFeed(LocalNetwork("map").join("ui_console/web-1", clock), clock, lambda _event: None)
        for number in range(20):
            state = ComponentState(f"ui_console/left-late-{number}", "console", "base", number, LifeState.READY, 0.0)
            for said in (state, Disappeared(state.address), replace(state, state=LifeState.STOPPED)):
                feed.heard(said)
        assert not [one for one in gc.get_objects() if issubclass(type(one), dict) and "ui_console/left-late-7" in one]

    run_virtual(main())
