"""Small components for tests of creators: real processes that do next to nothing, or something bad."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

from backbone.component.component import Component, NoParameters


class Quiet(Component[NoParameters]):
    """Is ready and waits."""


class Parent(Component[NoParameters]):
    """Has children: a program, a program in a session of its own, and a plain fork."""

    async def connect(self) -> None:
        _have_children()


class Stubborn(Component[NoParameters]):
    """Hangs as soon as it has to drain, and ignores SIGTERM."""

    async def drain(self) -> None:
        _hang()


class Late(Component[NoParameters]):
    """Never becomes ready, and shows no sign of life."""

    async def connect(self) -> None:
        print("blocks its event loop", flush=True)
        time.sleep(600.0)  # noqa: ASYNC251  that is the fault


class Blocked(Component[NoParameters]):
    """Blocks its event loop a moment after it is ready and alive."""

    async def serve(self) -> None:
        self.start_task(self._block(), "block")

    async def _block(self) -> None:
        await self.clock.sleep_s(0.5)
        never_returns()


class Broken(Component[NoParameters]):
    """Ends by a bug before it is ready."""

    async def connect(self) -> None:
        raise RuntimeError("the bug of the sample")


class Stumbling(Component[NoParameters]):
    """Ends by a bug a moment after it is ready."""

    async def serve(self) -> None:
        await self.clock.sleep_s(0.1)
        raise RuntimeError("the bug of the sample")


class Leaver(Component[NoParameters]):
    """Ends itself in good order a moment after it is ready."""

    async def serve(self) -> None:
        await self.clock.sleep_s(0.1)
        self.end("its work is done")


def _have_children() -> None:
    sleep = [sys.executable, "-c", "import signal, time; signal.signal(15, signal.SIG_IGN); time.sleep(600)"]
    subprocess.Popen(sleep)
    subprocess.Popen(sleep, start_new_session=True)
    if os.fork() == 0:
        _hang()


def _hang() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(600)
    os._exit(0)


def never_returns() -> None:
    """Block without using the processor: on a busy machine, waiting for one is no silence."""
    while True:
        time.sleep(1.0)
