"""An RC started in a running mission can be claimed at once, one stopped there is gone; restarts lose neither."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rc_manager_at_work import HARDWARE, PlainArc, PlainRc, Pool, request
from trace_checker import check

from backbone.addresses import DEPENDENCY_DATABASE, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component
from backbone.component.messages import AskStory, Story
from backbone.dependency_database.messages import FindRcs, NoSuchHardware, RcSets, Resource
from backbone.dependency_database.service import COMPARE_EVERY_S, DependencyDatabase
from backbone.naming import Subsystem
from backbone.placer.messages import AskPlacement, NotPlaced, Placement
from backbone.rc_manager.hardware import Hardware
from backbone.rc_manager.messages import AskSchedule, AskUtilization
from backbone.scheduling.requests import RcUse, RequestState, UnknownRc
from backbone.scheduling.views import Schedule, Utilization
from backbone.wire import Envelope, Message

A_MOMENT_S = 0.1
THIRD = Resource("third", "scout")


class PlainPlacer(Component[Any]):
    """Has what it was given."""

    accepts = AskPlacement

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.placed: dict[str, str] = {}

    async def answer(self, asked: Envelope[Any]) -> Message:
        name = asked.body.name
        if name not in self.placed:
            raise NotPlaced(f"{name!r} was not placed", name=name, stopped=False)
        return Placement(name, self.placed[name], "field", "ui_console/cli-1", 0.0, [])


@dataclass
class Mission:
    """A pool, and services of it that can be ended."""

    pool: Pool
    placer: PlainPlacer
    beside: Any
    lives: dict[str, AsyncExitStack] = field(default_factory=dict)

    @property
    def bus(self) -> Any:
        return self.pool.network.join("ui_console/asker", self.pool.clock)

    async def begin(self, name: str) -> None:
        self.lives[name] = AsyncExitStack()
        await self.lives[name].enter_async_context(self.beside(getattr(self, f"_{name}")()))

    async def end(self, name: str) -> None:
        await self.lives.pop(name).aclose()

    async def start(self, resource: Resource = THIRD) -> PlainRc:
        """Start an RC by hand: the placer has it, then it is ready."""
        self.placer.placed[resource.name] = resource.type
        return await self.pool.rc(resource)

    async def stop(self, rc: PlainRc) -> None:
        self.placer.placed.pop(rc.name, None)
        rc.end("by command")
        await self.pool.clock.sleep_s(A_MOMENT_S)

    async def rcs(self) -> dict[str, str]:
        schedule = await self.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
        return {rc.rc: rc.state for rc in schedule.rcs}

    async def find(self, name: str) -> list[dict[str, str]]:
        found = await self.bus.ask(
            DEPENDENCY_DATABASE, FindRcs({"scout": "scout"}, {"scout": name}), RcSets, within_s=1
        )
        return found.sets

    async def story(self, at: str, of: str) -> list[str]:
        return [event.what for event in (await self.bus.ask(at, AskStory(of), Story, within_s=1)).events]

    def _database(self) -> Component[Any]:
        resources = [msgspec.to_builtins(resource) for resource in HARDWARE]
        name = "dependency_database"
        launch = self.pool.launch(Subsystem.BACKBONE, name, name, {"resources": resources, "kinds": ["lamp"]})
        return DependencyDatabase(launch, self.pool.network.join(launch.address, self.pool.clock), self.pool.clock)

    def _manager(self) -> Component[Any]:
        return self.pool.manager()


Begin = Callable[[], AbstractAsyncContextManager[Mission]]


@pytest.fixture
def mission(local_mission: Any, beside: Any, tmp_path: Path) -> Begin:
    @asynccontextmanager
    async def begun() -> AsyncIterator[Mission]:
        clock = VirtualClock()
        async with local_mission() as network, AsyncExitStack() as stack:
            pool = Pool(network, clock, beside, stack, tmp_path / "trace.jsonl")
            launch = pool.launch(Subsystem.BACKBONE, "placer", "placer")
            placer = PlainPlacer(launch, network.join(launch.address, clock), clock)
            await stack.enter_async_context(beside(placer))
            here = Mission(pool, placer, beside)
            for resource in HARDWARE:
                await pool.rc(resource)
            await here.begin("database")
            await here.begin("manager")
            yield here
            for name in [*here.lives]:
                await here.end(name)
            assert [check(lines) for lines in sections(pool.trace)] == [[]] * len(sections(pool.trace))

    return begun


def sections(trace: Path) -> list[list[dict[str, Any]]]:
    """Return the lines of each RC manager's trace."""
    found: list[list[dict[str, Any]]] = []
    for line in map(json.loads, trace.read_text(encoding="utf-8").splitlines()):
        if line["ev"] == "meta":
            found.append([])
        found[-1].append(line)
    return found


async def claimed(here: Mission, *rcs: str) -> PlainArc:
    arc = await here.pool.arc("one")
    await arc.ask_for(request("one", *rcs))
    return arc


def test_an_rc_that_is_started_by_hand_can_be_found_and_claimed_at_once(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            await here.start()
            assert await here.find("third") == [{"scout": "third"}]
            arc = await claimed(here, "third", "radio")
            await here.pool.clock.sleep_s(A_MOMENT_S)
            assert arc.is_open
            assert (await here.rcs())["third"] == "up"
            used = await here.bus.ask(RC_MANAGER, AskUtilization(), Utilization, within_s=1)
            assert {one.rc: one.minute > 0 for one in used.rcs} == {
                "left": False, "right": False, "video": False, "radio": True, "third": True
            }  # fmt: skip

    run_virtual(main())


def test_it_is_in_the_schedule_before_a_claim(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            assert "third" not in await here.rcs()
            await here.start()
            await here.pool.clock.sleep_s(A_MOMENT_S)
            assert (await here.rcs())["third"] == "up"
            assert "can be claimed: a scout on field, started by hand" in await here.story(DEPENDENCY_DATABASE, "third")

    run_virtual(main())


def test_an_rc_of_a_kind_without_a_resource_in_the_mission_file_is_taken_in_too(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            await here.start(Resource("lamp1", "lamp"))
            await here.start(Resource("thing1", "thing"))
            await here.pool.clock.sleep_s(A_MOMENT_S)
            assert {"lamp1", "thing1"} & (await here.rcs()).keys() == {"lamp1"}

    run_virtual(main())


def test_a_component_that_the_placer_did_not_start_is_not_taken_in(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            await here.pool.rc(THIRD)
            await here.pool.clock.sleep_s(2 * COMPARE_EVERY_S)
            assert "third" not in await here.rcs()
            with pytest.raises(NoSuchHardware):
                await here.find("third")
            with pytest.raises(UnknownRc):
                await claimed(here, "third")
            refused = [what for what in await here.story(DEPENDENCY_DATABASE, "third") if "cannot be claimed" in what]
            assert refused == ["cannot be claimed: 'third' was not placed"]

    run_virtual(main())


def test_a_component_that_calls_itself_of_another_type_is_not_taken_in(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            here.placer.placed["third"] = "command_radio"
            await here.pool.rc(THIRD)
            await here.pool.clock.sleep_s(1.0)
            assert "third" not in await here.rcs()

    run_virtual(main())


def test_an_rc_that_is_stopped_is_gone(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            await here.pool.clock.sleep_s(A_MOMENT_S)
            await here.stop(third)
            assert "third" not in await here.rcs()
            with pytest.raises(NoSuchHardware):
                await here.find("third")
            with pytest.raises(UnknownRc):
                await claimed(here, "third")
            again = await here.start()
            arc = await here.pool.arc("two")
            await arc.ask_for(request("two", "third"))
            await here.pool.clock.sleep_s(A_MOMENT_S)
            assert arc.is_open
            assert set(again.holders) == {"two"}

    run_virtual(main())


def test_an_rc_that_is_stopped_while_it_is_held_is_gone_once_no_request_names_it(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            arc = await claimed(here, "third", "radio")
            await here.pool.clock.sleep_s(1.0)
            assert arc.is_open
            await here.stop(third)
            await here.pool.clock.sleep_s(1.0)
            assert not arc.is_open
            assert (await here.rcs())["third"] == "down"
            with pytest.raises(UnknownRc, match="was removed"):
                await (await here.pool.arc("two")).ask_for(request("two", "third"))
            arc.end("its owner has left")
            await here.pool.clock.sleep_s(1.0)
            assert "third" not in await here.rcs()

    run_virtual(main())


def test_an_rc_that_only_died_is_down_and_comes_back(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            arc = await claimed(here, "third")
            await here.pool.clock.sleep_s(1.0)
            third.end("it is killed")
            await here.pool.clock.sleep_s(2 * COMPARE_EVERY_S)
            assert (await here.rcs())["third"] == "down"
            assert not arc.is_open
            third = PlainRc(third.launch, here.pool.network.join(third.address, here.pool.clock), here.pool.clock)
            third.last_epoch = 100
            async with here.beside(third):
                await here.pool.clock.sleep_s(1.0)
                assert arc.is_open

    run_virtual(main())


@pytest.mark.parametrize("killed", [("database",), ("manager",), ("manager", "database"), ("database", "manager")])
def test_restarts_lose_neither_the_rc_nor_its_holder(mission: Begin, killed: tuple[str, ...]) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            arc = await claimed(here, "third", "radio")
            await here.pool.clock.sleep_s(1.0)
            for name in killed:
                await here.end(name)
            async with asyncio.TaskGroup() as starting:
                for name in reversed(killed):
                    starting.create_task(here.begin(name))
                    await here.pool.clock.sleep_s(0.05)
            await here.pool.clock.sleep_s(1.0)
            assert (await here.rcs())["third"] == "up"
            assert arc.is_open
            assert third.log == [("connect", "one")], "the holder was not disturbed"
            assert arc.log[-1][0] == "open"
            assert await here.find("third") == [{"scout": "third"}]

    run_virtual(main())


def test_an_rc_that_is_stopped_while_the_databases_are_away_is_gone_when_they_are_back(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            arc = await claimed(here, "third")
            await here.pool.clock.sleep_s(1.0)
            await here.end("database")
            await here.stop(third)
            await here.end("manager")
            await here.begin("database")
            await here.begin("manager")
            await here.pool.clock.sleep_s(2.0)
            assert "third" not in await here.rcs()
            assert not arc.is_open
            schedule = await here.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
            assert [one for one in schedule.requests if one.state is RequestState.RUNNING] == []

    run_virtual(main())


def test_an_arc_whose_rc_was_removed_while_the_rc_manager_was_away_gets_another_of_its_sets(mission: Begin) -> None:
    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            arc = await here.pool.arc("one")
            either = [{"third": RcUse()}, {"left": RcUse()}]
            await arc.ask_for(msgspec.structs.replace(request("one", "third"), alternatives=either))
            await here.pool.clock.sleep_s(1.0)
            assert set(arc.epochs) == {"third"}
            await here.end("manager")
            await here.stop(third)
            await here.begin("manager")
            await here.pool.clock.sleep_s(2.0)
            assert set(arc.epochs) == {"left"}

    run_virtual(main())


def test_lost_news_of_a_new_rc_is_found_at_a_claim_and_of_a_removed_one_in_time(
    mission: Begin, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Hardware, "_heard_change", lambda _hardware, _lost: None)

    async def main() -> None:
        async with mission() as here:
            third = await here.start()
            await here.pool.clock.sleep_s(1.0)
            assert "third" not in await here.rcs()
            arc = await claimed(here, "third")
            await here.pool.clock.sleep_s(A_MOMENT_S)
            assert arc.is_open
            arc.end("its owner has left")
            await here.stop(third)
            assert (await here.rcs())["third"] == "down"
            await here.pool.clock.sleep_s(COMPARE_EVERY_S)
            assert "third" not in await here.rcs()

    run_virtual(main())
