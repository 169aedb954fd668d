"""What every test gets: a check for tasks left behind, and a mission's network with its nameserver."""

from __future__ import annotations

import asyncio
import functools
import os
import signal
import tempfile
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import garbage
import limits
import pytest
import selection
import web_browser
from hypothesis import settings
from typer import testing
from typer.main import get_command

from backbone.bus import zenoh_threads
from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem
from backbone.operating_system.memory_folder import temporary_folder

# Few examples for a person who waits, all of them in CI; both the same in every run, so that two runs of one commit say
# the same. "search" looks for new ones. No deadline: how long an example takes is the machine's affair.
settings.register_profile("quick", max_examples=10, derandomize=True, deadline=None)
settings.register_profile("full", max_examples=100, derandomize=True, deadline=None)
settings.register_profile("search", max_examples=100, derandomize=False, deadline=None)
settings.load_profile(os.environ.get("SCOUT_EXAMPLES", "quick"))

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell that starts us in the background has SIGINT ignored, and all our children would inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Have limits for each test, failures printed when they happen, and long tests left out."""
    config.pluginmanager.register(garbage.Frozen(), "frozen")
    limits.watch(config)
    config.pluginmanager.register(selection.OnlyQuick(), "only-quick")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return how many processes ``-n logical`` has: half as many again as processors, because tests also wait."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return processors + processors // 2


def pytest_unconfigure() -> None:
    """End the browser of this process."""
    web_browser.CHROMIUM_THREAD.close()


MissionNetwork = Callable[..., AbstractAsyncContextManager[LocalNetwork]]


@pytest.fixture(autouse=True, scope="session")
def _own_threads_of_zenoh() -> Iterator[None]:
    """Keep zenoh's own threads in this process, in which many tests have their hub.

    A command that a test calls here would leave a client's two threads for all tests after it: then a question of the
    hub's process waits for itself. A nameserver here would leave a hub's threads for all processes that tests start.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(zenoh_threads, "few_threads", lambda: None)
        patch.setattr("backbone.nameserver.service.threads_of_a_hub", lambda: None)
        yield


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep what missions of these tests find out about the machine out of the account's own cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(autouse=True, scope="session")
def _commands_built_once() -> Iterator[None]:
    """Build the commands of a table once, not at each line that a test types: 30 ms of processor time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(testing, "_get_command", functools.cache(get_command), raising=False)
        yield


@pytest.fixture(autouse=True)
def _no_task_is_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail a test whose event loop ends in good order while a task still waits: somebody forgot to end it."""
    left: list[str] = []
    leave = asyncio.Runner.__exit__

    def look_and_leave(
        runner: asyncio.Runner,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            left.extend(sorted(task.get_name() for task in asyncio.all_tasks(runner.get_loop())))
        leave(runner, kind, error, trace)

    monkeypatch.setattr(asyncio.Runner, "__exit__", look_and_leave)
    yield
    if left:
        pytest.fail(f"left pending: {', '.join(left)}")


@asynccontextmanager
async def run_beside(component: Component[Any]) -> AsyncIterator[Component[Any]]:
    """Let the component live from its readiness to the end of the block."""
    life = asyncio.create_task(component.run(), name=f"life of {component.address}")
    ready = asyncio.create_task(_wait_ready(component), name=f"readiness of {component.address}")
    try:
        await asyncio.wait({life, ready}, return_when=asyncio.FIRST_COMPLETED)
        if life.done():
            await life
            raise AssertionError(f"{component.address} ended before it was ready")
        yield component
    finally:
        ready.cancel()
        component.end("the test is over")
        await asyncio.wait({ready})
        await life


async def _wait_ready(component: Component[Any]) -> None:
    """Return when the component's token stands."""
    risen = asyncio.Event()
    watching = component.bus.watch_alive(component.address, lambda _address, alive: risen.set() if alive else None)
    try:
        await risen.wait()
    finally:
        watching.close()


@asynccontextmanager
async def mission_on_local_network(
    mission: str = "local", clock: Clock | None = None, network: LocalNetwork | None = None
) -> AsyncIterator[LocalNetwork]:
    """Give a network inside this process on which the mission's first nameserver is ready."""
    network = network or LocalNetwork(mission)
    time = clock or VirtualClock()
    with tempfile.TemporaryDirectory() as run_directory:
        launch = Launch(
            mission,
            Subsystem.BACKBONE,
            "nameserver",
            "nameserver",
            "backbone.nameserver.service:Nameserver",
            "local",
            "",
            0.0,
            time.rate,
            run_directory=run_directory,
        )
        async with run_beside(Nameserver(launch, network.join(launch.address, time), time)):
            yield network


@pytest.fixture(scope="session")
def local_mission() -> MissionNetwork:
    """Return ``async with local_mission() as network``: a ``LocalNetwork`` with a nameserver that is ready.

    Example:
        >>> def test_components_register(local_mission):
        ...     async def main() -> None:
        ...         async with local_mission() as network:
        ...             ...
        ...     run_virtual(main())
    """
    return mission_on_local_network


@pytest.fixture(scope="session")
def beside() -> Callable[[Component[Any]], AbstractAsyncContextManager[Component[Any]]]:
    """Return ``async with beside(component)``: it lives from its readiness to the end of the block."""
    return run_beside


@pytest.fixture
def short_path() -> Iterator[Path]:
    """Give a folder with a path short enough for a socket in it; ``tmp_path`` may be too long."""
    with tempfile.TemporaryDirectory(prefix="s-", dir=temporary_folder()) as folder:
        yield Path(folder)
