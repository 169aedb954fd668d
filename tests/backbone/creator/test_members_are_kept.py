"""The keeper and shared processes on virtual time."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import msgspec
import pytest
from in_process_zygote import InProcessZygote

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.launch import Launch
from backbone.component.membership import (
    AlreadyMember,
    AskedAgain,
    AwaitEnd,
    BeginMember,
    MemberBegun,
    MemberEnded,
    NotAMember,
    NotItsCreator,
    process_address,
)
from backbone.component.messages import AskState, ComponentState, Stop, Stopping
from backbone.component.shared_process import SharedProcess
from backbone.creator.messages import EndedBy, ProcessFell, RestartPolicy, StartFailed
from backbone.creator.process_keeper import ProcessKeeper
from backbone.keys import Conversation
from backbone.naming import Subsystem

POLICY = RestartPolicy(back_off_s=0.1, limit=2, window_s=60.0)
CREATOR = "backbone/tester"


@dataclass
class Bench:
    keeper: ProcessKeeper
    zygote: InProcessZygote
    fell: list[ProcessFell]
    bus: LocalBus
    network: LocalNetwork

    async def start(self, kind: str, name: str, process: str = "pool", within_s: float = 5.0) -> int:
        return await self.keeper.start(launch(kind, name, process), POLICY, within_s)

    def pids(self) -> dict[str, int]:
        return {each.spawn.name: each.pid for each in self.keeper.processes()}

    async def state(self, name: str) -> ComponentState:
        return await self.bus.ask(f"resource_pool/{name}", AskState(), ComponentState, within_s=1.0)


def launch(kind: str, name: str, process: str = "pool") -> Launch:
    path = f"in_process_zygote:{kind}"
    return Launch("local", Subsystem.RESOURCE_POOL, name, kind.lower(), path, "local", "", 0.0, 1.0, process=process)


@pytest.fixture
def on_bench(local_mission: Callable) -> Callable[[Callable[[Bench], Awaitable[None]]], None]:
    """Return a runner of a test's body with a keeper that is closed afterwards."""

    @asynccontextmanager
    async def bench() -> AsyncIterator[Bench]:
        async with local_mission() as network:
            zygote, fell = InProcessZygote(network), []
            keeper = ProcessKeeper(zygote, VirtualClock())
            keeper.on_fell = fell.append
            bus = network.join(CREATOR, VirtualClock())
            keeper.use(bus)
            yield Bench(keeper, zygote, fell, bus, network)
            await keeper.close()
            assert not zygote.lives, "something was left after the keeper's end"
            await bus.close()

    def run(body: Callable[[Bench], Awaitable[None]]) -> None:
        async def main() -> None:
            async with bench() as it:
                await body(it)

        run_virtual(main())

    return run


def now_s() -> float:
    return asyncio.get_running_loop().time()


def test_components_of_one_process_are_started_in_it_and_others_have_their_own(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pids = await asyncio.gather(
            bench.start("Quiet", "scout1"), bench.start("Quiet", "radio"), bench.start("Quiet", "grabber", "")
        )
        assert pids[0] == pids[1] != pids[2]
        assert sorted(bench.zygote.forked) == ["grabber", "pool"]
        assert bench.pids() == {"scout1": pids[0], "radio": pids[0], "grabber": pids[2]}

    on_bench(body)


def test_a_late_comer_joins_the_process_that_is_there(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        first = await bench.start("Quiet", "scout1")
        assert await bench.start("Quiet", "radio") == first
        assert await bench.start("Quiet", "video1", "other") != first
        assert bench.zygote.forked == ["pool", "other"]

    on_bench(body)


def test_ending_one_member_leaves_the_others(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await bench.start("Quiet", "radio")
        assert (await bench.keeper.end("scout1")).by is EndedBy.ASKING
        assert bench.pids() == {"radio": pid}
        assert (await bench.state("radio")).address == "resource_pool/radio"
        assert bench.fell == []

    on_bench(body)


def test_ending_the_last_member_ends_the_process(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        await bench.keeper.end("scout1")
        assert not bench.zygote.lives
        await bench.start("Quiet", "scout1")
        assert bench.zygote.forked == ["pool", "pool"]

    on_bench(body)


def test_a_member_that_leaves_by_itself_is_restarted_in_the_same_process(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await bench.start("Leaver", "watcher")
        await VirtualClock().sleep_s(1.5)
        assert bench.pids() == {"scout1": pid, "watcher": pid}
        assert [(fell.name, fell.how) for fell in bench.fell] == [("watcher", "exit code 0")]

    on_bench(body)


def test_a_member_that_fails_is_restarted_in_the_same_process_and_slowly_from_its_limit_on(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await bench.start("Failing", "radio")
        for restarts in (1, 2):
            bench.bus.publish("resource_pool/radio", Conversation.COMMAND, Stop())
            await VirtualClock().sleep_s(1.0)
            state = bench.keeper.processes()[1]
            assert (state.pid, state.restarts, state.last_end) == (pid, restarts, "exit code 1")
        bench.bus.publish("resource_pool/radio", Conversation.COMMAND, Stop())
        await VirtualClock().sleep_s(1.0)
        assert [(fell.name, fell.restart_in_s, fell.failing) for fell in bench.fell] == [
            ("radio", 0.1, False),
            ("radio", 0.2, False),
            ("radio", POLICY.failing_pause_s, True),
        ]
        assert [absence.name for absence in bench.keeper.absences()] == ["radio"]
        assert bench.keeper.processes()[0].restarts == 0
        assert bench.zygote.forked == ["pool"]

    on_bench(body)


def test_a_killed_process_is_followed_by_one_with_all_its_members(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await bench.start("Quiet", "radio")
        bench.zygote.kill(pid, signal.SIGKILL)
        await VirtualClock().sleep_s(1.0)
        assert bench.zygote.forked == ["pool", "pool"]
        assert set(bench.pids().values()) == {pid + 1}
        assert {fell.name: fell.how for fell in bench.fell} == dict.fromkeys(
            ("scout1", "radio"), "its process pool: killed by SIGKILL"
        )
        for name in ("scout1", "radio"):
            await bench.state(name)

    on_bench(body)


def test_a_terminated_process_is_followed_by_one_with_all_its_members(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await bench.start("Quiet", "radio")
        bench.zygote.kill(pid, signal.SIGTERM)
        await VirtualClock().sleep_s(2.0)
        assert set(bench.pids()) == {"scout1", "radio"}
        assert pid not in bench.pids().values()
        assert {fell.name: fell.how for fell in bench.fell} == dict.fromkeys(("scout1", "radio"), "exit code 0")

    on_bench(body)


def test_killing_a_member_that_hangs_restarts_the_other_members_and_not_it(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        await bench.start("Stubborn", "radio")
        began_s = now_s()
        assert (await bench.keeper.end("radio", "over", 1.5, 0.5)).by is EndedBy.SIGKILL
        assert now_s() - began_s == pytest.approx(2.0, abs=0.01)
        await VirtualClock().sleep_s(1.0)
        assert list(bench.pids()) == ["scout1"]
        assert bench.keeper.processes()[0].restarts == 1
        await bench.state("scout1")

    on_bench(body)


def test_a_member_that_cannot_start_fails_alone(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        with pytest.raises(StartFailed, match="exit code 1"):
            await bench.start("Broken", "radio")
        with pytest.raises(StartFailed, match="exit code 5"):
            await bench.start("Missing", "missing")
        assert bench.pids() == {"scout1": pid}

    on_bench(body)


@pytest.mark.parametrize("hook", ["connect", "serve", "drain"])
def test_a_member_that_leaves_as_a_program_does_fails_alone(on_bench: Callable, hook: str) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        if hook == "connect":
            with pytest.raises(StartFailed, match="exit code 1"):
                await bench.start("Leaving", hook)
        else:
            await bench.start("Leaving", hook)
            await VirtualClock().sleep_s(1.15)
            assert [(fell.name, fell.how) for fell in bench.fell] == [(hook, "exit code 1")]
        assert bench.pids()["scout1"] == pid
        assert bench.zygote.forked == ["pool"]

    on_bench(body)


def test_a_member_that_is_not_ready_in_time_is_ended_alone(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        with pytest.raises(StartFailed, match="not ready"):
            await bench.start("Late", "slow")
        assert bench.pids() == {"scout1": pid}
        assert bench.keeper.processes()[0].restarts == 0

    on_bench(body)


def test_a_component_that_needs_its_own_process_is_refused_in_a_shared_one(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        with pytest.raises(StartFailed, match="exit code 5"):
            await bench.start("Forker", "forker")
        assert not bench.zygote.lives

    on_bench(body)


def test_no_process_at_all_is_told_to_everybody_who_waits_for_it(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        bench.zygote.refuses = "too many processes"
        starts = (bench.start("Quiet", "scout1"), bench.start("Quiet", "radio"))
        for outcome in await asyncio.gather(*starts, return_exceptions=True):
            assert isinstance(outcome, StartFailed)
            assert "too many processes" in outcome.detail

    on_bench(body)


def test_only_its_creator_may_speak_to_a_shared_process(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        at = process_address("local", "pool", await bench.start("Quiet", "scout1"))
        stranger = bench.network.join("ui_console/stranger", VirtualClock())
        with pytest.raises(NotItsCreator):
            await stranger.ask(at, BeginMember(launch("Quiet", "radio"), 99), MemberBegun, within_s=1.0)
        await stranger.close()

    on_bench(body)


def test_admission_may_be_asked_twice_and_a_name_lives_once(local_mission: Callable) -> None:
    async def main() -> None:
        async with local_mission() as network:
            own = Launch(
                "local",
                Subsystem.BACKBONE,
                "pool",
                "shared_process",
                "",
                "local",
                "",
                0.0,
                1.0,
                requester=CREATOR,
                process="pool",
            )
            shared = SharedProcess(own, network.join, VirtualClock(), 7)
            running = asyncio.create_task(shared.run())
            bus = network.join(CREATOR, VirtualClock())
            await VirtualClock().sleep_s(0.1)
            for _ in range(2):
                await bus.ask(shared.address, BeginMember(launch("Quiet", "scout1"), 1), MemberBegun, within_s=1.0)
            with pytest.raises(AlreadyMember):
                await bus.ask(shared.address, BeginMember(launch("Quiet", "scout1"), 2), MemberBegun, within_s=1.0)
            with pytest.raises(NotAMember):
                await bus.ask(shared.address, AwaitEnd(2), MemberEnded, within_s=1.0)
            given_up = asyncio.create_task(bus.ask(shared.address, AwaitEnd(1), MemberEnded, within_s=10.0))
            await VirtualClock().sleep_s(1.0)
            ended = asyncio.create_task(bus.ask(shared.address, AwaitEnd(1), MemberEnded, within_s=10.0))
            with pytest.raises(AskedAgain):  # else each question about a long life would wait in the process for ever
                await given_up
            await VirtualClock().sleep_s(1.0)
            await bus.ask("resource_pool/scout1", Stop("over"), Stopping, within_s=1.0)
            assert (await ended) == MemberEnded(1, 0)
            assert await bus.ask(shared.address, AwaitEnd(1), MemberEnded, within_s=1.0) == MemberEnded(1, 0)
            await bus.ask(shared.address, BeginMember(launch("Quiet", "scout1"), 3), MemberBegun, within_s=1.0)
            with pytest.raises(NotAMember):  # else each restart of a member would leave a life in the process
                await bus.ask(shared.address, AwaitEnd(1), MemberEnded, within_s=1.0)
            shared.end("over")
            await running
            await bus.close()

    run_virtual(main())


@pytest.mark.parametrize(("task", "told"), [("radio:act", ["radio"]), ("Task-7", ["radio", "scout1"])])
def test_a_stray_fault_is_told_by_the_member_whose_task_it_was_or_by_all(
    local_mission: Callable, task: str, told: list[str]
) -> None:
    async def body() -> None:
        async with local_mission() as network:
            own = msgspec.structs.replace(launch("Quiet", "pool"), requester=CREATOR)
            shared = SharedProcess(own, network.join, VirtualClock(), 7)
            running = asyncio.create_task(shared.run())
            bus = network.join(CREATOR, VirtualClock())
            await VirtualClock().sleep_s(0.1)
            for life, name in enumerate(("radio", "scout1")):
                await bus.ask(shared.address, BeginMember(launch("Quiet", name), life), MemberBegun, within_s=1.0)
            await VirtualClock().sleep_s(1.0)
            shared.tell("coroutine 'drive' was never awaited", task)
            stories = {name: member.story.of() for name, member in shared.members().items()}
            assert [name for name in sorted(stories) if "never awaited" in str(stories[name])] == told
            shared.end("over")
            await running
            await bus.close()

    run_virtual(body())
