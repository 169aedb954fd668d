"""A zygote of an ordinary account beside processes of root, which it may not signal."""

from __future__ import annotations

import asyncio
import os
import signal

from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.creator.process_table import zygote_title
from backbone.creator.zygote import Zygote
from backbone.naming import Subsystem
from backbone.operating_system import own_process

NOBODY = 65534
ENDS_WITHIN_S = 10.0

is_begun, begun = os.pipe()
standard_input = os.dup(0)  # a component has none


class Alone(Component[NoParameters]):
    """Waits."""

    @classmethod
    def before_bus(cls, launch: Launch) -> None:
        os.write(begun, b"1")
        signal.pause()


class WithSudo(Component[NoParameters]):
    """Waits, and has a child of root."""

    @classmethod
    def before_bus(cls, launch: Launch) -> None:
        begin_as_root("sudo")
        signal.pause()


def begin_as_root(title: str) -> None:
    """Begin a process of root with this title; it ends with the standard input."""
    if os.fork() == 0:
        os.setresuid(0, 0, 0)
        own_process.set_title(title)
        os.write(begun, b"1")
        os.read(standard_input, 1)
        os._exit(0)


async def kill_one(zygote: Zygote, component: type[Alone | WithSudo]) -> None:
    """Start a component, kill it while a process of root has the title of its zygote, and wait for its end."""
    gone = asyncio.Event()
    zygote.on_exit = lambda _pid, _returncode: gone.set()
    class_path = f"{__name__}:{component.__name__}"
    pid = await zygote.fork(Launch("lab", Subsystem.RESOURCE_POOL, "one", "one", class_path, "lab", "", 0.0, 1.0))
    begin_as_root(zygote_title(pid))
    for _ in ("the component, or its child", "the process of root"):
        os.read(is_begun, 1)
    os.kill(pid, signal.SIGKILL)
    await asyncio.wait_for(gone.wait(), ENDS_WITHIN_S)
    print(component.__name__, "has ended", flush=True)


async def attend() -> None:
    """Run as root: become an ordinary account, and print the ends of two components and of their zygote."""
    os.setresuid(NOBODY, NOBODY, 0)  # the real and the effective account count for signals
    zygote = Zygote.fork_now()
    try:
        await kill_one(zygote, Alone)
        await kill_one(zygote, WithSudo)
    finally:
        await asyncio.wait_for(zygote.close(), ENDS_WITHIN_S)
    print("the zygote has ended", flush=True)
