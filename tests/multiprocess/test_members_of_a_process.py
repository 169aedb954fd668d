"""Several components in one real process: they begin, end, fail and die alone or together as they should."""

from __future__ import annotations

import asyncio
import os
import signal
import uuid
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path

import psutil
import pytest
import pytest_asyncio
from creator_host import POLICY, CreatorHost, creator_host
from running_mission import MARK, wait_gone

from backbone.component.messages import AskState, ComponentState
from backbone.creator.messages import EndedBy, StartFailed
from backbone.errors import BackboneError

pytestmark = [pytest.mark.processes, pytest.mark.timeout(60)]

GONE_WITHIN_S = 3.0
SOON_S = 15.0


@pytest.fixture
def mark(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Mark every process of the test, and fail if one is left."""
    own = uuid.uuid4().hex
    monkeypatch.setenv(MARK, own)
    yield own
    left = wait_gone(own, GONE_WITHIN_S)
    described = [(process.pid, process.name(), process.status()) for process in left]
    for process in left:
        process.kill()
    assert not described, f"left behind: {described}"


@pytest_asyncio.fixture
async def host(mark: str, tmp_path: Path) -> AsyncIterator[CreatorHost]:
    async with creator_host(tmp_path / "run") as up:
        yield up


async def join(host: CreatorHost, name: str, kind: str = "Quiet") -> int:
    return (await host.spawn(kind, name, process="pool")).pid


async def pids(host: CreatorHost) -> dict[str, int]:
    return {name: state.pid for name, state in (await host.processes()).items()}


async def soon(host: CreatorHost, what: str, holds: Callable[[], Awaitable[bool]]) -> None:
    """Return as soon as it holds; who cannot be asked meanwhile is asked again."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + SOON_S
    while loop.time() < end_s:
        try:
            if await holds():
                return
        except BackboneError as error:
            what = f"{what.partition(';')[0]}; {error!r}"
        await asyncio.sleep(0.02)
    raise AssertionError(f"not within {SOON_S} s: {what}\n{host.story()}")


async def state_of(host: CreatorHost, name: str) -> ComponentState:
    return await host.bus.ask(f"resource_pool/{name}", AskState(), ComponentState, within_s=2.0)


async def test_members_have_one_process_and_a_voice_each(host: CreatorHost) -> None:
    spawned = await asyncio.gather(*(join(host, name) for name in ("scout1", "scout2", "radio")))
    assert len(set(spawned)) == 1, host.story()
    assert psutil.Process(spawned[0]).name() == "pool"
    for name in ("scout1", "scout2", "radio"):
        state = await state_of(host, name)
        assert (state.address, state.pid) == (f"resource_pool/{name}", spawned[0])


async def test_ten_members_need_the_memory_and_connections_of_one_process(host: CreatorHost) -> None:
    alone = psutil.Process((await host.spawn("Quiet", "alone")).pid)
    members = [await join(host, f"quiet-{number}") for number in range(10)]
    shared = psutil.Process(members[0])
    assert set(members) == {shared.pid}
    assert len(shared.net_connections()) == len(alone.net_connections())
    assert shared.memory_full_info().uss < 2 * alone.memory_full_info().uss


async def test_a_member_ends_alone_and_the_last_ends_the_process(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "radio")
    assert (await host.end("scout1")).by is EndedBy.ASKING, host.story()
    assert await pids(host) == {"radio": pid}
    assert (await state_of(host, "radio")).pid == pid
    assert (await host.end("radio")).by is EndedBy.ASKING, host.story()
    assert not psutil.pid_exists(pid)
    assert not host.fell
    assert await join(host, "scout1") != pid


async def test_a_killed_process_is_followed_by_one_with_all_its_members(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "radio")
    os.kill(pid, signal.SIGKILL)

    async def are_back() -> bool:
        now = {(await state_of(host, name)).pid for name in ("scout1", "radio")}
        return len(now) == 1 and pid not in now

    await soon(host, "both are back in one process", are_back)
    assert {(fell.name, fell.how) for fell in host.fell} == {
        (name, "its process pool: killed by SIGKILL") for name in ("scout1", "radio")
    }


async def test_a_terminated_process_is_followed_by_one_with_all_its_members(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "radio")
    os.kill(pid, signal.SIGTERM)

    async def are_back() -> bool:
        found = await pids(host)
        return set(found) == {"scout1", "radio"} and pid not in found.values() and 0 not in found.values()

    await soon(host, "both are back", are_back)
    told = {(fell.name, fell.how.removeprefix("its process pool: ")) for fell in host.fell}  # whichever ends first
    assert told == {("scout1", "exit code 0"), ("radio", "exit code 0")}


async def test_a_member_that_hangs_is_killed_with_its_process_and_the_others_come_back(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "stubborn", "Stubborn")
    assert (await host.end("stubborn")).by is EndedBy.SIGKILL

    async def is_back() -> bool:
        return await pids(host) == {"scout1": (await state_of(host, "scout1")).pid}

    await soon(host, "scout1 is back, alone", is_back)
    assert (await state_of(host, "scout1")).pid != pid


async def test_a_member_that_cannot_start_tells_why_and_leaves_the_others_alone(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    with pytest.raises(StartFailed, match="the bug of the sample"):
        await join(host, "broken", "Broken")
    with pytest.raises(StartFailed, match="sample_components:Missing"):
        await join(host, "missing", "Missing")
    assert await pids(host) == {"scout1": pid}


async def test_a_member_that_blocks_the_event_loop_is_ended_with_its_process_and_the_others_come_back(
    host: CreatorHost,
) -> None:
    pid = await join(host, "scout1")
    with pytest.raises(StartFailed, match="no sign of life"):
        await host.spawn("Late", "late", process="pool", ready_within_s=0.5)

    async def is_back() -> bool:
        return "scout1" in await pids(host) and (await state_of(host, "scout1")).pid != pid

    await soon(host, "scout1 is back", is_back)


async def test_members_of_a_process_that_hangs_fall_with_the_line_at_which_it_stands(host: CreatorHost) -> None:
    await join(host, "scout1")
    await join(host, "blocked", "Blocked")

    async def both_fell() -> bool:
        return {fell.name for fell in host.fell} == {"scout1", "blocked"}

    await soon(host, "both fell", both_fell)
    assert all(fell.how.endswith("in never_returns") for fell in host.fell), [fell.how for fell in host.fell]


async def test_a_member_that_fails_is_restarted_beside_the_others_and_slowly_from_its_limit_on(
    host: CreatorHost,
) -> None:
    pid = await join(host, "scout1")
    assert await join(host, "radio", "Stumbling") == pid

    async def has_fallen_thrice() -> bool:
        return len(host.fell) == 3

    await soon(host, "third fall", has_fallen_thrice)
    assert {fell.name for fell in host.fell} == {"radio"}
    assert all(fell.how.startswith("exit code 1: RuntimeError: the bug of the sample (") for fell in host.fell)
    assert [fell.restart_in_s for fell in host.fell] == [0.05, 0.1, POLICY.failing_pause_s]
    assert any("the bug of the sample" in line for line in host.fell[0].last_lines)
    assert (await host.process("scout1")).restarts == 0
    assert (await state_of(host, "scout1")).pid == pid


async def test_a_hub_that_dies_takes_no_member_with_it_and_ends_are_heard_of_afterwards(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "radio")
    hub = host.core("nameserver")
    os.kill(hub, signal.SIGKILL)

    async def is_back() -> bool:
        members = await pids(host)  # answered by the creator, whose link comes back apart from the members'
        is_there = (await state_of(host, "scout1")).pid == pid == members.get("scout1")
        return is_there and host.core("nameserver") not in (0, hub)

    await soon(host, "members and creator answer again", is_back)
    assert (await host.end("scout1")).by is EndedBy.ASKING
    assert await pids(host) == {"radio": pid}
    assert not host.fell


async def test_killing_the_creator_ends_a_shared_process_too(host: CreatorHost) -> None:
    pid = await join(host, "scout1")
    await join(host, "radio")
    process = psutil.Process(pid)
    os.kill(host.core("creator-lab"), signal.SIGKILL)
    process.wait(GONE_WITHIN_S)

    async def is_back() -> bool:
        return await join(host, "radio") != pid

    await soon(host, "a new creator starts the same name", is_back)
