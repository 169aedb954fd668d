"""What ran on a host that is lost or silent runs elsewhere, once, also past a restart of placer or nameserver."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from placer_at_work import Mission, on

from backbone.addresses import PLACER
from backbone.creator.messages import (
    CUT_OFF_ENDS_WITHIN_S,
    EndedBy,
)
from backbone.errors import ReplyTimeout
from backbone.nameserver.service import Nameserver
from backbone.placer.creators import ANSWER_WITHIN_S
from backbone.placer.messages import (
    AskPlacement,
    CreatorSilent,
    Ended,
    NoHost,
    NotPlaced,
    Placement,
    ReviseStart,
    StartRevised,
)
from backbone.placer.service import Placer


@pytest.mark.parametrize("how", ["crash", "kill"])
def test_a_lost_hosts_components_run_elsewhere_with_the_same_order(how: str) -> None:
    @on("a", "b")
    async def lose_a_host(one: Mission) -> None:
        await lose_host_a(one, one.crash if how == "crash" else one.kill)

    lose_a_host()


async def lose_host_a(one: Mission, end: Callable[[str], Awaitable[None]]) -> None:
    await one.start("watcher", "w", parameters={"weight": 0.5})
    await one.start("arc", "arc1", host="a")
    await one.start("scout", "scout1", host="a")
    assert await one.placements() == {"w": "a", "arc1": "a", "scout1": "a"}
    await end("creator-a")
    await one.clock.sleep_s(3.0)
    assert await one.placements() == {"w": "b", "scout1": ""}
    order, _, _ = one.creators["b"].lives["w"]
    assert (order.parameters, order.requester) == ({"weight": 0.5}, "backbone/boss")
    await one.begin_creator("a", "serial")
    await one.clock.sleep_s(3.0)
    assert await one.placements() == {"w": "b", "scout1": "a"}
    assert one.creators["a"].spawns == ["scout1"]


@on("a", "b")
async def test_what_a_silent_host_may_still_run_is_started_elsewhere_only_when_it_cannot(one: Mission) -> None:
    """A host that is cut off runs on for some seconds; a second copy beside it is never started."""
    await one.start("watcher", "w1", host="")
    await one.start("watcher", "w2", host="")
    assert await one.placements() == {"w1": "a", "w2": "b"}
    one.cut_off("b")
    await one.clock.sleep_s(CUT_OFF_ENDS_WITHIN_S - 1.0)
    assert one.creators["a"].spawns == ["w1"]
    assert (await one.absent())[0].doing == "waits until the silent host has ended it"
    await one.creators["b"].kill_child("w2")
    await one.clock.sleep_s(2.0)
    assert one.creators["a"].spawns == ["w1", "w2"]


@on("a", "b")
async def test_a_restarted_placer_starts_nothing_that_a_silent_host_may_still_run(one: Mission) -> None:
    """The placer ends after the link of a host is cut, and before that host has ended what it runs."""
    await one.start("watcher", "w1")
    await one.start("watcher", "w2")
    assert await one.placements() == {"w1": "a", "w2": "b"}
    one.cut_off("b")
    await one.clock.sleep_s(1.0)
    await one.kill("placer")
    await one.begin(Placer, "placer")
    starting = asyncio.create_task(one.start("watcher", "w2"))
    await one.clock.sleep_s(CUT_OFF_ENDS_WITHIN_S - 1.0)
    assert one.creators["a"].spawns == ["w1"]
    await one.creators["b"].kill_child("w2")
    assert (await starting).host == "a"


@on("a", "b")
async def test_a_host_that_returns_to_a_restarted_placer_keeps_what_it_runs(one: Mission) -> None:
    await one.start("watcher", "w1")
    await one.start("watcher", "w2")
    one.cut_off("b")
    await one.kill("placer")
    await one.begin(Placer, "placer")
    starting = asyncio.create_task(one.start("watcher", "w2"))
    await one.clock.sleep_s(2.0)
    one.reconnect("b")
    assert (await starting).host == "b"
    began_s = one.clock.now_s()
    assert (await one.start("watcher", "w3")).host in ("a", "b")
    assert one.clock.now_s() - began_s < 1.0, "all hosts are back: a start waits for none"
    assert sorted(one.creators["a"].spawns + one.creators["b"].spawns) == ["w1", "w2", "w3"]


@on("a", "b")
async def test_hub_and_placer_that_fall_together_start_nothing_twice(one: Mission) -> None:
    await one.start("watcher", "w1")
    await one.start("watcher", "w2")
    for name in ("nameserver", "placer"):
        await one.kill(name)
    one.cut_off("b")
    await one.begin(Nameserver, "nameserver")
    await one.begin(Placer, "placer")
    starting = asyncio.create_task(one.start("watcher", "w2"))
    await one.clock.sleep_s(0.8)
    one.reconnect("b")
    assert (await starting).host == "b"
    assert one.creators["a"].spawns == ["w1"]


@on("a", "b")
async def test_a_stop_is_confirmed_only_when_a_silent_host_cannot_run_it_any_more(one: Mission) -> None:
    await one.start("watcher", "w", host="b")
    one.cut_off("b")
    stopping = asyncio.create_task(one.stop("w"))
    await one.clock.sleep_s(CUT_OFF_ENDS_WITHIN_S - 1.0)
    assert not stopping.done()
    await one.creators["b"].kill_child("w")
    assert (await stopping).by is EndedBy.ITSELF
    assert await one.placements() == {}


@on("a", "b")
async def test_what_is_stopped_while_its_host_is_cut_off_is_ended_there_before_the_stop_is_confirmed(
    one: Mission,
) -> None:
    await one.start("watcher", "w", host="b")
    one.cut_off("b")
    stopping = asyncio.create_task(one.stop("w"))
    await one.clock.sleep_s(3.0)
    assert not stopping.done()
    one.reconnect("b")
    await stopping
    assert one.creators["b"].lives == {}
    assert await one.placements() == {}


@on("a", "b")
async def test_a_start_on_a_host_that_fell_silent_is_repeated_elsewhere_only_when_it_cannot_run(one: Mission) -> None:
    await one.start("watcher", "w0", host="a")
    one.creators["b"].spawn_s = 2.0
    starting = asyncio.create_task(one.start("watcher", "w", host=""))
    await one.clock.sleep_s(0.5)
    assert one.creators["b"].spawns == ["w"]
    one.cut_off("b")
    one.creators["b"].answers_spawn = False
    await one.clock.sleep_s(CUT_OFF_ENDS_WITHIN_S - 1.5)
    assert "w" not in one.creators["a"].spawns
    one.reconnect("b")
    assert (await starting).host == "b"
    assert "w" not in one.creators["a"].spawns


@on("a", "b")
async def test_a_host_that_is_back_before_that_keeps_what_it_runs(one: Mission) -> None:
    await one.start("watcher", "w1", host="")
    await one.start("watcher", "w2", host="")
    one.cut_off("b")
    await one.clock.sleep_s(4.0)
    one.reconnect("b")
    await one.clock.sleep_s(10.0)
    assert await one.placements() == {"w1": "a", "w2": "b"}
    assert one.creators["a"].spawns + one.creators["b"].spawns == ["w1", "w2"]


@on("a")
async def test_on_a_single_host_everything_comes_back_with_its_creator(one: Mission) -> None:
    for name in ("w1", "w2"):
        await one.start("watcher", name)
    await one.crash("creator-a")
    await one.clock.sleep_s(20.0)
    assert await one.placements() == {"w1": "", "w2": ""}
    await one.begin_creator("a")
    await one.clock.sleep_s(1.0)
    assert await one.placements() == {"w1": "a", "w2": "a"}
    assert sorted(one.creators["a"].spawns) == ["w1", "w2"]


@on("a")
async def test_a_lost_component_that_fails_to_start_is_tried_again_until_it_runs(one: Mission) -> None:
    for name in ("w1", "w2"):
        await one.start("watcher", name)
    await one.kill("creator-a")
    creator = await one.begin_creator("a")
    creator.fails = ["w1", *["w2"] * 10]
    await one.clock.sleep_s(20.0)
    assert list(creator.lives) == ["w1"]
    absence = (await one.absent())[0]
    assert (absence.name, absence.doing) == ("w2", "is being placed again")
    assert "did not become ready" in absence.cause
    creator.fails = []
    await one.clock.sleep_s(10.0)
    assert sorted(creator.lives) == ["w1", "w2"]
    assert await one.absent() == []


@on("a", "b")
async def test_a_start_whose_creator_dies_is_carried_out_elsewhere(one: Mission) -> None:
    one.creators["a"].spawn_s = 2.0
    starting = asyncio.create_task(one.start("watcher", "w"))
    await one.clock.sleep_s(1.0)
    await one.crash("creator-a")
    assert (await starting).host == "b"
    assert await one.placements() == {"w": "b"}


@on("a")
async def test_a_start_without_any_living_creator_waits_for_one_that_is_being_restarted(one: Mission) -> None:
    await one.kill("creator-a")
    starting = asyncio.create_task(one.start("scout", "scout1", host="a"))
    await one.clock.sleep_s(1.0)
    await one.begin_creator("a", "serial")
    assert (await starting).host == "a"


@on("a")
async def test_a_start_is_refused_when_no_creator_comes_back(one: Mission) -> None:
    await one.kill("creator-a")
    began_s = one.clock.now_s()
    with pytest.raises(NoHost, match="a: its creator is gone"):
        await one.start("scout", "scout1", host="a")
    assert 4.0 < one.clock.now_s() - began_s < 6.0


@on("a")
async def test_an_order_whose_answer_was_lost_is_not_repeated(one: Mission) -> None:
    one.creators["a"].answers_spawn = False
    assert (await one.start("watcher", "w")).host == "a"
    assert one.creators["a"].spawns == ["w"]


@on("a")
async def test_an_order_that_was_not_carried_out_is_refused_as_such(one: Mission) -> None:
    one.creators["a"].spawn_s = 1000.0
    with pytest.raises(CreatorSilent, match="it does not run on a") as silent:
        await one.start("watcher", "w")
    assert silent.value.facts["outcome"] == "not_running"
    assert await one.placements() == {}


@on("a")
async def test_the_outcome_is_called_unknown_when_nobody_tells_and_settled_when_somebody_does(one: Mission) -> None:
    creator = one.creators["a"]
    creator.answers_spawn = creator.answers_list = False
    with pytest.raises(CreatorSilent) as silent:
        await one.start("watcher", "w")
    assert silent.value.facts["outcome"] == "unknown"
    assert await one.placements() == {"w": "a"}
    await creator.kill_child("w")
    creator.answers_list = True
    creator.tell_load()
    await one.clock.sleep_s(20.0)
    creator.tell_load()
    creator.answers_spawn = True
    await one.clock.sleep_s(5.0)
    assert await one.placements() == {"w": "a"}
    assert creator.spawns == ["w", "w"]


@on("a", "b")
async def test_a_restarted_placer_knows_what_runs_and_for_whom(one: Mission) -> None:
    await one.start("scout", "scout1", host="b")
    await one.start("watcher")
    await one.kill("placer")
    await one.begin(Placer, "placer")
    assert await one.placements() == {"scout1": "b", "watcher-1": "a"}
    placed = await one.bus.ask(PLACER, AskPlacement("scout1"), Placement, within_s=1.0)
    assert (placed.requester, placed.type) == ("backbone/boss", "scout")
    assert (await one.start("watcher")).address == "mission_control/watcher-2"
    await one.kill("creator-b")
    await one.clock.sleep_s(10.0)
    assert (await one.placements())["scout1"] == ""
    assert await one.stop("watcher-1") == Ended("watcher-1", EndedBy.ASKING)


@on("a", "b")
async def test_what_runs_on_a_host_that_a_restarted_placer_meets_late_runs_on(one: Mission) -> None:
    """Its owner misses it, and has asked for it again, before the creator has listed it."""
    await one.start("scout", "scout1", host="b")
    creator = one.creators["b"]
    alive = creator.lives["scout1"]
    creator.answers_list = False
    await one.kill("placer")
    await one.begin(Placer, "placer")
    await one.clock.sleep_s(ANSWER_WITHIN_S + 1.5)
    starting = asyncio.create_task(one.start("scout", "scout1", host="b"))
    await one.clock.sleep_s(0.5)
    assert not starting.done()
    creator.answers_list = True
    assert (await starting).host == "b"
    await one.clock.sleep_s(3.0)
    assert creator.lives == {"scout1": alive}
    assert creator.spawns == ["scout1"]


@on("a", "b")
async def test_a_revised_order_is_the_one_that_counts_from_the_next_start_on(one: Mission) -> None:
    await one.start("watcher", "w", host="", parameters={"weight": 0.5})
    await one.bus.ask(PLACER, ReviseStart("w", {"weight": 0.75}), StartRevised, within_s=5.0)
    assert one.creators["a"].spawns == ["w"], "it runs on"
    await one.kill("placer")
    await one.begin(Placer, "placer")
    await one.crash("creator-a")
    await one.clock.sleep_s(10.0)
    assert one.creators["b"].lives["w"][0].parameters == {"weight": 0.75}
    with pytest.raises(NotPlaced):
        await one.bus.ask(PLACER, ReviseStart("v", {}), StartRevised, within_s=5.0)


@pytest.mark.parametrize("restarted", [False, True])
def test_an_exchanged_class_runs_on_and_one_that_is_placed_anew_has_the_mission_files(restarted: bool) -> None:
    """No creator starts a class that the mission file does not name, and another host may not have it."""

    @on("a", "b")
    async def scene(one: Mission) -> None:
        await one.start("watcher", "w", host="", parameters={"weight": 0.5, "path": ["m"]})
        exchanged = ReviseStart("w", {"gain": 2, "path": ["m"]}, "other:Class")
        for revised in (exchanged, ReviseStart("w", {"path": ["n"]}, others_stay=True)):
            await one.bus.ask(PLACER, revised, StartRevised, within_s=5.0)
        kept = one.creators["a"].lives["w"][0]
        assert (kept.class_path, kept.parameters) == ("other:Class", {"gain": 2, "path": ["n"]})
        if restarted:
            await one.kill("placer")
            await one.begin(Placer, "placer")
            await one.clock.sleep_s(1.0)
        await one.crash("creator-a")
        await one.clock.sleep_s(10.0)
        anew = one.creators["b"].lives["w"][0]
        assert (anew.class_path, anew.parameters) == ("x:Y", {"weight": 0.5, "path": ["n"]})

    scene()


@on("a", "b")
async def test_a_restarted_nameserver_moves_nothing(one: Mission) -> None:
    await one.start("watcher", "w1")
    await one.start("watcher", "w2")
    await one.kill("nameserver")
    await one.begin(Nameserver, "nameserver")
    await one.clock.sleep_s(5.0)
    assert await one.placements() == {"w1": "a", "w2": "b"}
    assert one.creators["a"].spawns + one.creators["b"].spawns == ["w1", "w2"]


@on("a", "b")
async def test_a_creator_that_died_while_the_nameserver_was_down_is_missed(one: Mission) -> None:
    await one.start("watcher", "w1")
    await one.kill("nameserver")
    await one.kill("creator-a")
    await one.begin(Nameserver, "nameserver")
    await one.clock.sleep_s(10.0)
    assert await one.placements() == {"w1": "b"}


@on("a")
async def test_a_placer_that_cannot_reach_the_component_database_says_so(one: Mission) -> None:
    await one.kill("component_database")
    with pytest.raises(NoHost, match="the component database does not admit it"):
        await one.start("watcher", "w")
    with pytest.raises(ReplyTimeout):
        await one.start("watcher", "w", within_s=0.5)
    await one.clock.sleep_s(10.0)
