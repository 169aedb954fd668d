"""The placer starts, stops and forgets components, and says why."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any

import msgspec
import pytest
from placer_at_work import FakeCreator, Mission, on

from backbone.addresses import PLACER
from backbone.component.messages import (
    AskStatistics,
    LifeState,
    NameTaken,
    Statistics,
)
from backbone.component_database.messages import MultiplicityExceeded, UnknownType
from backbone.creator.messages import (
    EndedBy,
    StartFailed,
)
from backbone.keys import Conversation
from backbone.naming import IllegalName
from backbone.placer.bring_up import CREATOR_BACK_S
from backbone.placer.messages import (
    AskPlacement,
    Ended,
    ListPlacements,
    NoHost,
    NotPlaced,
    Placement,
    Placements,
    Start,
    Started,
    StoppedMeanwhile,
)
from backbone.placer.service import COMPARE_EVERY_S


@on("a", "b", "c")
async def test_twelve_started_at_once_get_twelve_names_and_four_on_each_host(one: Mission) -> None:
    started = await asyncio.gather(*(one.start("watcher") for _ in range(12)))
    assert Counter(placed.host for placed in started) == {"a": 4, "b": 4, "c": 4}
    assert {placed.address for placed in started} == {f"mission_control/watcher-{n}" for n in range(1, 13)}
    assert all(len(placed.reasons) == 3 for placed in started)


@on("a", "b")
async def test_a_loaded_host_gets_fewer(one: Mission) -> None:
    one.creators["a"].tell_load(cpu=0.9)
    one.creators["b"].tell_load(cpu=0.0)
    await one.clock.sleep_s(0.1)
    assert {(await one.start("watcher")).host for _ in range(4)} == {"b"}


@on("a", "b")
async def test_a_start_that_a_leaving_creator_gives_up_goes_to_another_host(one: Mission) -> None:
    """A creator that drains also ends components that are starting there; that is no fault of these components."""
    leaving = one.creators["a"]
    leaving.spawn_s, leaving.fails = 0.5, ["watcher-1"]
    one.creators["b"].tell_load(cpu=0.9)
    await one.clock.sleep_s(0.1)
    starting = asyncio.create_task(one.start("watcher"))
    await one.clock.sleep_s(0.2)
    assert leaving.spawns == ["watcher-1"]
    state = msgspec.structs.replace(leaving.component_state(), state=LifeState.DRAINING)
    leaving.bus.publish(leaving.address, Conversation.STATUS, state)
    assert (await starting).host == "b"


@on("a", "b")
async def test_a_placement_tells_who_wanted_it_and_why_it_is_there(one: Mission) -> None:
    await one.start("scout", "scout1", host="b")
    placed = await one.bus.ask(PLACER, AskPlacement("scout1"), Placement, within_s=1.0)
    assert (placed.host, placed.type, placed.requester) == ("b", "scout", "backbone/boss")
    assert placed.reasons[0] == "a: not b, which was asked for"
    assert placed.reasons[1].startswith("b: chosen, asked for")
    assert (await one.story("scout1"))[-1] == "is ready on b, pid 7"


@on("a")
async def test_refusals_name_the_fault_and_leave_nothing_behind(one: Mission) -> None:
    with pytest.raises(NoHost, match="a: lacks gl"):
        await one.start("watcher", tags=["gl"])
    with pytest.raises(NoHost, match="b is no host"):
        await one.start("watcher", host="b")
    with pytest.raises(UnknownType, match="did you mean 'watcher'"):
        await one.start("wather")
    with pytest.raises(IllegalName):
        await one.start("watcher", "Not Legal")
    one.creators["a"].fails = ["w"]
    with pytest.raises(StartFailed):
        await one.start("watcher", "w")
    with pytest.raises(NotPlaced):
        await one.stop("w")
    assert await one.placements() == {}
    assert (await one.start("watcher", "w")).host == "a"
    counted = await one.bus.ask(PLACER, AskStatistics(), Statistics, within_s=1.0)
    assert (counted.values["starts"], counted.values["starts_refused"]) == (6.0, 5.0)


class SlowCreator(FakeCreator):
    """Is registered some time before it is ready."""

    def __init__(self, *arguments: Any, connects_in_s: float) -> None:
        super().__init__(*arguments, tags=[])
        self.connects_in_s = connects_in_s

    async def connect(self) -> None:
        await self.clock.sleep_s(self.connects_in_s)


@on("a")
async def test_a_start_on_a_host_whose_creator_just_appeared_waits_until_the_placer_has_met_it(one: Mission) -> None:
    one.creators["b"] = await one.begin(SlowCreator, "creator-b", "b", connects_in_s=0.5)
    assert (await one.start("watcher", host="b")).host == "b"


@on("a")
async def test_a_creator_that_does_not_become_ready_is_waited_for_for_a_bounded_time(one: Mission) -> None:
    one.creators["b"] = await one.begin(SlowCreator, "creator-b", "b", connects_in_s=2.0 * CREATOR_BACK_S)
    asked_s = one.clock.now_s()
    with pytest.raises(NoHost, match="b is no host"):
        await one.start("watcher", host="b")
    assert one.clock.now_s() - asked_s < CREATOR_BACK_S + 1.0


@on("a")
async def test_one_name_is_started_once(one: Mission) -> None:
    outcomes = await asyncio.gather(*(one.start("watcher", "w") for _ in range(3)), return_exceptions=True)
    assert [type(outcome) for outcome in outcomes] == [Started, NameTaken, NameTaken]
    assert one.creators["a"].spawns == ["w"]


@on("a", "b")
async def test_a_kind_of_one_started_twice_at_once_runs_once(one: Mission) -> None:
    outcomes = await asyncio.gather(*(one.start("world", name) for name in ("r1", "r2")), return_exceptions=True)
    assert isinstance(outcomes[0], Started)
    assert isinstance(outcomes[1], MultiplicityExceeded)
    assert outcomes[1].facts["name"] == "r1"


@on("a")
async def test_a_stopped_component_is_gone_and_forgotten(one: Mission) -> None:
    await one.start("watcher", "w")
    assert await one.stop("w") == Ended("w", EndedBy.ASKING)
    assert one.creators["a"].lives == {}
    with pytest.raises(NotPlaced):
        await one.stop("w")
    assert (await one.start("watcher", "w")).host == "a"


@on("a")
async def test_a_component_stopped_while_it_starts_does_not_stay(one: Mission) -> None:
    one.creators["a"].spawn_s = 2.0
    starting = asyncio.create_task(one.start("watcher", "w"))
    await one.clock.sleep_s(1.0)
    await one.stop("w")
    assert one.creators["a"].lives == {}
    assert await one.placements() == {}
    with pytest.raises(StoppedMeanwhile):
        await starting


@on("a")
async def test_a_component_that_is_being_stopped_is_placed_no_more(one: Mission) -> None:
    await one.start("watcher", "w")
    one.creators["a"].end_s = 2.0
    stopping = asyncio.create_task(one.stop("w"))
    await one.clock.sleep_s(1.0)
    with pytest.raises(NotPlaced) as refused:
        await one.bus.ask(PLACER, AskPlacement("w"), Placement, within_s=1.0)
    assert refused.value.facts["stopped"] is True
    await stopping


@on("a")
async def test_a_component_stopped_while_it_waits_for_a_host_is_not_placed_again(one: Mission) -> None:
    await one.start("watcher", "w")
    await one.crash("creator-a")
    await one.clock.sleep_s(1.0)
    assert await one.stop("w") == Ended("w", EndedBy.ITSELF)
    creator = await one.begin_creator("a")
    await one.clock.sleep_s(10.0)
    assert creator.spawns == []
    assert await one.placements() == {}


@on("a", "b")
async def test_a_host_that_was_only_cut_off_keeps_what_waited_for_it_and_loses_what_moved(one: Mission) -> None:
    await one.start("scout", "scout1", host="a")
    await one.start("watcher", "w", host="")
    assert await one.placements() == {"scout1": "a", "w": "b"}
    creator = one.creators["a"]
    one.cut_off("a")
    await one.clock.sleep_s(10.0)
    assert await one.placements() == {"scout1": "", "w": "b"}
    one.reconnect("a")
    await one.clock.sleep_s(2.0)
    assert await one.placements() == {"scout1": "a", "w": "b"}
    assert creator.spawns == ["scout1"]


@on("a")
async def test_an_arc_that_ends_by_itself_is_forgotten(one: Mission) -> None:
    await one.start("arc", "arc1")
    await one.creators["a"].kill_child("arc1")
    await one.clock.sleep_s(0.5)
    assert await one.placements() == {}


@on("a")
async def test_a_wanted_component_that_its_creator_does_not_have_is_placed_again(one: Mission) -> None:
    """How it ended makes no difference: only an order to stop ends a wish."""
    await one.start("watcher", "w")
    await one.creators["a"].kill_child("w")
    await one.clock.sleep_s(3.0)
    assert await one.placements() == {"w": "a"}
    assert one.creators["a"].spawns == ["w", "w"]
    assert await one.absent() == []


@on("a", "b")
async def test_what_does_not_start_on_one_host_starts_on_the_other(one: Mission) -> None:
    one.creators["a"].fails = ["w"] * 20
    with pytest.raises(StartFailed, match="on a: w did not become ready"):
        await one.start("watcher", "w")
    assert (await one.start("watcher", "w")).host == "b"
    assert (await one.start("watcher", "v")).host == "b", "a may lack the class, although it has less to do"
    assert one.creators["a"].spawns == ["w"]


@on("b")
async def test_what_is_lost_with_its_host_is_placed_where_it_can_start(one: Mission) -> None:
    await one.start("watcher", "w")
    for host in ("a", "c"):
        await one.begin_creator(host)
    one.creators["a"].fails = ["w"] * 20
    await one.start("watcher", "v", host="c")
    await one.crash("creator-b")
    await one.clock.sleep_s(12.0)
    assert await one.placements() == {"v": "c", "w": "c"}
    assert one.creators["a"].spawns == ["w"]


@on("a", "b")
async def test_a_wait_for_a_creator_is_one_line_of_the_story(one: Mission) -> None:
    """Each load report of another host wakes the wait, and a line for each pushes older events out of the story."""
    await one.start("scout", "scout1", host="a")
    await one.crash("creator-a")
    for _ in range(20):
        one.creators["b"].tell_load()
        await one.clock.sleep_s(0.5)
    waits = [line for line in await one.story("scout1") if line.startswith("waits for a creator")]
    assert waits == ["waits for a creator: no host for scout1: a: its creator is gone; b: not a, which was asked for"]


@on("a")
async def test_what_cannot_be_placed_is_reported_as_absent_with_its_cause(one: Mission) -> None:
    await one.start("watcher", "w")
    await one.crash("creator-a")
    await one.clock.sleep_s(8.0)
    absence = (await one.absent())[0]
    assert (absence.name, absence.cause) == ("w", "was lost with the creator of a")
    assert absence.doing.startswith("waits for a host: no host for w")
    assert one.clock.now_s() - absence.since_s == pytest.approx(8.0, abs=0.5)
    await one.begin_creator("a")
    await one.clock.sleep_s(2.0)
    assert await one.absent() == []


@on("a")
async def test_what_a_component_wanted_ends_with_an_order_to_stop_it(one: Mission) -> None:
    await one.start("watcher", "parent")
    child = one.network.join("mission_control/parent", one.clock)
    await child.ask(PLACER, Start("watcher", "child"), Started, within_s=10.0)
    await one.stop("parent")
    await one.clock.sleep_s(1.0)
    assert await one.placements() == {}
    await child.close()


@on("a")
async def test_what_nobody_wants_any_more_is_ended(one: Mission) -> None:
    """The owner and the placer died at the same moment, and no component restarted the owner."""
    gone = one.network.join("mission_control/gone", one.clock)
    await gone.ask(PLACER, Start("watcher", "child"), Started, within_s=10.0)
    await gone.close()
    await one.clock.sleep_s(3 * COMPARE_EVERY_S)
    assert await one.placements() == {}


@on("a")
async def test_an_order_to_stop_is_remembered_until_the_next_start(one: Mission) -> None:
    await one.start("watcher", "w")
    await one.stop("w")
    with pytest.raises(NotPlaced) as refused:
        await one.bus.ask(PLACER, AskPlacement("w"), Placement, within_s=1.0)
    assert refused.value.facts["stopped"] is True
    listed = await one.bus.ask(PLACER, ListPlacements(), Placements, within_s=1.0)
    assert list(listed.stopped) == ["w"]
    await one.start("watcher", "w")
    assert (await one.bus.ask(PLACER, ListPlacements(), Placements, within_s=1.0)).stopped == {}


@on("a")
async def test_an_order_has_one_id_until_it_is_stopped(one: Mission) -> None:
    """By it a restarted behavior knows that its memory is of the same order."""

    def order_id() -> str:
        return one.creators["a"].lives["w"][0].order_id

    await one.start("watcher", "w")
    first = order_id()
    await one.creators["a"].kill_child("w")
    await one.clock.sleep_s(3.0)
    assert order_id() == first
    await one.stop("w")
    await one.start("watcher", "w")
    assert order_id() not in (first, "")
    await one.stop("w")
    await one.start("watcher", "w", order_id="its owner's")
    assert order_id() == "its owner's"
