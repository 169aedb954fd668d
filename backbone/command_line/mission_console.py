"""``scout-backbone up`` on a terminal: progress while the mission comes up, then its live picture."""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import stat
import sys
from typing import IO, cast

from rich.console import Console
from rich.live import Live

from backbone.addresses import LAUNCHER, RC_MANAGER
from backbone.bus import zenoh_threads
from backbone.bus.interface import Bus, Clock
from backbone.command_line.terminal_output import TerminalFile, TerminalOutput
from backbone.component.messages import ComponentState, StoryEvent
from backbone.errors import BackboneError, LinkError, Refusal, complaint
from backbone.keys import Conversation
from backbone.launcher.bring_up import run_mission
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.endings import ExitCode, complaint_of
from backbone.launcher.outcome import Outcome, with_signals
from backbone.launcher.verdict import VerdictPipe
from backbone.mission.model import MissionDescription
from backbone.mission_log.operators import OperatorActed
from backbone.naming import Subsystem
from backbone.picture.health import HealthWord, MissionHealth
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture, holders_line
from backbone.picture.screen import live_screen
from backbone.printable import printable_all
from backbone.printable_text import printable_lines
from backbone.rc_manager.messages import AskSchedule, TraceLine
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule
from backbone.spoken import counted
from backbone.waiting import set_within
from backbone.wire import Envelope

EVENTS_KEPT = 12  # chosen: as many as the tallest picture shows
PROGRESS_EVERY_S = 2.0  # chosen: an ordinary start takes less
SAME_EVERY_S = 60.0  # chosen: a wait for a person at another machine may last hours
REPLY_TIME_S = 2.0  # chosen: the RC manager answers in milliseconds
SWITCH_S = 0.1  # chosen: the decisions of one switch become one line; a person sees no delay
SUBSCRIBED_S = 1.0  # chosen: the answer may be here before the RC manager knows the subscriber, some ms later
AT_ONCE = 10  # chosen: with more requests the line is longer and changes more often than a person can read
ENDS_WITHIN_S = 1.0  # chosen: a terminal that reads takes the last lines at once
REDRAW_EVERY_S = 0.5  # chosen: slices of seconds stay visible; a faster picture takes a core that the mission needs


class ConsoleObserver:
    """Shows a mission to a person: lines while it comes up and goes down; meanwhile a live picture or lines.

    Args:
        live: True: a picture that is redrawn; False: lines.
        verdict: Pipe to the command that waits until all is ready; None: no command waits.
        output: Of the terminal or pipe, if it is one.
    """

    def __init__(
        self,
        console: Console,
        *,
        live: bool,
        verdict: VerdictPipe | None = None,
        output: TerminalOutput | None = None,
    ) -> None:
        self._console, self._live, self._verdict, self._output = console, live, verdict, output
        self._picture = MissionPicture("")
        self._told = self._health_told = ""
        self._is_up, self._last_progress_s = False, 0.0
        self._waits_for: list[str] = []

    def comes_up(self, mission: str) -> None:
        """Print the first line."""
        self.tell(f"mission {mission} comes up")

    def began(self, step: str) -> None:
        """Print nothing, because ``Outcome.failure`` names a step that hangs."""

    def done(self, step: str, took_s: float) -> None:
        """Print the step with its time."""
        self.tell(f"  ✓ {step:<42} {took_s * 1000:7.0f} ms")

    def announce(self, line: str) -> None:
        """Print the line."""
        self.tell(f"  {line}")

    def connected(self, bus: Bus) -> None:
        """Subscribe to the events of components and to the mission's health."""
        self._picture.mission = bus.mission
        bus.subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, self._heard_health, latest=True)
        consoles = f"{Subsystem.UI_CONSOLE}/*"
        bus.subscribe(consoles, Conversation.STATUS, ComponentState, self._heard, latest=True)
        bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard)

    def tell(self, line: str) -> None:
        """Print one line, also for the command that waits until all is ready."""
        self._print(line)
        if self._verdict is not None:
            self._verdict.talk(line)

    def refused(self, error: Refusal | LinkError) -> None:
        """Send the refusal to the command that waits; the caller prints it."""
        if self._verdict is not None:
            self._verdict.talk(f"could not be started: {error}")
        self.decide(complaint_of(error)[1])

    def broke(self, bug: Exception) -> None:
        """Send the bug to the command that waits; Python prints it here."""
        if self._verdict is not None:
            self._verdict.talk(f"the launcher failed: {complaint(bug)}")
        self.decide(ExitCode.UNEXPECTED)

    def decide(self, exit_code: int) -> None:
        """Send the exit code to the command that waits, unless it has one already."""
        if self._verdict is not None:
            self._verdict.decide(exit_code)

    def _print(self, line: str) -> None:
        _tell_if_possible(printable_lines(line), self._console.file)

    async def up(self, bus: Bus, clock: Clock) -> None:
        """Show the mission until cancelled."""
        ends = "'scout-backbone down'" if self._verdict is not None else "Ctrl-C or 'scout-backbone down'"
        self.tell(f"all ready; end with {ends}")
        self.decide(ExitCode.DONE)
        self._is_up = True
        if self._live:
            with contextlib.suppress(OSError):  # the terminal was closed, and the mission ends in good order
                await self._show_live(bus, clock)
        else:
            await self._tell_holders(bus, clock)

    async def _show_live(self, bus: Bus, clock: Clock) -> None:
        console, picture = self._console, self._picture
        with Live(console=console, auto_refresh=False, screen=True, vertical_overflow="crop") as live:
            try:
                while True:
                    await look(bus, clock.now_s(), before=picture, rate=clock.rate)
                    live.update(live_screen(picture, picture.log.newest(EVENTS_KEPT), console.height), refresh=True)
                    await clock.sleep_s(REDRAW_EVERY_S * clock.rate)
            finally:
                if self._output is not None:
                    self._output.drops = False  # the end of the picture restores the terminal

    def _heard_health(self, envelope: Envelope[MissionHealth]) -> None:
        heard = printable_all(envelope.body)
        if not self._is_up:
            self._heard_while_coming_up(heard, envelope.stamp_s)
            return
        told = f"health {heard.word}"
        names = ", ".join(absence.name for absence in heard.absent)
        if (told := f"{told}: {names}" if names else told) == self._health_told or self._live:
            return
        is_first, self._health_told = not self._health_told, told
        if is_first and heard.word is HealthWord.OK:
            return
        self._print(f"{envelope.stamp_s:9.2f} s  health {heard.word}")
        for line in heard.lines(envelope.stamp_s):
            self._print(f"{'':9}    {line}")

    def _heard_while_coming_up(self, heard: MissionHealth, at_s: float) -> None:
        """Print what a long start waits for: when it changes, and the same more and more seldom."""
        waits_for = [absence.name for absence in heard.absent]
        again_s = PROGRESS_EVERY_S
        if waits_for == self._waits_for:
            again_s = max(PROGRESS_EVERY_S, min(self._last_progress_s, SAME_EVERY_S))
        if at_s - self._last_progress_s >= again_s:
            self._last_progress_s, self._waits_for = at_s, waits_for
            for line in heard.lines(at_s):
                self.tell(f"  … {line}")

    def _heard(self, envelope: Envelope[StoryEvent | OperatorActed | ComponentState]) -> None:
        said = printable_all(envelope.body)
        self._picture.log.take(said, envelope.source)
        if not self._live and not isinstance(said, ComponentState):
            [event] = self._picture.log.newest(1)
            self._print(f"{event.at_s:9.2f} s  {event.subject}: {event.what}")

    async def _tell_holders(self, bus: Bus, clock: Clock) -> None:
        """Print the holders whenever they have changed, until the mission is down.

        The begin of the last run cancels this. It does not subscribe to the published schedule, because the RC manager
        would then compute the schedule twice a second. The more requests there are, the longer an answer takes, so the
        more seldom it asks.
        """
        decided, requests = asyncio.Event(), 0
        look_within_s: float | None = SUBSCRIBED_S
        bus.subscribe(RC_MANAGER, Conversation.EVENTS, TraceLine, lambda _line: decided.set())
        try:
            while True:
                decided.clear()
                with contextlib.suppress(LinkError):  # of the next RC manager there are events, too
                    schedule = await bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
                    requests = len(schedule.requests)
                    self._tell_changed(schedule)
                await set_within(decided, look_within_s)
                look_within_s = None
                await clock.sleep_s(SWITCH_S * max(1.0, requests / AT_ONCE) * clock.rate)
        finally:
            with contextlib.suppress(RuntimeError):  # the bus is closed already
                bus.subscribe(
                    RC_MANAGER, Conversation.SCHEDULE, Schedule, lambda said: self._tell_changed(said.body), latest=True
                )

    def _tell_changed(self, schedule: Schedule) -> None:
        if any(request.state in (RequestState.CONNECTING, RequestState.REVOKING) for request in schedule.requests):
            return
        line = self._picture.people.named(holders_line(schedule))
        if line != self._told:
            self._told = line
            self._print(f"{schedule.at_s:9.2f} s  {line}")


def _tell_if_possible(line: str, file: IO[str]) -> None:
    """Print the line; if the disk is full or the reader is gone, the mission continues."""
    with contextlib.suppress(OSError):
        print(line, file=file, flush=True)


async def bring_up_on_console(
    description: MissionDescription, options: UpOptions, *, live: bool, verdict: VerdictPipe | None = None
) -> int:
    """Run the mission, show it to a person, and return the exit code."""
    zenoh_threads.few_threads()
    stream, output = sys.stdout if live else sys.stderr, None
    if _may_pause(stream):
        output = TerminalOutput(stream.fileno(), lambda: None if live else _lines_are_missing(output), stream.encoding)
        output.drops = live
    file = cast("IO[str]", TerminalFile(output)) if output is not None else stream
    console = Console(file=file, markup=False, emoji=False)
    try:
        return await _bring_up(
            description, options, ConsoleObserver(console, live=live, verdict=verdict, output=output)
        )
    finally:
        if output is not None:
            output.wait_written(ENDS_WITHIN_S)


def _may_pause(stream: IO[str]) -> bool:
    """Return whether a reader takes what is written, as of a terminal or pipe; a file or a buffer takes it at once."""
    try:
        return not stat.S_ISREG(os.fstat(stream.fileno()).st_mode)
    except io.UnsupportedOperation:  # a program that runs this command in its own process keeps the output in memory
        return False


def _lines_are_missing(output: TerminalOutput | None) -> None:
    if output is not None:
        output.write("lines are missing here, because they were not read\n")


async def _bring_up(description: MissionDescription, options: UpOptions, observer: ConsoleObserver) -> int:
    try:
        outcome = await run_mission(description, options, observer)
    except (Refusal, LinkError) as error:
        observer.refused(error)
        raise
    except BackboneError as error:
        outcome = Outcome(failure=error)
    except Exception as bug:
        observer.broke(bug)
        raise
    for last in last_lines(outcome):
        observer.tell(last)
    code = ExitCode.DONE if outcome.went_well else ExitCode.MISSION_FAILED
    observer.decide(code)
    return code


def last_lines(outcome: Outcome) -> list[str]:
    """Return the last lines about a mission that has ended."""
    lines = []
    if outcome.ready_after_s is not None:
        lines.append(f"was ready after {outcome.ready_after_s:.2f} s")
    if outcome.pushed:
        lines.append(with_signals(outcome.pushed))
    if outcome.failure is not None:
        return [*lines, f"the mission failed: {outcome.why_failed}"]
    return [*lines, f"down: {counted(len(outcome.ended), 'component')} ended, nothing is left"]
