"""Process entry: a forked or fresh process runs the component of its launch."""

from __future__ import annotations

import asyncio
import faulthandler
import logging
import os
import re
import signal
from collections.abc import Callable, Coroutine, Iterable

import uvloop

from backbone.bus import zenoh_threads
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Clock
from backbone.component.class_path import load_class
from backbone.component.component import AnyComponent
from backbone.component.heartbeat import WRITE_STACKS, Heartbeat
from backbone.component.launch import Launch
from backbone.component.logs import ComponentLog
from backbone.component.messages import LogLevel
from backbone.component.stray_faults import strays_told
from backbone.errors import BackboneError, Refusal, code_of, complaint, own_place, revive
from backbone.printable_text import printable
from backbone.waiting import end_tasks

EXIT_BUG, EXIT_REFUSED, EXIT_NO_HUB = 1, 5, 4  # as the command line's (ARCHITECTURE.md, section 5)
_REFUSED = "process %d: %s ended, refused [%s]: %s (remedy: %s)"
MOST_CAUSE = 300  # chosen: exception and a sentence; it is shown in one line beside other facts
_CAUSE_LINE = re.compile(r"(?:^|[ :])process (\d+): (\S+) ended(?: by a bug:|, refused \[\S+\]:|: \w+:) (.*)$")
_REFUSED_LINE = re.compile(r" (\S+) ended, refused \[([^]]+)\]: (.*) \(remedy: (.*)\)$")


def run_process(launch: Launch) -> int:
    """Run the component of this launch and return the process's exit code."""

    def begin() -> Coroutine[object, None, None]:
        component_class = load_class(launch.class_path)
        component_class.before_bus(launch)
        return _live(component_class, launch)

    return run_to_end(launch, begin)


def run_to_end(launch: Launch, begin: Callable[[], Coroutine[object, None, None]]) -> int:
    """Run the coroutine of ``begin`` in an event loop of this process and return the process's exit code.

    Args:
        begin: Called before the loop exists.
    """
    faulthandler.enable()
    faulthandler.register(WRITE_STACKS)
    zenoh_threads.few_threads()
    component_log = ComponentLog(launch.name, launch.run_directory)
    component_log.install()
    try:
        work = begin()
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            component_log.watch(runner.get_loop())
            runner.run(work)
    except BaseException as error:
        return exit_code_of(error, launch.address)
    finally:
        component_log.close()
    return 0


def exit_code_of(error: BaseException, address: str) -> int:
    """Log why a component ended, even if its code has switched logging off, and return the matching exit code."""
    log, pid = logging.getLogger(__name__), os.getpid()
    logging.disable(logging.NOTSET)
    log.disabled = False  # as ``logging.config`` leaves the loggers that it does not name
    log.setLevel(logging.ERROR)
    match error:
        case Refusal():
            place = own_place(error)
            detail = f"{error.detail} ({place})" if place else error.detail
            log.error(_REFUSED, pid, address, code_of(error), detail, error.remedy)
            return EXIT_REFUSED
        case BackboneError():
            log.error("process %d: %s ended: %s: %s", pid, address, type(error).__name__, error)
            return EXIT_NO_HUB
        case _:
            bug = complaint(error, MOST_CAUSE)
            log.error("process %d: %s ended by a bug: %s", pid, address, bug, exc_info=error)
            return EXIT_BUG


def refusal_in_log(lines: Iterable[str], address: str) -> Refusal | None:
    """Return the refusal that ended a component, as ``exit_code_of`` logged it; None: no refusal ended it.

    Args:
        lines: Lines of the log, oldest first.

    Example:
        >>> line = "12:00 ERROR x: resource_pool/x ended, refused [a.b]: no scout is named 'y' (remedy: See status.)"
        >>> found = refusal_in_log([line], "resource_pool/x")
        >>> found.detail, found.remedy
        ("no scout is named 'y'", 'See status.')
    """
    refusal = None
    for line in lines:
        found = _REFUSED_LINE.search(line)
        if found is not None and found[1] == address:
            refusal = revive(found[2], found[3], found[4], {})
    return refusal


def cause_in_log(lines: Iterable[str], address: str, pid: int) -> str:
    """Return why a component ended last in this process, as ``exit_code_of`` logged it; empty: the log does not say.

    Example:
        >>> lines = ["12:00 ERROR x: process 7: rc/x ended by a bug: ValueError: no picture"]
        >>> cause_in_log(lines, "rc/x", 7), cause_in_log(lines, "rc/x", 8)
        ('ValueError: no picture', '')
    """
    causes = [
        found[3] for found in map(_CAUSE_LINE.search, lines) if found and found.group(1, 2) == (str(pid), address)
    ]
    return printable(causes[-1], 2 * MOST_CAUSE) if causes else ""


async def _live(component_class: type[AnyComponent], launch: Launch) -> None:
    clock = MissionClock(launch.clock_origin_monotonic_s, launch.clock_rate)
    bus = component_class.open_bus(launch, clock)
    try:
        component = component_class(launch, bus, clock)
    except BaseException:
        await bus.close()
        raise
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, component.end, signal.Signals(number).name)
    with strays_told(lambda line, _task: component.publish_event(component.name, line, LogLevel.WARNING)):
        await run_with_heartbeat(launch, clock, component.run(), lambda: component.feedback or str(component.state))


async def run_with_heartbeat(
    launch: Launch, clock: Clock, life: Coroutine[object, None, None], doing: Callable[[], str] = str
) -> None:
    """Run this coroutine and the process's heartbeat beside it."""
    heartbeat = Heartbeat(launch.run_directory, doing)
    beating = asyncio.create_task(heartbeat.keep(clock), name="heartbeat")
    try:
        await life
    finally:
        await end_tasks(beating)
        heartbeat.close()
