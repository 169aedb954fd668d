"""Creators over real processes and a real hub: starts, deaths of everybody, and nothing left behind."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path

import psutil
import pytest
import pytest_asyncio
from creator_host import POLICY, CreatorHost, below, creator_host, left_of
from running_mission import MARK, marked, wait_gone

from backbone.creator.messages import EndedBy, RestartPolicy, StartFailed
from backbone.errors import BackboneError

pytestmark = [pytest.mark.processes, pytest.mark.timeout(60)]

GONE_WITHIN_S = 3.0
RECOVERED_WITHIN_S = 15.0


@pytest.fixture(autouse=True)
def mark(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Mark every process a test starts, and fail it if one is left."""
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


async def soon(host: CreatorHost, what: str, holds: Callable[[], Awaitable[bool]]) -> None:
    """Return as soon as it holds; who cannot be asked meanwhile is asked again."""
    end_s = time.monotonic() + RECOVERED_WITHIN_S
    while time.monotonic() < end_s:
        try:
            if await holds():
                return
        except (BackboneError, psutil.Error) as error:
            what = f"{what.partition(';')[0]}; {error!r}"
        await asyncio.sleep(0.02)
    raise AssertionError(f"not within {RECOVERED_WITHIN_S} s: {what}\n{host.story()}")


async def test_ending_a_component_ends_what_it_started_too(host: CreatorHost) -> None:
    pid = (await host.spawn("Parent", "scout1")).pid
    children = below(pid)
    assert len(children) == 3, host.story()
    ended = await host.end("scout1")
    assert ended.by is EndedBy.ASKING, host.story()
    assert not left_of(children, 0.5)


async def test_a_killed_component_leaves_nothing_and_is_restarted_slowly_from_its_limit_on(host: CreatorHost) -> None:
    pid = (await host.spawn("Parent", "scout1")).pid
    for restarts in (1, 2):
        children = below(pid)
        os.kill(pid, signal.SIGKILL)

        async def is_back(restarts: int = restarts) -> bool:
            state = await host.process("scout1")
            return state.restarts == restarts and state.pid != 0 and len(below(state.pid)) == 3

        await soon(host, f"restart {restarts}", is_back)
        assert not left_of(children, 0.1)
        pid = (await host.process("scout1")).pid
    os.kill(pid, signal.SIGKILL)

    async def has_fallen_thrice() -> bool:
        return len(host.fell) == 3

    await soon(host, "third fall", has_fallen_thrice)
    assert [fell.restart_in_s for fell in host.fell] == [0.05, 0.1, POLICY.failing_pause_s]


async def test_who_does_not_obey_is_killed(host: CreatorHost) -> None:
    await host.spawn("Stubborn", "scout1")
    began_s = time.monotonic()
    assert (await host.end("scout1")).by is EndedBy.SIGKILL
    assert time.monotonic() - began_s < 2.0


async def test_a_component_that_blocks_its_event_loop_is_replaced_and_named_with_its_line(host: CreatorHost) -> None:
    await host.spawn("Blocked", "scout1")

    async def has_fallen() -> bool:
        return bool(host.fell)

    await soon(host, "fall", has_fallen)
    assert host.fell[0].how.startswith("hung: no sign of life")
    assert host.fell[0].how.endswith("in never_returns"), host.story()


async def test_a_failed_start_shows_the_end_of_the_log(host: CreatorHost) -> None:
    with pytest.raises(StartFailed, match="the bug of the sample"):
        await host.spawn("Broken", "broken")
    with pytest.raises(StartFailed, match=r"(?s)no sign of life for 0\.5 s.*blocks its event loop"):
        await host.spawn("Late", "late", ready_within_s=0.5)
    with pytest.raises(StartFailed, match="sample_components:Missing"):
        await host.spawn("Missing", "missing")


async def test_a_component_without_restart_may_leave_by_itself(host: CreatorHost) -> None:
    await host.spawn("Leaver", "watcher", policy=RestartPolicy(restart=False))

    async def is_forgotten() -> bool:
        return "watcher" not in await host.processes()

    await soon(host, "forgotten", is_forgotten)
    assert not host.fell


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
async def test_a_component_that_a_signal_ended_comes_back(host: CreatorHost, how: signal.Signals) -> None:
    pid = (await host.spawn("Quiet", "scout1")).pid
    os.kill(pid, how)

    async def is_back() -> bool:
        return (await host.process("scout1")).pid not in (0, pid)

    await soon(host, "scout1 is back", is_back)


async def test_a_stopped_process_is_replaced_and_never_comes_back_beside_its_successor(host: CreatorHost) -> None:
    pid = (await host.spawn("Quiet", "scout1")).pid
    os.kill(pid, signal.SIGSTOP)

    async def is_seen_silent() -> bool:
        return (await host.process("scout1")).silent_s > 0.5

    async def is_replaced() -> bool:
        return (await host.process("scout1")).pid not in (0, pid)

    await soon(host, "seen as silent", is_seen_silent)
    await soon(host, "replaced", is_replaced)
    assert not psutil.pid_exists(pid)


async def test_a_process_that_is_stopped_for_a_moment_goes_on(host: CreatorHost) -> None:
    pid = (await host.spawn("Quiet", "scout1")).pid
    os.kill(pid, signal.SIGSTOP)

    async def is_seen_silent() -> bool:
        return (await host.process("scout1")).silent_s > 0.5

    async def is_well() -> bool:
        return (await host.process("scout1")).silent_s == 0

    await soon(host, "seen as silent", is_seen_silent)
    os.kill(pid, signal.SIGCONT)
    await soon(host, "well again", is_well)
    assert (await host.process("scout1")).pid == pid
    assert not host.fell


async def test_killing_a_creator_ends_all_it_ran_and_it_comes_back_empty(host: CreatorHost) -> None:
    for kind, name in [("Quiet", "scout1"), ("Parent", "scout2"), ("Stubborn", "scout3")]:
        await host.spawn(kind, name)
    creator = host.core("creator-lab")
    all_it_ran = below(creator)
    assert len(all_it_ran) == 7
    os.kill(creator, signal.SIGKILL)
    left = left_of(all_it_ran, GONE_WITHIN_S)
    assert not left, f"{left}\n{host.story()}"

    async def is_back() -> bool:
        return bool((await host.spawn("Quiet", "scout1")).pid)

    await soon(host, "a new creator starts the same name", is_back)
    assert host.core("creator-lab") != creator


async def test_killing_a_creators_zygote_restarts_what_it_ran(host: CreatorHost) -> None:
    first = (await host.spawn("Parent", "scout1")).pid
    children, creator = below(first), host.core("creator-lab")
    os.kill(host.creators_zygote(), signal.SIGKILL)

    async def is_back() -> bool:
        state = await host.process("scout1")
        return state.pid not in (0, first) and len(below(state.pid)) == 3

    await soon(host, "scout1 runs again", is_back)
    assert not left_of(children, 0.1)
    assert host.core("creator-lab") == creator


async def test_killing_the_launchers_zygote_restarts_hub_and_creator(host: CreatorHost) -> None:
    await host.spawn("Quiet", "scout1")
    before = (host.core("nameserver"), host.core("creator-lab"))
    os.kill(host.zygote.pid, signal.SIGKILL)

    async def is_back() -> bool:
        now = (host.core("nameserver"), host.core("creator-lab"))
        return not set(now) & {0, *before} and bool((await host.spawn("Quiet", "scout1")).pid)

    await soon(host, "hub and creator run again", is_back)


async def test_a_hub_that_dies_takes_nobody_with_it(host: CreatorHost) -> None:
    pid = (await host.spawn("Quiet", "scout1")).pid
    creator, hub = host.core("creator-lab"), host.core("nameserver")
    os.kill(hub, signal.SIGKILL)

    async def is_back() -> bool:
        return (await host.process("scout1")).pid == pid and host.core("nameserver") not in (0, hub)

    await soon(host, "the hub is back", is_back)
    assert host.core("creator-lab") == creator
    assert not host.fell

    async def starts_again() -> bool:
        return bool((await host.spawn("Quiet", "scout2")).pid)

    await soon(host, "components can be started", starts_again)


async def test_signals_for_everybody_are_left_to_the_launcher(host: CreatorHost) -> None:
    pid = (await host.spawn("Quiet", "scout1")).pid
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(host.zygote.pid, number)
        os.kill(host.creators_zygote(), number)
    await host.spawn("Quiet", "scout2")
    assert (await host.process("scout1")).pid == pid


async def test_twenty_components_are_started_at_once(host: CreatorHost) -> None:
    names = [f"quiet-{number}" for number in range(20)]
    spawned = await asyncio.gather(*(host.spawn("Quiet", name) for name in names))
    assert len({each.pid for each in spawned}) == 20
    assert {psutil.Process(each.pid).name() for each in spawned} == set(names)


async def test_components_share_the_session_of_their_zygote_and_lead_a_process_group_each(host: CreatorHost) -> None:
    pids = [(await host.spawn("Quiet", name)).pid for name in ("scout1", "scout2")]
    assert {os.getsid(pid) for pid in pids} == {host.creators_zygote()}, "Linux shares the processor out by sessions"
    assert [os.getpgid(pid) for pid in pids] == pids
    assert os.getsid(host.zygote.pid) == host.zygote.pid, "the core services have a part of their own"


async def test_a_component_that_is_not_to_be_restarted_is_left_down(host: CreatorHost) -> None:
    pid = (await host.spawn("Quiet", "scout1", policy=RestartPolicy(restart=False))).pid
    os.kill(pid, signal.SIGKILL)

    async def is_left_down() -> bool:
        return "scout1" not in await host.processes()

    await soon(host, "left down", is_left_down)


def launcher_of_a_host(directory: Path) -> subprocess.Popen[str]:
    """Start the host of these tests in a process of its own."""
    script, tests = Path(__file__).with_name("creator_host.py"), Path(__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": str(tests)}
    command = [sys.executable, str(script), str(directory)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def test_killing_the_launcher_ends_all_and_removes_its_folder(mark: str, tmp_path: Path) -> None:
    directory = tmp_path / "run"
    with launcher_of_a_host(directory) as launcher:
        assert launcher.stdout is not None
        assert launcher.stdout.readline().startswith("all ready")
        assert len(marked(mark)) == 11
        launcher.kill()
    left = wait_gone(mark, GONE_WITHIN_S)
    assert not left, [(process.pid, process.name()) for process in left]
    assert list(tmp_path.iterdir()) == []


def test_a_launcher_told_to_end_ends_all(mark: str, tmp_path: Path) -> None:
    directory = tmp_path / "run"
    with launcher_of_a_host(directory) as launcher:
        assert launcher.stdout is not None
        assert launcher.stdout.readline().startswith("all ready")
        launcher.send_signal(signal.SIGINT)
    assert not wait_gone(mark, GONE_WITHIN_S)
    assert list(tmp_path.iterdir()) == []
