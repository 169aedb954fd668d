"""Run modules without a mission, each in its own process, connected by name and type over their own hub.

The same modules also work with ``run`` in one process. The processes are forked from the script, so each of them has
the script's own classes. They end with the script, even if it is killed.
"""

from __future__ import annotations

import asyncio
import math
import multiprocessing
import shutil
import signal
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

import msgspec

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, Statistics
from backbone.errors import Refusal, complaint
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.waiting import settle
from backbone.wire import Envelope, Message
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.graph import Graph
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, UnitParameters, is_message, output_address
from mission_control.modules.ports import kinds_of_ports
from mission_control.modules.run import member_of
from mission_control.modules.unit_component import UnitComponent
from mission_control.modules.units_together import Listener, check_heard

MISSION = "modules"
READY_WITHIN_S = 20.0  # chosen: a busy machine opens a session in a second
END_WITHIN_S = 2.0  # chosen: a unit ends in milliseconds, unless a module computes
ANSWERS_WITHIN_S = 2.0  # chosen: a unit answers in a millisecond, unless a module computes


_has_run = threading.Event()
"""Set when this process has opened a bus: the processes that it forks afterwards cannot open one (decision 0003)."""


class RunsOnce(Refusal):
    """This process has run modules in processes before, and cannot fork further ones that work."""

    code = "module.once"
    remedy = "Run each in a script of its own, or call 'run', which needs no processes."


class ModuleProcessFell(Refusal):
    """The process of a module ended, or was not ready in time."""

    code = "module.process"
    remedy = "Read the output that the process printed."


class _Unit(UnitComponent):
    """A unit without a nameserver."""

    registers = False


@dataclass
class _Child:
    """The process of a module; it begins when it receives the endpoint, and ends when the connection is closed."""

    launch: Launch
    process: BaseProcess
    connection: Connection


def run_in_processes(
    *modules: Module,
    frequency_hz: float = 10.0,
    for_s: float = math.inf,
    listen: Mapping[str, Listener] | None = None,
) -> dict[str, dict[str, float]]:
    """Run each module in its own process; when the time is over, return module → statistics of its unit.

    A script can call it once. A module that waits for inputs runs when they arrive; the other modules run at the
    frequency.

    Args:
        modules: Modules of different classes, each at the top level of a file. The processes create them again from
            class and parameters.
        frequency_hz: Rounds a second, above 0.
        for_s: Seconds; left out: until the process is interrupted.
        listen: Key → function that is called in this process with each of its values; values over 8 MB reach modules
            only. An exception in it ends the run, and is raised.

    Raises:
        GraphRefused: The modules cannot be connected, or exchange values that are not messages; the error lists all
            faults.
        WrongModule: One of them is no module.
        ValueError: The frequency is not between 0 and 1000 Hz.
        NothingToHear: No module produces a key of ``listen``, or its values are no messages.
        ModuleProcessFell: A process ended before the time was over.
        RunsOnce: The script has called it before.
    """
    units = _units(modules, frequency_hz)
    published = {key for one in units.values() for key in one.published}
    for key in listen or {}:
        check_heard(key, published)
    if _has_run.is_set():
        raise RunsOnce("a script can run modules in processes once")
    clock = MissionClock.started_now()
    with tempfile.TemporaryDirectory(prefix="scout-") as folder, ExitStack() as stack:
        children: list[_Child] = []
        for name, parameters in units.items():
            children.append(_forked(name, parameters, clock, folder, children))
            stack.callback(_end, children[-1])
        return asyncio.run(_accompany(children, socket_endpoint(Path(folder)), clock, for_s, listen or {}))


def _units(modules: Sequence[Module], frequency_hz: float) -> dict[str, UnitParameters]:
    """Return unit → parameters; consumers are before their producers."""
    members = [member_of(one) for one in modules]
    order = Graph({"all": members}).order["all"]
    apart = Graph({member.name: [member] for member in members})
    orders = {
        member.name: UnitOrder(
            name=member.name,
            frequency_hz=0.0 if apart.awaited(member.name) else frequency_hz,
            modules=[_order(member.name, module)],
        )
        for member, module in zip(members, modules, strict=True)
    }
    return arranged([orders[name] for name in reversed(order)], {})


def _order(name: str, module: Module) -> ModuleOrder:
    kind = type(module)
    return ModuleOrder(name, f"{kind.__module__}:{kind.__qualname__}", msgspec.to_builtins(module.parameters))


def _forked(
    name: str, parameters: UnitParameters, clock: MissionClock, folder: str, others: Sequence[_Child]
) -> _Child:
    """Fork a process that waits for the hub's endpoint; call this before the hub's threads exist."""
    given = msgspec.to_builtins(parameters)
    origin_s = clock.origin_monotonic_s
    about = (MISSION, Subsystem.MISSION_CONTROL, name, "unit", "", "here", "")
    launch = Launch(*about, origin_s, 1.0, given, run_directory=folder)
    fork = multiprocessing.get_context("fork")
    ours, theirs = fork.Pipe()
    inherited = [ours, *(other.connection for other in others)]
    process = fork.Process(target=_become, args=(launch, theirs, inherited), name=name, daemon=True)
    process.start()
    theirs.close()
    return _Child(launch, process, ours)


def _end(child: _Child) -> None:
    child.connection.close()
    child.process.join(END_WITHIN_S)
    child.process.kill()
    child.process.join()


async def _accompany(
    children: Sequence[_Child], endpoint: str, clock: MissionClock, for_s: float, listen: Mapping[str, Listener]
) -> dict[str, dict[str, float]]:
    """Run the hub and call the listeners until the time is over."""
    loop = asyncio.get_running_loop()
    fell: asyncio.Future[str] = loop.create_future()
    for child in children:
        loop.add_reader(child.process.sentinel, settle, fell, child.process.name)
    _has_run.set()
    hub = ZenohBus.open(MISSION, "ui_console/script", clock, hub_config([endpoint]))
    try:
        for child in children:
            _subscribe(hub, child.launch, listen, fell)
            await _begin(hub, child, endpoint, fell)
        await asyncio.wait({fell}, timeout=for_s if for_s < math.inf else None)
        if fell.done():
            raise ModuleProcessFell(f"the process of {fell.result()} ended")
        return {child.launch.name: await _statistics(hub, child.launch) for child in children}
    finally:
        for child in children:
            loop.remove_reader(child.process.sentinel)
        await hub.close()


def _subscribe(hub: ZenohBus, launch: Launch, listen: Mapping[str, Listener], fell: asyncio.Future[str]) -> None:
    """Call the listeners of this unit's outputs."""
    given = msgspec.convert(launch.parameters, UnitParameters)
    for order in given.modules:
        module = order.load()
        kinds = kinds_of_ports(module.Outputs)
        for key, port in order.member(module).keyed_outputs:
            kind = kinds[port.name]
            if key in listen and is_message(kind):
                at, listener = output_address(launch.address, key), listen[key]
                hub.subscribe(at, Conversation.OUTPUTS, kind, partial(_hand_on, listener, fell))


def _hand_on(listener: Listener, fell: asyncio.Future[str], output: Envelope[Message]) -> None:
    """Call the listener; its exception ends the run, as it does in one process."""
    try:
        listener(output.body)
    except StopIteration as error:  # no future can hold it
        settle(fell, RuntimeError(complaint(error)))
    except (Exception, SystemExit) as error:
        settle(fell, error)


async def _begin(hub: ZenohBus, child: _Child, endpoint: str, fell: asyncio.Future[str]) -> None:
    """Start the process; return when it is ready, so that producers begin after their consumers."""
    ready: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    hub.watch_alive(child.launch.address, lambda _address, alive: settle(ready, "") if alive else None)
    child.connection.send(endpoint)
    await asyncio.wait({ready, fell}, timeout=READY_WITHIN_S, return_when=asyncio.FIRST_COMPLETED)
    if fell.done():
        raise ModuleProcessFell(f"the process of {fell.result()} ended")
    if not ready.done():
        raise ModuleProcessFell(f"the process of {child.launch.name} was not ready in time")


async def _statistics(hub: ZenohBus, launch: Launch) -> dict[str, float]:
    return (await hub.ask(launch.address, AskStatistics(), Statistics, within_s=ANSWERS_WITHIN_S)).values


def _become(launch: Launch, connection: Connection, inherited: Sequence[Connection]) -> None:
    """Run the unit when the endpoint arrives."""
    for one in inherited:  # otherwise the end of the script would not close them
        one.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the script ends its processes
    try:
        endpoint = connection.recv()
    except EOFError:
        return
    asyncio.run(_live(msgspec.structs.replace(launch, endpoint=endpoint), connection))


async def _live(launch: Launch, connection: Connection) -> None:
    clock = MissionClock(launch.clock_origin_monotonic_s)
    unit = _Unit(launch, _Unit.open_bus(launch, clock), clock)

    def script_ended() -> None:
        shutil.rmtree(launch.run_directory, ignore_errors=True)  # a script that was killed cannot do it
        unit.end("its script has ended")

    asyncio.get_running_loop().add_reader(connection.fileno(), script_ended)
    await unit.run()
