"""``scout-backbone up`` on a terminal: progress while the mission comes up, then its live picture."""

from __future__ import annotations

import asyncio
import sys
from collections import deque
from typing import Any, TextIO

from rich.console import Console
from rich.live import Live

from backbone.bring_up import Outcome, run_mission
from backbone.bus.interface import Bus, Clock
from backbone.cli import ExitCode
from backbone.component.messages import StoryEvent
from backbone.core_launches import UpOptions
from backbone.errors import BackboneError, LinkError, Refusal
from backbone.keys import Conversation
from backbone.mission.model import MissionDescription
from backbone.mission_picture import holders_line, look
from backbone.mission_screen import live_screen
from backbone.operators import OperatorActed
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import RequestState, Schedule
from backbone.wire import Envelope

EVENTS_KEPT = 12  # chosen: as many as the tallest picture shows
REDRAW_EVERY_S = 0.5  # chosen: people see slices of seconds; more costs a core that the mission needs


class ConsoleObserver:
    """Tells a person what happens: lines while it comes up and goes down, a live picture or lines between.

    Args:
        console: Where to.
        live: True: a picture that is redrawn; False: lines.
        ready_to: Told the same lines until all is ready, then closed: the one who waits for that.
    """

    def __init__(self, console: Console, *, live: bool, ready_to: TextIO | None = None) -> None:
        self._console, self._live, self._ready_to = console, live, ready_to
        self._events: deque[StoryEvent] = deque(maxlen=EVENTS_KEPT)
        self._told = ""

    def began(self, step: str) -> None:
        """Say nothing yet: a step that hangs is named by ``Outcome.failure``."""

    def done(self, step: str, took_s: float) -> None:
        """Print the step with its time."""
        self.tell(f"  ✓ {step:<42} {took_s * 1000:7.0f} ms")

    def announce(self, line: str) -> None:
        """Print the line."""
        self.tell(f"  {line}")

    def connected(self, bus: Bus) -> None:
        """Listen to what components tell people."""
        bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard_event)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard_act)

    def tell(self, line: str) -> None:
        """Print one line, also to whoever waits for readiness."""
        self._print(line)
        if self._ready_to is not None:
            print(line, file=self._ready_to, flush=True)

    def _print(self, line: str) -> None:
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    async def up(self, bus: Bus, clock: Clock) -> None:
        """Show the mission until cancelled."""
        self.tell("all ready; end with Ctrl-C or 'scout-backbone down'")
        if self._ready_to is not None:
            self._ready_to.close()
            self._ready_to = None
        if self._live:
            await self._show_live(bus, clock)
        else:
            bus.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, self._heard_schedule, latest=True)
            await asyncio.Event().wait()

    async def _show_live(self, bus: Bus, clock: Clock) -> None:
        console = self._console
        with Live(console=console, auto_refresh=False, screen=True, vertical_overflow="crop") as live:
            while True:
                try:
                    picture = await look(bus, clock.now_s())
                    live.update(live_screen(picture, self._events, console.height), refresh=True)
                except LinkError as error:
                    live.update(f"the nameserver does not answer: {error}", refresh=True)
                await clock.sleep_s(REDRAW_EVERY_S * clock.rate)

    def _heard_act(self, envelope: Envelope[Any]) -> None:
        act: OperatorActed = envelope.body
        self._show_event(StoryEvent(act.at_s, envelope.source, act.sentence, act.subject, envelope.cause))

    def _heard_event(self, envelope: Envelope[Any]) -> None:
        self._show_event(envelope.body)

    def _show_event(self, event: StoryEvent) -> None:
        self._events.append(event)
        if not self._live:
            self._print(f"{event.at_s:9.2f} s  {event.subject}: {event.what}")

    def _heard_schedule(self, envelope: Envelope[Any]) -> None:
        schedule: Schedule = envelope.body
        if any(request.state in (RequestState.CONNECTING, RequestState.REVOKING) for request in schedule.requests):
            return
        line = holders_line(schedule)
        if line != self._told:
            self._told = line
            self._print(f"{schedule.at_s:9.2f} s  {line}")


async def bring_up_on_console(
    description: MissionDescription, options: UpOptions, *, live: bool, ready_to: TextIO | None = None
) -> int:
    """Run the mission, tell a person about it, and return the exit code."""
    console = Console(file=sys.stdout if live else sys.stderr)
    observer = ConsoleObserver(console, live=live, ready_to=ready_to)
    observer.tell(f"mission {description.name} comes up")
    try:
        outcome = await run_mission(description, options, observer)
    except (Refusal, LinkError) as error:
        observer.tell(f"could not be started: {error}")
        raise
    except BackboneError as error:
        outcome = Outcome(failure=error)
    for line in last_lines(outcome):
        observer.tell(line)
    return ExitCode.DONE if outcome.went_well else ExitCode.MISSION_FAILED


def last_lines(outcome: Outcome) -> list[str]:
    """Return what a person should know of a mission that has ended."""
    lines = []
    if outcome.ready_after_s is not None:
        lines.append(f"was ready after {outcome.ready_after_s:.2f} s")
    if outcome.pushed:
        lines.append("more than asking was needed: " + ", ".join(f"{end.name} ({end.by})" for end in outcome.pushed))
    if outcome.failure is not None:
        return [*lines, f"the mission failed: {outcome.failure}"]
    return [*lines, f"down: {len(outcome.ended)} components ended, nothing is left"]
