"""The work of ``scout-backbone watch`` and ``scout-backbone top``: the messages of a live mission.

Both overhear, as a recorder does. No component waits for them, and senders copy messages for them only while they run.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from backbone.addresses import COMPONENT_DATABASE, NAMESERVER
from backbone.bus.interface import Bus, Clock, Overhearing
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.key_facts import TrafficRow, ask_facts, with_facts
from backbone.command_line.key_patterns import check_patterns
from backbone.command_line.line_printer import LinePrinter
from backbone.command_line.listening import until_ended
from backbone.command_line.message_lines import (
    TrafficTable,
    field_of,
    message_json,
    message_line,
    short_key,
    traffic_lines,
)
from backbone.command_line.unit_modules import modules_by_unit
from backbone.command_line.where import Where
from backbone.component_database.messages import ListTypes, Types
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode, say
from backbone.mission.model import EXECUTION_UNIT
from backbone.nameserver.messages import Components, ListComponents
from backbone.recording.absence import LinkAbsence, missing_in
from backbone.recording.hearing import Hearing, to_overhear
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import heard_now
from backbone.recording.translation import Translated
from backbone.spoken import counted
from backbone.waiting import first_of, set_within
from backbone.wire import Message

MOST_WAITING_BYTES = 16 * 1024 * 1024  # chosen: far more than a person can read
ANSWERS_HEARD_S = 0.1  # chosen: longer than overhearing the answers to its own questions, which are not counted
LOOK_EACH_S = 1.0  # chosen: a rate over a second is readable and recent
Heard = Callable[[str, Translated, float], None]
"""Callback with key, message and mission time."""


@dataclass(frozen=True)
class Watched:
    """A person's selection of messages.

    Attributes:
        keys: Patterns of keys; none: all.
        field: Only this field of a body; empty: all fields.
        most: End after so many messages; None: no limit.
        for_s: End after so many seconds of the machine; None: no limit.
        as_json: True: output for programs.
    """

    keys: tuple[str, ...]
    field: str = ""
    most: int | None = None
    for_s: float | None = None
    as_json: bool = False


async def watch(where: Where, wanted: Watched) -> ExitCode:
    """Print messages as they come, until a signal, the time, the number or the end of the mission ends it."""
    enough, came, shown = asyncio.Event(), 0, 0
    printer = LinePrinter(enough.set)

    def heard(key: str, message: Translated, at_s: float) -> None:
        nonlocal came, shown
        if enough.is_set():
            return
        came += 1
        for line in _lines(key, message, at_s, wanted):
            printer.put(line)
            shown += 1
        if wanted.most is not None and shown >= wanted.most:
            enough.set()

    async with (
        connected(where) as (bus, clock),
        overhearing(bus, clock, wanted.keys, _of_others(bus, heard)) as subscribed,
        until_ended(bus, clock, wanted.for_s) as ended,
        naming_absences(bus, clock),
    ):
        await first_of(ended.wait(), enough.wait())
        enough.set()
    await printer.end()
    if not came:
        _say_that_none_came(wanted)
    elif not shown:
        say(f"none of {counted(came, 'message')} has a value in {wanted.field!r}; --json shows their fields")
    if dropped := printer.dropped + sum(one.dropped for one in subscribed):
        say(f"incomplete: {counted(dropped, 'message')} came faster than they were read")
    return ExitCode.UNEXPECTED if printer.is_stuck else ExitCode.DONE


def _of_others(bus: Bus, heard: Heard) -> Heard:
    """Return a callback that leaves out what the command itself sends, such as its questions for the time."""

    def others(key: str, message: Translated, at_s: float) -> None:
        if message.source != bus.source:
            heard(key, message, at_s)

    return others


def _say_that_none_came(wanted: Watched) -> None:
    at_keys = f" at {' or '.join(wanted.keys)}; 'scout-backbone top' shows all keys" if wanted.keys else ""
    say(f"no message came{at_keys}")


@asynccontextmanager
async def naming_absences(bus: Bus, clock: Clock) -> AsyncIterator[None]:
    """Print each absence of the hub that ended in the block, because messages of that time are missing."""
    absence = LinkAbsence()

    def changed(is_up: bool) -> None:
        if away_s := absence.changed(is_up, clock.now_s() / clock.rate):
            say(f"incomplete: {missing_in(away_s)}")

    watching = bus.watch_link(changed)
    try:
        yield
    finally:
        watching.close()


async def top(where: Where, wanted: Watched, *, once: bool) -> ExitCode:
    """Print rates and sizes of keys each second, or once, the busiest first, and what their listeners did not get."""
    traffic = TrafficTable()

    def heard(key: str, message: Translated, _at_s: float) -> None:
        traffic.add(key, message.source, message.schema, message.size_bytes)

    async with (
        connected(where) as (bus, clock),
        overhearing(bus, clock, wanted.keys, _of_others(bus, heard)) as subscribed,
    ):
        async with until_ended(bus, clock, wanted.for_s) as ended, naming_absences(bus, clock):
            printer = LinePrinter(ended.set)
            while not ended.is_set():
                traffic.rows.clear()
                began_s = clock.now_s()
                await set_within(ended, None if once else LOOK_EACH_S)
                heard_rows = traffic.busiest((clock.now_s() - began_s) / clock.rate)
                await _show_rates(bus, heard_rows, wanted, printer)
                await clock.sleep_s(ANSWERS_HEARD_S * clock.rate)
        await printer.end()
        if dropped := sum(one.dropped for one in subscribed):
            say(f"incomplete: {counted(dropped, 'message')} came too fast")
        if printer.dropped:
            say(f"incomplete: {counted(printer.dropped, 'line')} came faster than they were read")
    return ExitCode.UNEXPECTED if printer.is_stuck else ExitCode.DONE


async def _show_rates(bus: Bus, heard: Sequence[TrafficRow], wanted: Watched, printer: LinePrinter) -> None:
    facts = await ask_facts(bus)
    rows = with_facts(heard, facts, bus.mission, wanted.keys)
    lines = map(json.dumps, rows) if wanted.as_json else [*traffic_lines(rows), ""]
    for line in lines if rows else []:
        printer.put(line)
    if not rows:
        _say_that_none_came(wanted)
    if facts.silent:
        say(f"without the counts of {', '.join(sorted(facts.silent))}, which did not answer")


async def mission_classes(bus: Bus, trouble: Callable[[str], None] = say) -> dict[str, type[Message]]:
    """Return the message classes of the installed packages, and of the mission's component types and modules.

    A thread imports them, so the event loop of the caller is not blocked.

    Args:
        trouble: Called with a sentence if the classes of the mission's component types cannot be found.
    """
    modules: set[str] = set()
    try:
        types = await bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=REPLY_TIME_S)
        listed = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
        told = await modules_by_unit(bus, [one.address for one in listed.components if one.type == EXECUTION_UNIT])
        paths = [one.component_type.class_path for one in types.types]
        paths += [str(one["class_path"]) for found in told.values() for one in found or ()]
        modules = {path.partition(":")[0] for path in paths}
    except (LinkError, Refusal) as error:
        trouble(f"messages of the mission's own types have no names of fields: {error}")
    return await asyncio.to_thread(message_classes, sorted(modules))


def _lines(key: str, message: Translated, at_s: float, wanted: Watched) -> Iterator[str]:
    heard = heard_now(key, message, at_s)
    if not wanted.field:
        yield json.dumps(message_json(heard)) if wanted.as_json else message_line(heard)
        return
    value = field_of(heard.body, wanted.field)
    if value is not None:
        told = {"at_s": heard.at_s, "key": heard.key, "value": value}
        shown = value if isinstance(value, str) else json.dumps(value)
        yield json.dumps(told) if wanted.as_json else f"{heard.at_s:10.3f} s  {short_key(heard.key)}  {shown}"


@asynccontextmanager
async def overhearing(
    bus: Bus,
    clock: Clock,
    keys: tuple[str, ...],
    heard: Heard,
    classes: Mapping[str, type[Message]] | None = None,
    of: str = "",
) -> AsyncIterator[list[Overhearing]]:
    """Call ``heard`` with key, message and mission time of each selected message.

    Args:
        keys: Patterns of keys; none: all.
        heard: Called in the event loop.
        classes: Message classes by schema; None: the mission's classes.
        of: Address of the component; empty: any.

    Raises:
        ImpossiblePattern: No key of this mission can match a pattern.
    """
    check_patterns(keys, bus.mission)
    hearing = Hearing(await mission_classes(bus) if classes is None else classes, keys)

    def came(key: str, raw: bytes) -> None:
        at_s = clock.now_s()
        for said_at, message in hearing.heard(key, raw, at_s):
            heard(said_at, message, at_s)

    subscribed = [
        bus.overhear(one, came, MOST_WAITING_BYTES, "" if one is Conversation.TOLD else of) for one in to_overhear(keys)
    ]
    try:
        yield subscribed
    finally:
        for one in subscribed:
            one.close()
