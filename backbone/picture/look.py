"""Look at a mission from outside: ask the core services, and make a picture of their answers.

A picture with gaps never seems whole: a service that did not answer is absent, and the picture's ``problems`` name the
gaps.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable

import msgspec

from backbone.addresses import COMPONENT_DATABASE, LAUNCHER, NAMESERVER, PLACER, RC_MANAGER
from backbone.bus.interface import Bus
from backbone.component.messages import Absence, AskTime, LifeState, MissionTime
from backbone.component_database.messages import ListTypes, TypeCount, Types
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import ListProcesses, Processes, ProcessState
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import component_of
from backbone.picture.mission import MissionPicture, misses
from backbone.picture.words import counted_names
from backbone.printable import printable_all
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import Message

LOOK_TIME_S = 0.8  # chosen: a hung service is shown within 1 s; a starved one answers sooner
TYPES_WITHIN_S = 4.0  # chosen: the component database waits 3 s for the nameserver


async def look(
    bus: Bus,
    now_s: float,
    *,
    before: MissionPicture | None = None,
    rate: float = 1.0,
    schedule: bool = True,
    listed: Callable[[Components], None] = lambda _listing: None,
) -> MissionPicture:
    """Ask nameserver, RC manager, placer, launcher and creators, and return the picture of their answers.

    Args:
        before: The picture to update: an absence keeps its start, and if the nameserver does not answer, the picture
            stays as it was, marked as stale. None: a new one.
        schedule: False: only check that the RC manager answers.
        listed: Called with the nameserver's answer, which comes first.

    Raises:
        LinkError: The nameserver did not answer, and there is no earlier picture.
    """
    try:
        listing = printable_all(await bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S))
    except (LinkError, Refusal) as error:
        if before is None:
            raise
        silence = Absence("nameserver", now_s, f"no answer: {error}", "the launcher restarts it", vital=True)
        _gone_stale(before, printable_all(silence), now_s)
        return before
    listed(listing)
    picture = before or MissionPicture(bus.mission, rate=rate)
    first = {one.host for one in listing.components if one.address == NAMESERVER}
    creators = {one.address: one.host for one in listing.components if one.type == CREATOR}
    offered = {at: host if first - {host} else "" for at, host in sorted(creators.items())}
    answers = await asyncio.gather(
        _ask_or_absence(bus, now_s, RC_MANAGER, AskSchedule(), Schedule)
        if schedule
        else _ask_or_absence(bus, now_s, RC_MANAGER, AskTime(), MissionTime),
        _ask_or_absence(bus, now_s, PLACER, AskTime(), MissionTime),
        *(_ask_or_absence(bus, now_s, at, ListProcesses(), Processes, host) for at, host in offered.items()),
        _ask_or_absence(bus, now_s, LAUNCHER, ListProcesses(), Processes),
    )
    picture.at_s, picture.schedule, picture.processes, picture.stale_since_s = now_s, None, {}, None
    for said in (listing, *answers):
        if not isinstance(said, Absence | MissionTime):
            picture.take(said)
    silent = [said for said in answers if isinstance(said, Absence)]
    if any(one.address == LAUNCHER and one.state is LifeState.CONNECTING for one in listing.components):
        start = Absence(bus.mission, 0.0, "not all of it is ready", "its launcher starts the services", is_start=True)
        silent = [start, *(absence for absence in silent if not absence.vital)]
    kept = picture.processes.values()
    lacks = _lacks(listing, kept)
    picture.problems = (*(f"{absence.name}: {absence.cause}" for absence in silent), *lacks)
    missed = [*silent, *misses(picture.components.values(), kept, now_s, rate)]
    picture.missed = _remembered(missed, picture.missed)
    return picture


async def types_of(bus: Bus) -> list[TypeCount]:
    """Return the component types of a mission by name, each with the number of its running components.

    Raises:
        RunningUnknown: The nameserver did not answer.
        LinkError: The component database did not answer.
    """
    return printable_all(await bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=TYPES_WITHIN_S)).types


def _gone_stale(picture: MissionPicture, silence: Absence, now_s: float) -> None:
    """Mark the picture as stale, and set the nameserver's absence; the rest stays as it was."""
    picture.stale_since_s = picture.at_s if picture.stale_since_s is None else picture.stale_since_s
    others = (absence for absence in picture.missed if absence.name != silence.name)
    picture.missed = (*_remembered([silence], picture.missed), *others)
    picture.problems = tuple(f"{absence.name}: {absence.cause}" for absence in picture.missed)
    picture.at_s = now_s


async def _ask_or_absence(
    bus: Bus,
    now_s: float,
    address: str,
    question: Message,
    reply: type[Schedule | MissionTime | Processes],
    offered: str = "",
) -> Schedule | MissionTime | Processes | Absence:
    """Return the answer, or the absence of the component that did not answer.

    Args:
        offered: The host whose offer keeps the component; empty: the launcher keeps it.
    """
    try:
        return printable_all(await bus.ask(address, question, reply, within_s=LOOK_TIME_S))
    except (Refusal, LinkError) as error:
        if offered:  # a slow link hides it as well as a fault; the mission's own services are sound
            doing, remedy = f"{offered} restarts it if it hangs", f"if it stays silent, check the link to {offered}"
            return Absence(component_of(address), now_s, f"no answer: {error}", doing, remedy)
        launched = address != LAUNCHER
        doing = "the launcher restarts it" if launched else "it may answer again; nothing restarts a launcher"
        remedy = "" if launched else "if it stays silent: 'scout-backbone down', then 'up' again"
        return Absence(component_of(address), now_s, f"no answer: {error}", doing, remedy, vital=True)


def _remembered(missed: Iterable[Absence], before: Iterable[Absence]) -> tuple[Absence, ...]:
    """Return the absences, each with its first time."""
    since_s = {absence.name: absence.since_s for absence in before}
    return tuple(msgspec.structs.replace(each, since_s=since_s.get(each.name, each.since_s)) for each in missed)


def _lacks(listing: Components, processes: Iterable[ProcessState]) -> list[str]:
    """Return why the list of components is incomplete, one line for each reason."""
    listed = {component_of(component.address) for component in listing.components}
    unknown = {component_of(address) for address in listing.unknown}
    kept = list(processes)
    running = {process.spawn.name for process in kept if process.pid} - listed - unknown
    starting = {process.spawn.name for process in kept if not process.pid and not process.last_end} - listed - unknown
    lines = []
    if unknown:
        lines.append(f"the list is incomplete: no word yet from {counted_names(unknown)}")
    if starting:
        lines.append(f"the list is incomplete: still being started: {counted_names(starting)}")
    if running:
        lines.append(f"the list is incomplete: running and not registered yet: {counted_names(running)}")
    elif not listing.complete and not lines:
        lines.append("the list may be incomplete: the nameserver has just started, and components still register again")
    return lines
