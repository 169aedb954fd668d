"""Questions to a mission that is up: the reasons for a state, the events about a name, the log."""

from __future__ import annotations

import json
from datetime import datetime

from backbone.addresses import LAUNCHER
from backbone.command_line.connection import connected
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, say, show
from backbone.mission_log.lines import log_json, log_lines, story_json, story_lines
from backbone.mission_log.log import Log
from backbone.mission_log.question import LogQuestion
from backbone.moments import Now
from backbone.picture.reasons import reasons_for, story_of
from backbone.spoken import counted

LOG_WITHIN_S = 5.0  # chosen: ten thousand events on a slow link


async def print_reasons(where: Where, name: str, *, as_json: bool) -> ExitCode:
    """Print why the component, request, resource or alarm of this name is in its present state."""
    async with connected(where) as (bus, clock):
        reasons = await reasons_for(bus, name, clock)
        show([json.dumps(reasons.to_json())] if as_json else reasons.lines(clock.now_s()))
    return ExitCode.DONE


async def print_story(where: Where, name: str, *, as_json: bool) -> ExitCode:
    """Print the events about this name, and the components that did not answer."""
    async with connected(where) as (bus, clock):
        found = await story_of(bus, name, clock)
    events = [*map(found.people.named_event, found.events)]
    show([json.dumps(story_json(name, found.events, found.missing))] if as_json else story_lines(events))
    if not found.events:
        say(f"no component has an event about {name}{found.similar}")
    if found.missing:
        say(f"incomplete: {counted(len(found.missing), 'component')} did not answer")
        for missing in found.missing:
            say(f"  {missing}")
    return ExitCode.DONE


async def print_log(where: Where, question: LogQuestion, most: int, *, as_json: bool) -> ExitCode:
    """Print the newest events that match the question, at most ``most``, and the number of omitted ones."""
    async with connected(where) as (bus, clock):
        now = Now(clock.now_s(), datetime.now(), clock.rate)
        asked = question.asked(now, most)
        kept = await bus.ask(LAUNCHER, asked, Log, within_s=LOG_WITHIN_S)
    show([json.dumps(log_json(kept, now))] if as_json else log_lines(kept, now))
    if not kept.events:
        say("no event matches")
    if kept.left_out:
        say(f"{counted(kept.left_out, 'older event')} left out; see --most and --until")
    if kept.since_s > asked.since_s:
        say(f"events before {kept.since_s:.1f} s are no longer kept")
    return ExitCode.DONE
