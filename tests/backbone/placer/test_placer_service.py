"""The placer among a nameserver, a component database and creators that run their components in this process."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import msgspec
import pytest

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import (
    Absence,
    AskState,
    AskStatistics,
    AskStory,
    ComponentState,
    LifeState,
    NameTaken,
    Statistics,
    Story,
)
from backbone.component_database.messages import ComponentType, Multiplicity, MultiplicityExceeded, UnknownType
from backbone.component_database.service import ComponentDatabase
from backbone.creator.messages import (
    CUT_OFF_ENDS_WITHIN_S,
    CreatorQuestion,
    EndedBy,
    EndProcess,
    HostLoad,
    ListProcesses,
    NotHere,
    ProcessEnded,
    Processes,
    ProcessState,
    ReviseSpawn,
    Spawn,
    Spawned,
    SpawnRevised,
    StartFailed,
)
from backbone.errors import ReplyTimeout
from backbone.keys import Conversation
from backbone.nameserver.service import Nameserver
from backbone.naming import IllegalName, Subsystem
from backbone.placer.messages import (
    AskPlacement,
    CreatorSilent,
    Ended,
    ListPlacements,
    NoHost,
    NotPlaced,
    Placement,
    Placements,
    ReviseStart,
    Start,
    Started,
    StartRevised,
    StopComponent,
    StoppedMeanwhile,
)
from backbone.placer.service import COMPARE_EVERY_S, Placer
from backbone.wire import Envelope, Message

TYPES = [
    ComponentType("watcher", "x:Y", Subsystem.MISSION_CONTROL),
    ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL, tags=["serial"]),
    ComponentType("world", "x:Y", Subsystem.RESOURCE_POOL, Multiplicity.ONE),
    ComponentType("arc", "x:Y", Subsystem.RESOURCE_POOL, restart=False),
]


class Child(Component[NoParameters]):
    """What the creators of these tests start."""


class FakeCreator(Component[NoParameters]):
    """Runs components in this process; what it does wrong is set from outside."""

    accepts = CreatorQuestion

    def __init__(self, launch: Launch, bus: LocalBus, clock: VirtualClock, tags: list[str]) -> None:
        super().__init__(launch, bus, clock)
        self.network, self.tags = bus.network, tags
        self.spawn_s, self.end_s = 0.1, 0.0
        self.answers_spawn = self.answers_list = True
        self.fails: list[str] = []
        self.spawns: list[str] = []
        self.lives: dict[str, tuple[Spawn, Child, asyncio.Task[None]]] = {}

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case Spawn() as order:
                return await self.spawn(order)
            case ReviseSpawn(name=name, parameters=parameters):
                order, *life = self.lives[name]
                self.lives[name] = (msgspec.structs.replace(order, parameters=parameters), *life)
                return SpawnRevised()
            case EndProcess(name=name):
                if name not in self.lives:
                    raise NotHere(f"no {name} here")
                await self.clock.sleep_s(self.end_s)
                await self.kill_child(name)
                return ProcessEnded(name, EndedBy.ASKING, 0)
            case ListProcesses() if self.answers_list:
                listed = [ProcessState(order, 7, 0, "") for order, _, _ in self.lives.values()]
                return Processes(self.launch.host, self.tags, listed)
            case _:
                await asyncio.Event().wait()
                raise AssertionError("waits for ever")

    async def spawn(self, order: Spawn) -> Spawned:
        self.spawns.append(order.name)
        await self.clock.sleep_s(self.spawn_s)
        if order.name in self.fails:
            self.fails.remove(order.name)
            raise StartFailed(f"{order.name} did not become ready")
        launch = Launch(
            "local", order.subsystem, order.name, order.type, "x:Y", self.launch.host, "", 0.0, 1.0, {}, order.requester
        )
        child = Child(launch, self.network.join(launch.address, VirtualClock()), VirtualClock())
        self.lives[order.name] = (order, child, asyncio.create_task(child.run(), name=f"life of {order.name}"))
        await self.clock.sleep_s(0.01)
        if not self.answers_spawn:
            await asyncio.Event().wait()
        return Spawned(launch.address, 7)

    async def kill_child(self, name: str) -> None:
        _, child, life = self.lives.pop(name)
        child.end("killed")
        await life

    def tell_load(self, cpu: float = 0.0, cores: int = 2) -> None:
        load = HostLoad(self.launch.host, self.tags, cpu, 0.1, cores, len(self.lives))
        self.bus.publish(self.address, Conversation.TELEMETRY, load)

    async def drain(self) -> None:
        for name in list(self.lives):
            await self.kill_child(name)


class Mission:
    """Core services and creators on one network, each of which can be killed and begun again."""

    def __init__(self) -> None:
        self.network = LocalNetwork()
        self.clock = VirtualClock()
        self.bus = self.network.join("backbone/boss", self.clock)
        self.creators: dict[str, FakeCreator] = {}
        self._lives: dict[str, tuple[Component[Any], asyncio.Task[None]]] = {}

    async def begin(self, kind: type[Component[Any]], name: str, host: str = "a", **more: Any) -> Component[Any]:
        type_name = "creator" if kind is FakeCreator else name
        parameters = more.pop("parameters", {})
        launch = Launch("local", Subsystem.BACKBONE, name, type_name, "x:Y", host, "", 0.0, 1.0, parameters)
        component = kind(launch, self.network.join(launch.address, self.clock), self.clock, **more)
        self._lives[name] = (component, asyncio.create_task(component.run(), name=f"life of {name}"))
        await self.clock.sleep_s(0.01)
        return component

    async def begin_creator(self, host: str, *tags: str) -> FakeCreator:
        creator = await self.begin(FakeCreator, f"creator-{host}", host, tags=list(tags))
        assert isinstance(creator, FakeCreator)
        self.creators[host] = creator
        return creator

    async def kill(self, name: str) -> None:
        component, life = self._lives.pop(name)
        component.end("killed")
        await life

    async def crash(self, name: str) -> None:
        """End it as SIGKILL would: its tokens fall before anything else happens."""
        await self._lives[name][0].bus.close()
        await self.kill(name)

    def cut_off(self, host: str) -> None:
        """Let the creator's token fall, as a cut link does; the creator and what it runs live on."""
        for token in list(self.network.tokens[f"backbone/creator-{host}"]):
            token.close()

    def reconnect(self, host: str) -> None:
        """Let the token rise again."""
        creator = self.creators[host]
        creator.bus.declare_alive(creator.address)

    async def kill_all(self) -> None:
        for name in ["placer", *[f"creator-{host}" for host in self.creators], "component_database", "nameserver"]:
            if name in self._lives:
                await self.kill(name)
        await self.bus.close()

    async def start(self, kind: str, name: str = "", host: str = "", within_s: float = 600.0, **more: Any) -> Started:
        return await self.bus.ask(PLACER, Start(kind, name, host=host, **more), Started, within_s=within_s)

    async def stop(self, name: str) -> Ended:
        return await self.bus.ask(PLACER, StopComponent(name), Ended, within_s=30.0)

    async def placements(self) -> dict[str, str]:
        listed = await self.bus.ask(PLACER, ListPlacements(), Placements, within_s=1.0)
        return {placement.name: placement.host for placement in listed.placements}

    async def absent(self) -> list[Absence]:
        return (await self.bus.ask(PLACER, AskState(), ComponentState, within_s=1.0)).absent

    async def story(self, name: str) -> list[str]:
        return [event.what for event in (await self.bus.ask(PLACER, AskStory(name), Story, within_s=1.0)).events]


@asynccontextmanager
async def mission(*hosts: str) -> AsyncIterator[Mission]:
    one = Mission()
    async with AsyncExitStack() as ends:
        ends.push_async_callback(one.kill_all)
        await one.begin(Nameserver, "nameserver")
        types = [msgspec.to_builtins(component_type) for component_type in TYPES]
        await one.begin(ComponentDatabase, "component_database", parameters={"types": types})
        await one.begin(Placer, "placer")
        for host in hosts:
            await one.begin_creator(host, "serial")
        await one.clock.sleep_s(1.5)
        yield one


def on(*hosts: str) -> Callable[[Callable[[Mission], Awaitable[None]]], Callable[[], None]]:
    """Run the test in a mission with these hosts, on virtual time."""

    def wrap(test: Callable[[Mission], Awaitable[None]]) -> Callable[[], None]:
        def test_on_virtual_time() -> None:
            async def main() -> None:
                async with mission(*hosts) as one:
                    await test(one)

            run_virtual(main())

        test_on_virtual_time.__name__ = test.__name__
        return test_on_virtual_time

    return wrap


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
