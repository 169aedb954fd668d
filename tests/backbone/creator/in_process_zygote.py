"""A zygote's twin for virtual time: components and shared processes run as tasks of one loop, and die on order."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from typing import Any

import msgspec

from backbone.bus.clock import VirtualClock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.class_path import load_class
from backbone.component.component import Component, NoParameters
from backbone.component.heartbeat import WRITE_STACKS
from backbone.component.launch import Launch
from backbone.component.messages import Stop
from backbone.component.process import EXIT_BUG, EXIT_REFUSED
from backbone.component.shared_process import SharedProcess
from backbone.creator.zygote import NoProcess
from backbone.errors import Refusal
from backbone.keys import Conversation


class InProcessZygote:
    """Runs each component as a task; its pid is a number that only grows.

    Attributes:
        lives: Components and shared processes that run, by pid.
        forked: Names in the order in which they were forked.
        wrote_stacks: Pids in the order in which they were ordered to write their stacks.
        refuses: Why there is no further process; empty: there is one.
        trouble: What is said of it when it is looked at.
        was_busy_s: For how long it was busy.
    """

    def __init__(self, network: LocalNetwork) -> None:
        self.on_exit: Callable[[int, int], None] = lambda _pid, _returncode: None
        self.on_lost: Callable[[], None] = lambda: None
        self.lives: dict[int, Component[Any] | SharedProcess] = {}
        self.forked: list[str] = []
        self.wrote_stacks: list[int] = []
        self.refuses = self.trouble = ""
        self.was_busy_s = 0.0
        self._network, self._next_pid = network, 1000
        self._tasks: dict[int, asyncio.Task[None]] = {}

    async def fork(self, launch: Launch) -> int:
        if self.refuses:
            raise NoProcess(self.refuses)
        await asyncio.sleep(0)
        clock = VirtualClock()
        self._next_pid += 1
        pid = self._next_pid
        self.forked.append(launch.name)
        if launch.is_shared_process:
            self.lives[pid] = SharedProcess(launch, self._network.join, clock, pid)
        else:
            kind = load_class(launch.class_path)
            self.lives[pid] = kind(launch, self._network.join(launch.address, clock), clock)
        self._tasks[pid] = task = asyncio.create_task(self.lives[pid].run(), name=launch.name)
        task.add_done_callback(lambda done: self._ended(pid, done))
        return pid

    def kill(self, pid: int, number: signal.Signals) -> None:
        if pid not in self.lives:
            return
        if number is WRITE_STACKS:
            self.wrote_stacks.append(pid)
        elif number is signal.SIGKILL:
            self._tasks[pid].cancel()
        else:
            self.lives[pid].end(number.name)

    def keep_running(self) -> str:
        return self.trouble

    def busy_s(self) -> float:
        return self.was_busy_s

    async def close(self) -> None:
        for pid in list(self.lives):
            self.kill(pid, signal.SIGKILL)
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)

    def _ended(self, pid: int, done: asyncio.Task[None]) -> None:
        del self.lives[pid], self._tasks[pid]
        bug = None if done.cancelled() else done.exception()
        code = EXIT_REFUSED if isinstance(bug, Refusal) else EXIT_BUG
        returncode = -signal.SIGKILL if done.cancelled() else code if bug else 0
        self.on_exit(pid, int(returncode))


class Quiet(Component[NoParameters]):
    """Is ready and waits."""


class Stubborn(Component[NoParameters]):
    """Takes an hour to drain."""

    async def drain(self) -> None:
        await self.clock.sleep_s(3600.0)


class Late(Component[NoParameters]):
    """Needs ten seconds until it is ready, and cannot be hurried."""

    async def connect(self) -> None:
        await self.clock.sleep_s(10.0)


class Leaver(Component[NoParameters]):
    """Ends itself in good order after a second."""

    async def serve(self) -> None:
        await self.clock.sleep_s(1.0)
        self.end("its work is done")


class Failing(Component[NoParameters]):
    """Is ready, and fails as soon as it hears of a publication under its address."""

    async def connect(self) -> None:
        self.bus.subscribe(self.address, Conversation.COMMAND, Stop, self._fail_on)

    def _fail_on(self, heard: object) -> None:
        raise RuntimeError("the bug of the sample")


class Broken(Component[NoParameters]):
    """Ends by a bug before it is ready."""

    async def connect(self) -> None:
        raise RuntimeError("the bug of the sample")


class Leaving(Component[NoParameters]):
    """Leaves as a program does, before it is ready or in the hook that its name begins with."""

    async def connect(self) -> None:
        if self.name == "connect":
            raise SystemExit("no camera")

    async def serve(self) -> None:
        await self.clock.sleep_s(1.0)
        if self.name == "serve":
            raise SystemExit("no camera")
        self.end("its work is done")

    async def drain(self) -> None:
        if self.name == "drain":
            raise asyncio.CancelledError


class WeightedParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One number."""

    weight: int = 0


class Weighted(Component[WeightedParameters]):
    """Has a parameter."""

    parameters_type = WeightedParameters


class Forker(Component[NoParameters]):
    """Has something to do before there is a bus."""

    @classmethod
    def before_bus(cls, launch: Launch) -> None:
        raise AssertionError("called although there is a bus")
