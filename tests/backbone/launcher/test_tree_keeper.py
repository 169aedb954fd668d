"""The keeper of the tree among a placer, an RC manager and behaviors, in one process on virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import Parameters, SetParameter, WrongParameter
from backbone.creator.messages import EndedBy
from backbone.launcher.messages import (
    AddBranch,
    BranchTaken,
    MoveBranch,
    RemoveBranch,
    ReplaceBranch,
    SetInTree,
    TakeBranch,
    TreeChangedMeanwhile,
    TreeInvalid,
)
from backbone.launcher.tree_changes import orders
from backbone.launcher.tree_keeper import ENDS_WITHIN_S, TreeKeeper
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from backbone.placer.messages import Ended, NoHost, NotPlaced, ReviseStart, Start, StartRevised, StopComponent
from backbone.rc_manager.messages import AskAttributes, Done, SetPriority
from backbone.scheduling.requests import UnknownRequest
from backbone.wire import Envelope

MISSION = b"""<mission name="m" priority="10">
  <behaviors>
    <behavior type="surveillance" name="day" priority="3">
      <behavior type="wait" name="morning" priority="1"><parameter name="seconds" value="1"/></behavior>
      <behavior type="surveillance" name="noon" priority="1"/>
    </behavior>
    <behavior type="surveillance" name="spare" priority="1"/>
  </behaviors>
</mission>
"""
NEW = '<behavior type="surveillance" name="new" priority="4"/>'
USER = "ui_console/cli-1"


class Scene:
    """All that is told to anyone, in order."""

    def __init__(self, network: LocalNetwork) -> None:
        self.network, self.clock = network, VirtualClock()
        self.told: list[tuple[Any, ...]] = []
        self.revised: dict[str, tuple[dict[str, Any], bool]] = {}
        self.silent: set[str] = set()
        self.refused: dict[str, Exception] = {}
        self.tokens: dict[str, Any] = {}
        bus = network.join("backbone/launcher", self.clock)
        placer, rc_manager = network.join(PLACER, self.clock), network.join(RC_MANAGER, self.clock)
        placer.serve(PLACER, ReviseStart | StopComponent, self.place)
        rc_manager.serve(RC_MANAGER, SetPriority | AskAttributes, self.schedule)
        self._tasks: set[asyncio.Task[None]] = set()
        self.keeper = TreeKeeper(
            bus,
            self.clock,
            read_mission_bytes(MISSION, "m.xml"),
            MISSION,
            begin_root=self.begin_root,
            leave_root=self.leave_root,
            begin=self.begin,
            note=lambda *_: None,
        )
        self.keeper.watch()
        for name in ("day", "morning", "noon", "spare"):
            self.run(name)

    def begin(self, work: Any, name: str) -> None:
        self._tasks.add(asyncio.create_task(work, name=name))

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def run(self, name: str) -> None:
        """Let a behavior appear."""
        bus = self.network.join(f"mission_control/{name}", self.clock)
        bus.serve(bus.source, TakeBranch | SetParameter, self.behave)
        self.tokens[name] = bus.declare_alive(bus.source)

    async def behave(self, asked: Envelope[Any]) -> Any:
        match asked.body:
            case TakeBranch(version=version, place=place, anew=anew):
                own = place["path"][-1][0]
                while own in self.silent:
                    await self.clock.sleep_s(1.0)
                self.told.append(("take", own, version, [child["name"] for child in place["children"]], list(anew)))
                return BranchTaken()
            case SetParameter(name=name, value=value):
                if name in self.refused:
                    raise self.refused[name]
                self.told.append(("set", name, value))
                return Parameters({name: value})

    async def place(self, asked: Envelope[Any]) -> Any:
        match asked.body:
            case ReviseStart(name=name, parameters=parameters, others_stay=others_stay):
                self.told.append(("revise", name))
                self.revised[name] = parameters, others_stay
                return StartRevised()
            case StopComponent(name=name):
                if name not in self.tokens:
                    raise NotPlaced(name)
                self.told.append(("stop", name))
                return Ended(name, EndedBy.ASKING)

    async def schedule(self, asked: Envelope[Any]) -> Any:
        match asked.body:
            case SetPriority(node=node, priority=priority):
                self.told.append(("priority", node, priority))
                return Done()
            case _:
                raise UnknownRequest("nobody asks")

    async def begin_root(self, order: Start, *, insists: bool) -> None:
        if order.name in self.refused and not insists:
            raise self.refused[order.name]
        self.told.append(("want" if insists else "begin", order.name))

    async def leave_root(self, name: str) -> None:
        self.told.append(("leave", name))

    async def change(self, change: Any) -> list[str]:
        self.told.clear()
        return list((await self.keeper.change(change, USER)).remarks)


@pytest.fixture
def scene(local_mission: Any) -> Callable[[Callable[[Scene], Awaitable[None]]], None]:
    @asynccontextmanager
    async def opened() -> AsyncIterator[Scene]:
        async with local_mission() as network:
            made = Scene(network)
            await made.clock.sleep_s(0.1)
            try:
                yield made
            finally:
                await made.close()

    def run(body: Callable[[Scene], Awaitable[None]]) -> None:
        async def main() -> None:
            async with opened() as made:
                await body(made)

        run_virtual(main())

    return run


Play = Callable[[Callable[[Scene], Awaitable[None]]], None]


def test_orders_are_revised_first_and_those_that_lose_hear_of_it_before_those_that_gain(scene: Play) -> None:
    async def body(one: Scene) -> None:
        assert await one.change(MoveBranch(0, "noon", "spare")) == []
        assert one.told == [
            ("revise", "day"),
            ("revise", "spare"),
            ("take", "day", 1, ["morning"], []),
            ("stop", "noon"),
            ("take", "spare", 1, ["noon"], []),
        ]

    scene(body)


def test_of_two_changes_of_one_version_the_second_is_refused(scene: Play) -> None:
    async def body(one: Scene) -> None:
        both = [one.keeper.change(RemoveBranch(0, name), USER) for name in ("noon", "morning")]
        first, second = await asyncio.gather(*both, return_exceptions=True)
        assert first.version == one.keeper.version == 1
        assert isinstance(second, TreeChangedMeanwhile)
        assert b"morning" in one.keeper.text

    scene(body)


def test_a_refused_change_tells_nobody_and_leaves_the_text(scene: Play) -> None:
    async def body(one: Scene) -> None:
        one.refused = {"seconds": WrongParameter("not now"), "new": NoHost("nowhere")}
        for change, refusal in (
            (AddBranch(0, "m", "<behavior/>", "b.xml"), TreeInvalid),
            (SetInTree(0, "morning", "seconds", -1), TreeInvalid),
            (SetInTree(0, "morning", "seconds", 5), WrongParameter),
        ):
            with pytest.raises(refusal):
                await one.change(change)
            assert one.told == []
        with pytest.raises(NoHost):
            await one.change(AddBranch(0, "m", NEW, "b.xml"))
        assert (one.keeper.version, one.keeper.text) == (0, MISSION)

    scene(body)


def test_a_parent_that_is_away_hears_of_its_children_when_it_is_back(scene: Play) -> None:
    async def body(one: Scene) -> None:
        one.tokens["day"].close()
        await one.clock.sleep_s(0.1)
        assert await one.change(ReplaceBranch(0, "noon", NEW.replace("new", "noon"), "b.xml")) == []
        assert [each for each in one.told if each[0] == "take"] == []
        one.run("day")
        await one.clock.sleep_s(1.0)
        assert one.told[-1] == ("take", "day", 1, ["morning", "noon"], ["noon"])
        await one.change(RemoveBranch(1, "noon"))
        assert ("take", "day", 2, ["morning"], []) in one.told

    scene(body)


def test_a_parent_that_does_not_answer_holds_nobody_up_for_long(scene: Play) -> None:
    async def body(one: Scene) -> None:
        one.silent.add("day")
        began_s = one.clock.now_s()
        [remark] = await one.change(RemoveBranch(0, "noon"))
        assert "day does not answer" in remark
        assert one.clock.now_s() - began_s < ENDS_WITHIN_S + 5.0
        assert ("stop", "noon") in one.told
        one.silent.clear()
        await one.clock.sleep_s(ENDS_WITHIN_S + 5.0)
        assert one.told[-1] == ("take", "day", 1, ["morning"], [])

    scene(body)


def test_a_value_goes_to_who_uses_it(scene: Play) -> None:
    async def body(one: Scene) -> None:
        await one.change(SetInTree(0, "morning", "seconds", 5))
        assert one.told[0] == ("set", "seconds", 5)
        assert {each[1] for each in one.told if each[0] == "revise"} == {"day", "morning"}
        await one.change(SetInTree(1, "day", "priority", -2))
        assert ("priority", "day", -2) in one.told
        assert {each[1] for each in one.told if each[0] == "revise"} == {"day", "morning", "noon"}

    scene(body)


def test_only_what_the_tree_changes_is_revised_because_the_class_may_be_an_exchanged_one(scene: Play) -> None:
    async def body(one: Scene) -> None:
        await one.change(SetInTree(0, "morning", "priority", 2))
        place = {"path": [["m", 10], ["day", 3], ["morning", 2]], "arc": None, "children": []}
        assert one.revised["morning"] == (place, True)
        await one.change(SetInTree(1, "morning", "seconds", 5))
        assert one.revised["morning"] == (place | {"seconds": 5}, True)

    scene(body)


def test_a_root_that_takes_anothers_place_is_wanted_though_its_start_is_refused(scene: Play) -> None:
    async def body(one: Scene) -> None:
        one.refused["new"] = NoHost("nowhere")
        await one.change(ReplaceBranch(0, "spare", NEW, "b.xml"))
        assert one.told == [("leave", "spare"), ("stop", "spare"), ("priority", "new", 4), ("want", "new")]

    scene(body)


def test_however_many_starts_ask_for_the_newest_order_each_tree_is_read_once(
    scene: Play, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []

    def counted(mission: MissionDescription) -> dict[str, Start]:
        read.append(len(read))
        return orders(mission)

    monkeypatch.setattr("backbone.launcher.tree_keeper.orders", counted)

    async def body(one: Scene) -> None:
        old = Start("surveillance", "spare", {})
        for _ in range(100):
            assert one.keeper.newest(old).parameters["children"] == []
            assert one.keeper.newest(Start("scout", "scout1", {})) == Start("scout", "scout1", {})
        assert len(read) == 1
        await one.change(MoveBranch(0, "noon", "spare"))
        for _ in range(100):
            assert [child["name"] for child in one.keeper.newest(old).parameters["children"]] == ["noon"]
        assert len(read) == 2

    scene(body)
