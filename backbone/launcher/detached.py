"""``up --detach`` and ``down``: start a launcher without a terminal, and end one."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil

from backbone import run_files
from backbone.addresses import LAUNCHER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.errors import LinkError, NoResponder, Refusal, ReplyTimeout
from backbone.launcher.bring_up import end_mission
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.ending_messages import AwaitLastBranch, AwaitMissionEnd, LastBranchOver, MissionEnded
from backbone.launcher.endings import ExitCode, say
from backbone.launcher.outcome import with_signals
from backbone.launcher.verdict import await_verdict
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.waiting import first_of, set_within

ASKED_S, TERM_S, KILL_S = 20.0, 10.0, 5.0  # chosen: a busy machine needs 5 s to end forty components
SKIP_S = 0.5  # chosen: two signals in quick succession may become one


def up_detached(mission: str, mission_file: Path, options: UpOptions) -> int:
    """Start a launcher in a session of its own; return 0 when all is ready, else the exit code of its failure.

    Only the launcher's verdict decides, because its process still lives while it cleans up after a failure.
    """
    told, telling = os.pipe()
    program = ["-P", "-m", "backbone.command_line.cli"]  # -P: no module of the working folder
    command = [sys.executable, *program, "up", str(mission_file.absolute()), "--headless"]
    command += ["--tell-fd", str(telling), "--speed", str(options.speed)]
    command += ["--trace", str(options.trace.absolute())] if options.trace else []
    command += ["--for", str(options.for_s)] if options.for_s is not None else []
    command += ["--pack", str(options.pack)] if options.pack is not None else []
    command += ["--record", str(options.record.absolute())] if options.record else []
    launcher = subprocess.Popen(  # noqa: S603  our own command line
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        pass_fds=[telling],
    )
    os.close(telling)
    try:
        with os.fdopen(told, encoding="utf-8", errors="replace") as lines:
            exit_code = await_verdict(lines, say)
    except KeyboardInterrupt:
        launcher.send_signal(signal.SIGTERM)  # it cleans up by itself
        raise
    if exit_code is None:
        return _died(launcher)
    if exit_code == ExitCode.DONE:
        say(f"mission {mission} goes on as process {launcher.pid}; end it: scout-backbone down --mission {mission}")
    return exit_code


def _died(launcher: subprocess.Popen[bytes]) -> int:
    """Return the exit code for a launcher that ended without a verdict."""
    try:
        ended = launcher.wait(KILL_S)
    except subprocess.TimeoutExpired:
        say(f"the launcher, process {launcher.pid}, gave no verdict and does not end")
        return ExitCode.MISSION_FAILED
    how = signal.Signals(-ended).name if ended < 0 else f"exit code {ended}"
    say(f"the launcher ended without a verdict: {how}")
    return ended if ended > 0 else ExitCode.MISSION_FAILED


async def take_down(mission: str | None, *, at_once: bool = False) -> int:
    """End a mission of this machine and return when its launcher has ended.

    The waits before each signal to the launcher do not include the time of the last branch.

    Args:
        mission: Its name; None: the only one.
        at_once: Without the last branch.
    """
    found = run_files.find(mission)
    try:
        return await _end_launcher(found, at_once=at_once)
    except (psutil.NoSuchProcess, ProcessLookupError):  # by itself, or by another ``down``
        say(f"mission {found.mission} is down; its launcher has ended meanwhile")
        return ExitCode.DONE


async def _end_launcher(found: run_files.RunFile, *, at_once: bool) -> int:
    """Order the launcher to end, then signal it until it ends.

    Raises:
        NoSuchProcess: It ended before it got a signal.
        ProcessLookupError: It had ended before it could be watched.
    """
    launcher = psutil.Process(found.launcher_pid)
    waiting, loop, ended = os.pidfd_open(launcher.pid), asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(waiting, ended.set)
    if launcher.status() == psutil.STATUS_STOPPED:
        say(f"the launcher, process {launcher.pid}, was stopped; it is continued so that it can end its mission")
        launcher.send_signal(signal.SIGCONT)
    try:
        for what, seconds, act in (
            ("asking", ASKED_S, None),
            ("SIGTERM", SKIP_S if at_once else TERM_S, signal.SIGTERM),
            ("SIGTERM", TERM_S, signal.SIGTERM),  # the second one ends a last branch
            ("SIGKILL", KILL_S, signal.SIGKILL),
        ):
            needed = f"{what} was enough"
            if act is not None:
                launcher.send_signal(act)
            elif not (needed := await _ask(found, ended, at_once=at_once)):
                continue
            if await set_within(ended, seconds):
                say(f"mission {found.mission} is down; {needed}")
                return ExitCode.DONE if what != "SIGKILL" else ExitCode.MISSION_FAILED
    finally:
        loop.remove_reader(waiting)
        os.close(waiting)
    say(f"mission {found.mission}: process {launcher.pid} does not end")
    return ExitCode.MISSION_FAILED


async def _ask(found: run_files.RunFile, ended: asyncio.Event, *, at_once: bool) -> str:
    """Order the mission to end, and wait for its last branch and its end.

    Returns:
        What was needed to end its components, for people; empty: the launcher does not end the mission.
    """
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
    try:
        bus = await ZenohBus.open_when_up(
            found.mission,
            f"ui_console/down-{os.getpid()}",
            clock,
            client_config(found.endpoint, run_files.secret(found)),
        )
    except LinkError as error:
        say(f"the hub cannot be reached: {error}")
        return ""
    try:
        publish_action(bus, clock, OperatorAction.STOP_MISSION, found.mission, "by command")
        ending = await end_mission(bus, at_once=at_once)
        if ending.told:
            say(ending.told)
        if ending.within_s:
            await first_of(_tell_last_branch(bus, ending.within_s / clock.rate + ASKED_S), ended.wait())
        return await _needed(bus, ended) if ending.has_components else "asking was enough"
    except LinkError as error:
        say(f"the launcher does not answer: {error}")
        return ""
    except Refusal as error:  # it is of another release
        say(f"the launcher does not take the order: {error}")
        return ""
    finally:
        await bus.close()


async def _needed(bus: Bus, ended: asyncio.Event) -> str:
    """Return what was needed to end the components, for people; empty: they have not ended within ``ASKED_S``."""
    asking = asyncio.create_task(bus.ask(LAUNCHER, AwaitMissionEnd(), MissionEnded, within_s=ASKED_S))
    await first_of(asking, ended.wait())
    if not asking.cancelled():
        if isinstance(asking.exception(), ReplyTimeout):
            say(f"not all components have ended within {ASKED_S:g} s")
            return ""
        with contextlib.suppress(NoResponder, Refusal):  # it died, or it is of another release
            return with_signals(asking.result().signaled) or "asking was enough"
    return "it is unknown whether its components needed a signal"


async def _tell_last_branch(bus: Bus, within_s: float) -> None:
    """Print how the last branch ended, as soon as it is over; ``within_s`` is machine time."""
    try:
        over = await bus.ask(LAUNCHER, AwaitLastBranch(), LastBranchOver, within_s=within_s)
    except LinkError as error:
        say(f"the launcher did not report how the last branch ended: {error}")
    else:
        say(over.told)
