"""The creator's conversations, on virtual time."""

from __future__ import annotations

import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import msgspec
import pytest
from in_process_zygote import InProcessZygote

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.component.launch import Launch
from backbone.component.messages import AskParameters, ComponentState, SetParameter
from backbone.component.messages import Parameters as ParametersAnswer
from backbone.component_database.messages import ComponentType
from backbone.creator.messages import (
    AlreadyHere,
    AskLoad,
    EndedBy,
    EndProcess,
    FixedTypes,
    HostLoad,
    ListProcesses,
    NotHere,
    NotThePlacer,
    ProcessEnded,
    Processes,
    ProcessFell,
    RestartPolicy,
    ReviseSpawn,
    Spawn,
    Spawned,
    SpawnRevised,
    StartFailed,
    UnlistedType,
)
from backbone.creator.service import Creator
from backbone.keys import Conversation
from backbone.nameserver.messages import Resolve, Resolved
from backbone.naming import IllegalName, Subsystem

CREATOR = "backbone/creator-lab"
KINDS = ("Quiet", "Stubborn", "Late", "Leaver", "Failing", "Broken", "Forker", "Weighted")
TYPES = [ComponentType(kind.lower(), f"in_process_zygote:{kind}", Subsystem.RESOURCE_POOL) for kind in KINDS]
TYPES += [ComponentType("rc_manager", "backbone.rc_manager.service:RcManager", Subsystem.BACKBONE, core=True)]


@dataclass
class Host:
    """A host with a creator, seen by the placer and by a stranger."""

    zygote: InProcessZygote
    placer: Bus
    stranger: Bus
    loads: list[HostLoad] = field(default_factory=list)
    fell: list[ProcessFell] = field(default_factory=list)

    async def spawn(self, spawn: Spawn) -> Spawned:
        return await self.placer.ask(CREATOR, spawn, Spawned, within_s=30.0)

    async def end(self, name: str) -> ProcessEnded:
        return await self.placer.ask(CREATOR, EndProcess(name, "over"), ProcessEnded, within_s=5.0)

    async def processes(self) -> Processes:
        return await self.stranger.ask(CREATOR, ListProcesses(), Processes, within_s=1.0)


def order(kind: str, name: str, **more: Any) -> Spawn:
    policy = RestartPolicy(back_off_s=0.1, limit=1)
    given = {"policy": policy, "ready_within_s": 5.0, "requester": "ui_console/operator", **more}
    usual = Spawn(Subsystem.RESOURCE_POOL, name, kind.lower(), f"in_process_zygote:{kind}")
    return msgspec.structs.replace(usual, **given)


@pytest.fixture
def on_host(local_mission: Callable, beside: Callable) -> Callable[[Callable[[Host], Awaitable[None]]], None]:
    @asynccontextmanager
    async def host() -> AsyncIterator[Host]:
        async with local_mission() as network:
            clock = VirtualClock()
            launch = Launch(
                "local",
                Subsystem.BACKBONE,
                "creator-lab",
                "creator",
                "backbone.creator.service:Creator",
                "lab",
                "",
                0.0,
                1.0,
                {"tags": ["radio"], "preload": [], "types": [msgspec.to_builtins(one) for one in TYPES]},
            )
            it = Host(InProcessZygote(network), network.join(PLACER, clock), network.join("ui_console/x", clock))
            it.stranger.subscribe(CREATOR, Conversation.TELEMETRY, HostLoad, lambda heard: it.loads.append(heard.body))
            it.stranger.subscribe(CREATOR, Conversation.EVENTS, ProcessFell, lambda heard: it.fell.append(heard.body))
            async with beside(Creator(launch, network.join(launch.address, clock), clock, it.zygote)):
                yield it
            assert not it.zygote.lives, "a creator left something behind"
            await it.placer.close()
            await it.stranger.close()

    def run(body: Callable[[Host], Awaitable[None]]) -> None:
        async def main() -> None:
            async with host() as it:
                await body(it)

        run_virtual(main())

    return run


def test_a_spawned_component_is_ready_and_registered_with_host_and_requester(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        spawned = await host.spawn(order("Quiet", "scout1"))
        assert spawned == Spawned("resource_pool/scout1", next(iter(host.zygote.lives)))
        state: ComponentState = (
            await host.stranger.ask(NAMESERVER, Resolve("scout1"), Resolved, within_s=1.0)
        ).component
        assert (state.host, state.requester, state.type) == ("lab", "ui_console/operator", "quiet")

    on_host(body)


def test_the_list_shows_the_orders_as_they_were_given(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        asked = order("Quiet", "scout1", pinned=True, tags=["radio"])
        await host.spawn(asked)
        listing = await host.processes()
        assert (listing.host, listing.tags) == ("lab", ["radio"])
        assert [process.spawn for process in listing.processes] == [asked]

    on_host(body)


def test_only_the_placer_starts_and_ends_processes(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.spawn(order("Quiet", "scout1"))
        with pytest.raises(NotThePlacer):
            await host.stranger.ask(CREATOR, order("Quiet", "scout2"), Spawned, within_s=1.0)
        with pytest.raises(NotThePlacer):
            await host.stranger.ask(CREATOR, EndProcess("scout1"), ProcessEnded, within_s=1.0)
        assert len(host.zygote.lives) == 1

    on_host(body)


def test_the_same_order_twice_starts_one_process_and_another_of_that_name_is_refused(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        first = await host.spawn(order("Quiet", "scout1"))
        assert await host.spawn(order("Quiet", "scout1")) == first
        assert await host.spawn(order("Quiet", "scout1", order_id="of another placer")) == first
        with pytest.raises(AlreadyHere):
            await host.spawn(order("Quiet", "scout1", requester="ui_console/other"))
        assert host.zygote.forked == ["scout1"]

    on_host(body)


def test_a_failed_start_is_refused_with_what_is_known(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        with pytest.raises(StartFailed, match="broken: exit code 1"):
            await host.spawn(order("Broken", "broken"))
        assert (await host.processes()).processes == []

    on_host(body)


def test_ending_answers_when_it_is_gone_and_an_unknown_name_is_refused(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.spawn(order("Quiet", "scout1"))
        assert await host.end("scout1") == ProcessEnded("scout1", EndedBy.ASKING, 0)
        assert not host.zygote.lives
        with pytest.raises(NotHere):
            await host.end("scout1")

    on_host(body)


def test_a_fall_is_published_with_what_follows(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.spawn(order("Quiet", "scout1"))
        for _ in range(2):
            host.zygote.kill(next(iter(host.zygote.lives)), signal.SIGKILL)
            await VirtualClock().sleep_s(0.5)
        assert [(fell.name, fell.how, fell.restart_in_s) for fell in host.fell] == [
            ("scout1", "killed by SIGKILL", 0.1),
            ("scout1", "killed by SIGKILL", RestartPolicy().failing_pause_s),
        ]
        assert host.fell[1].failing

    on_host(body)


def test_a_revised_order_is_the_one_that_is_restarted(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.spawn(order("Weighted", "scout1", parameters={"weight": 1}))
        await host.placer.ask(CREATOR, ReviseSpawn("scout1", {"weight": 2}), SpawnRevised, within_s=1.0)
        [first] = host.zygote.lives.values()
        assert first.parameters.weight == 1
        assert (await host.processes()).processes[0].spawn.parameters == {"weight": 2}
        host.zygote.kill(next(iter(host.zygote.lives)), signal.SIGKILL)
        await VirtualClock().sleep_s(1.0)
        [second] = host.zygote.lives.values()
        assert second is not first
        assert second.parameters.weight == 2
        with pytest.raises(NotHere):
            await host.placer.ask(CREATOR, ReviseSpawn("scout2", {}), SpawnRevised, within_s=1.0)
        with pytest.raises(NotThePlacer):
            await host.stranger.ask(CREATOR, ReviseSpawn("scout1", {}), SpawnRevised, within_s=1.0)

    on_host(body)


def test_a_member_of_a_shared_process_begins_anew_with_its_revised_order(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.spawn(order("Weighted", "scout1", parameters={"weight": 1}, process="hardware"))
        await host.placer.ask(CREATOR, ReviseSpawn("scout1", {"weight": 2}), SpawnRevised, within_s=1.0)
        host.zygote.kill(next(iter(host.zygote.lives)), signal.SIGKILL)
        await VirtualClock().sleep_s(2.0)
        now = await host.stranger.ask("resource_pool/scout1", AskParameters(), ParametersAnswer, within_s=1.0)
        assert now.values == {"weight": 2}

    on_host(body)


def test_the_load_is_published_each_second_and_when_processes_change(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await VirtualClock().sleep_s(3.5)
        assert len(host.loads) == 4
        host.loads.clear()
        await host.spawn(order("Quiet", "scout1"))
        await VirtualClock().sleep_s(0.01)
        assert host.loads[-1].components == 1
        await host.end("scout1")
        await VirtualClock().sleep_s(0.01)
        assert host.loads[-1].components == 0
        load = host.loads[-1]
        assert (load.host, load.tags) == ("lab", ["radio"])
        assert 0.0 <= load.cpu <= 1.0
        assert 0.0 < load.memory <= 1.0
        assert load.cores >= 1
        assert await host.stranger.ask(CREATOR, AskLoad(), HostLoad, within_s=1.0) == load

    on_host(body)


def test_new_tags_are_told_at_once(on_host: Callable) -> None:
    async def body(host: Host) -> None:
        await host.stranger.ask(CREATOR, SetParameter("tags", ["camera"]), ParametersAnswer, within_s=1.0)
        await VirtualClock().sleep_s(0.01)
        assert host.loads[-1].tags == ["camera"]

    on_host(body)


def test_orders_survive_the_wire() -> None:
    asked = order("Quiet", "scout1", parameters={"speed": 1.5, "names": ["a"]})
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(asked), type=Spawn) == asked


UNLISTED = {
    "a class of no type": order("Quiet", "scout1", class_path="os:system"),
    "the class of another type": order("Quiet", "scout1", class_path="in_process_zygote:Late"),
    "a type that the mission lacks": order("Quiet", "scout1", type="stranger"),
    "another subsystem": order("Quiet", "scout1", subsystem=Subsystem.BACKBONE),
    "a core service": Spawn(
        Subsystem.BACKBONE,
        "rc_manager-2",
        "rc_manager",
        "backbone.rc_manager.service:RcManager",
        {"mission": "m", "trace": "/etc/cron.d/scout"},
    ),
}


@pytest.mark.parametrize("asked", UNLISTED.values(), ids=UNLISTED)
def test_a_creator_runs_no_class_but_those_of_the_missions_types(on_host: Callable, asked: Spawn) -> None:
    async def body(host: Host) -> None:
        with pytest.raises(UnlistedType):
            await host.spawn(asked)
        assert (await host.processes()).processes == []

    on_host(body)


@pytest.mark.parametrize("name", ["../../../etc/scout1", "scout1/../..", "", "Scout1", "s" * 200, "a\nb"])
@pytest.mark.parametrize("field", ["name", "process"])
def test_a_creator_runs_nothing_under_an_illegal_name(on_host: Callable, field: str, name: str) -> None:
    async def body(host: Host) -> None:
        asked = msgspec.structs.replace(order("Quiet", "scout1"), **{field: name})
        if field == "process" and not name:  # a process of its own
            return
        with pytest.raises(IllegalName):
            await host.spawn(asked)
        assert (await host.processes()).processes == []

    on_host(body)


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("types", [msgspec.to_builtins(ComponentType("quiet", "os:system", Subsystem.RESOURCE_POOL))]),
        ("preload", ["antigravity"]),
    ],
)
def test_nobody_changes_what_a_creator_may_run(on_host: Callable, parameter: str, value: Any) -> None:
    async def body(host: Host) -> None:
        with pytest.raises(FixedTypes):
            await host.placer.ask(CREATOR, SetParameter(parameter, value), ParametersAnswer, within_s=1.0)

    on_host(body)
