"""The work of ``scout-backbone record`` and ``scout-backbone recording``."""

from __future__ import annotations

import asyncio
import gc
import json
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from backbone import run_files
from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.authentication import secret_of
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S
from backbone.command_line.joining import clock_lines, clocks_json
from backbone.command_line.key_patterns import check_patterns
from backbone.command_line.message_lines import message_json, message_line
from backbone.command_line.opened_recording import opened
from backbone.command_line.options import DISTRIBUTION
from backbone.command_line.unusable_file import FileUnusable, existing, unwritable
from backbone.command_line.watching import mission_classes
from backbone.command_line.where import Where
from backbone.component.messages import AskTime, MissionTime, StoryEvent
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.launcher import mission_connection
from backbone.launcher.endings import ExitCode, say, show
from backbone.launcher.messages import AskTree, Tree
from backbone.launcher.recorder_beats import RecorderBeats, address_of_recorder
from backbone.launcher.recorder_signs import RecorderSigns
from backbone.mission_log.lines import event_json, story_lines
from backbone.mission_log.log import FOR_EVER_S, AskLog, chosen
from backbone.mission_log.operators import OperatorActed, login_name
from backbone.operating_system.ending_signals import interruptible, orders_to_end
from backbone.operating_system.own_process import go_behind_others
from backbone.printable import printable_all
from backbone.recording.absence import missing_in
from backbone.recording.clock_offsets import ClockObserver
from backbone.recording.files import RecordingFiles
from backbone.recording.host_ear import HostEar
from backbone.recording.known_messages import message_classes
from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.reader import Recording
from backbone.recording.recorder import Recorder
from backbone.recording.recovering import recover_file
from backbone.recording.revival import Reviver
from backbone.spoken import counted
from backbone.wire import plain

SHORTEST_RATED_S = 1.0  # chosen: two messages within a millisecond are no thousand a second
VERSIONS_OF = (DISTRIBUTION, "eclipse-zenoh", "msgspec", "mcap")


@dataclass(frozen=True)
class Splitting:
    """Limits after which a recording continues in a further file.

    Attributes:
        after_s: Longest time in one file, seconds of the machine.
        megabytes: Largest size of one file.
        keep: Number of files to keep; 0: all.
    """

    after_s: float
    megabytes: int
    keep: int


@dataclass(frozen=True)
class OfLauncher:
    """Settings that a launcher, an offer or a person passes to the recorder that it starts.

    Attributes:
        is_described: True: the launcher describes the mission on standard input, because it cannot be asked yet.
        host_folder: Folder of the mission's files on this host, where its processes leave copies; None: see
            ``_folder_by_hand``.
        host_only: True: record only these copies, until standard input ends; False: record them, and all messages of
            other hosts except pictures.
        is_lossless: True: a person wants every message, see ``Bus.overhear``; then the recorder overhears only the bus.
    """

    is_described: bool = False
    host_folder: Path | None = None
    host_only: bool = False
    is_lossless: bool = False


async def record_to(
    where: Where, to: Path | None, keys: list[str], for_s: float | None, splitting: Splitting, told: OfLauncher
) -> ExitCode:
    """Record the mission until a signal or the time ends it, the disc is full, or the mission has ended.

    Raises:
        ImpossiblePattern: No key of this mission can match a pattern.
    """
    own = address_of_recorder()
    async with mission_connection.connected(where.mission, where.connect, own, where.secret()) as (bus, clock):
        check_patterns(keys, bus.mission)
        path = to or Path(f"{bus.mission}-{datetime.now():%Y%m%d-%H%M%S}.mcap")
        if told.is_described:
            said = json.load(sys.stdin)
            mission_xml, classes = said["mission_xml"], message_classes(said["modules"])
        else:
            mission_xml, classes = await _mission_file(bus), await mission_classes(bus)
        folder = told.host_folder or (None if told.is_lossless else _folder_by_hand(where, bus.mission, keys))
        with new_files(path, splitting.keep) as files:
            recorder = Recorder(
                bus,
                clock,
                files=files,
                split_s=splitting.after_s,
                split_bytes=splitting.megabytes * 1_000_000,
                classes=classes,
                about=await _about(bus, clock, keys),
                keys=tuple(keys),
                mission_xml=mission_xml,
                user=login_name(),
                ear=HostEar(folder, is_of_mission=not told.host_only) if folder is not None else None,
                host_only=told.host_only,
                is_lossless=told.is_lossless,
            )
            go_behind_others()
            beats = RecorderBeats(bus, path) if told.host_folder is None else None  # else its starter watches it
            recorder.on_flushed = beats.give if beats is not None else RecorderSigns().give
            gc.collect()
            gc.freeze()  # else the collector examines all imported objects again and again
            await _run(recorder, path, for_s, ends_with_input=told.host_only)
            if beats is not None:
                beats.end()
    left = path if files.oldest == path else f"{files.oldest} and later, older ones are deleted"
    say(f"{left}: {counted(recorder.written, 'message')}")
    if recorder.dropped:
        say(f"incomplete: {counted(recorder.dropped, 'message')} came faster than they could be written")
    if recorder.away_s:
        say(f"incomplete: {missing_in(recorder.away_s)}")
    if recorder.deleted:
        say(f"incomplete: {counted(recorder.deleted, 'message')} were in a file that was deleted meanwhile")
    if recorder.why_ended:
        say(f"the recording ended because {recorder.why_ended}")
    return ExitCode.REFUSED if recorder.full else ExitCode.DONE


async def _run(recorder: Recorder, path: Path, for_s: float | None, *, ends_with_input: bool) -> None:
    loop = asyncio.get_running_loop()
    if ends_with_input:
        loop.add_reader(sys.stdin, recorder.end)  # the input only ends, when the offer is gone; it has no content
    for number in (signal.SIGINT, *orders_to_end()):
        loop.add_signal_handler(number, recorder.end)
    timer = loop.call_later(for_s, recorder.end) if for_s is not None else None
    try:
        await recorder.run(lambda: say(f"records to {path}; Ctrl-C ends it"))
    finally:
        loop.remove_reader(sys.stdin)
        if timer is not None:
            timer.cancel()


def _folder_by_hand(where: Where, mission: str, keys: list[str]) -> Path | None:
    """Return the folder where processes of this host leave copies; None: overhear the bus instead.

    Overhearing suits few keys, and pictures of other hosts, because no process sends copies of those.
    """
    if where.connect is not None or keys:
        return None
    folder = run_files.run_directory(mission)
    return folder if not secret_of(str(folder)) else None  # without a secret no hub hears other hosts


async def _mission_file(bus: Bus) -> str:
    try:
        return (await bus.ask(LAUNCHER, AskTree(), Tree, within_s=REPLY_TIME_S)).text
    except (LinkError, Refusal) as error:
        say(f"the mission file is not in the recording: {error}")
        return ""


async def _mission_time(bus: Bus) -> MissionTime:
    """Return the nameserver's time, whose clocks are the same for all recorders; if it is silent, none is known."""
    try:
        return await bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=REPLY_TIME_S)
    except (LinkError, Refusal):
        return MissionTime(0.0, 1.0)


def _begun(told: MissionTime, clock: MissionClock) -> datetime:
    """Return the time of day of mission time 0, by the present clock of the nameserver's machine if it is known."""
    if told.unix_s:
        return datetime.fromtimestamp(told.unix_s - told.at_s / told.rate).astimezone()
    return datetime.now().astimezone() - timedelta(seconds=clock.now_s() / clock.rate)


async def _about(bus: Bus, clock: MissionClock, keys: list[str]) -> dict[str, str]:
    told = await _mission_time(bus)
    facts = {
        "mission": bus.mission,
        "begun": _begun(told, clock).isoformat(timespec="milliseconds"),
        "clock_rate": f"{clock.rate:g}",
        "recorded_on": socket.gethostname(),
        "recorded_keys": " ".join(keys) or "all",
        "python": sys.version.partition(" ")[0],
    }
    if told.clock_origin_monotonic_s:
        facts["start"] = repr(told.clock_origin_monotonic_s)
    for package in VERSIONS_OF:
        with suppress(PackageNotFoundError):
            facts[package] = version(package)
    return facts


@contextmanager
def new_files(path: Path, keep: int) -> Iterator[RecordingFiles]:
    """Make the first file of a recording, and close its files at the end.

    Raises:
        FileUnusable: The file exists, cannot be written, or has a path that no message can contain.
    """
    try:
        str(path.absolute()).encode()  # beats name the file
        files = RecordingFiles(path, keep)
    except UnicodeEncodeError as error:
        raise FileUnusable(
            f"the path {str(path.absolute())!r} has a byte that is no UTF-8", remedy="Name a file whose path is UTF-8."
        ) from error
    except FileExistsError as error:
        raise existing(path) from error
    except OSError as error:
        raise FileUnusable(f"{path} cannot be written: {error.strerror or error}") from error
    try:
        yield files
    finally:
        with suppress(OSError):  # the disc is full, which the recorder has reported
            files.close()


async def recover_to(path: Path, to: Path) -> ExitCode:
    """Write all readable messages to a new file, read it back, and print their number."""
    try:
        with interruptible():
            done = recover_file(path, to)
    except FileExistsError as error:
        raise existing(to) from error
    except OSError as error:
        raise unwritable(error.filename or to, error) from error
    with opened(to) as made:
        assert made.contents().messages == done.messages  # noqa: S101  what was written can be read
    without = f", without {counted(done.damaged, 'damaged part')} of {path}" if done.damaged else ""
    unread = f"; the last {counted(done.unread_bytes, 'byte')} of {path} cannot be read" if done.unread_bytes else ""
    say(f"{to}: {counted(done.messages, 'message')}{without}{unread}")
    return ExitCode.DONE


async def print_info(path: Path, *, as_json: bool) -> ExitCode:
    """Print facts about the mission, times and numbers."""
    with opened(path) as recording:
        found = recording.contents()
    facts = found.about | {
        "begin_s": found.begin_s,
        "end_s": found.end_s,
        "messages": found.messages,
        "keys": len({one.key for one in found.counts}),
        "bytes": _size(path),
    }
    if as_json:
        show([json.dumps(facts)])
        return ExitCode.DONE
    for name, value in facts.items():
        show([f"{name:16s} {value:.3f}" if isinstance(value, float) else f"{name:16s} {value}"])
    return ExitCode.DONE


async def check_whole(path: Path, *, as_json: bool) -> ExitCode:
    """Print which senders' messages are missing, how many, and which clocks were off."""
    observer = ClockObserver()
    with opened(path) as recording:
        found, missing = recording.contents(), missing_numbers(observer.watched(recording.messages()))
    clocks = observer.offsets()
    if as_json:
        show([json.dumps({"messages": found.messages, "missing": missing, "clocks": clocks_json(clocks)})])
    else:
        show([f"{counted(found.messages, 'message')}, as they were written"])
        show(f"{count:8d} missing from {source}" for source, count in missing.items())
        show(f"{line}; 'record join' corrects it" for line in clock_lines(clocks))
    return ExitCode.DONE


async def print_keys(path: Path, *, as_json: bool) -> ExitCode:
    """Print a line for each key, sender and schema."""
    with opened(path) as recording:
        found = recording.contents()
    lasted_s = found.end_s - found.begin_s
    if as_json:
        show(json.dumps(plain(one)) for one in found.counts)
        return ExitCode.DONE
    show(
        f"{one.messages:8d} {_rate(one.messages, lasted_s)}  {one.key or 'several keys'}  {one.schema or 'no message'}"
        + ("" if one.key.split("/", 2)[-1].startswith(one.source) else f"  from {one.source}")
        for one in found.counts
    )
    return ExitCode.DONE


def _rate(messages: int, lasted_s: float) -> str:
    """Return messages a second; messages of a moment have no rate."""
    return f"{messages / lasted_s:9.2f}/s" if lasted_s >= SHORTEST_RATED_S else f"{'-':>9s}  "


async def print_messages(
    path: Path, keys: tuple[str, ...], since_s: float, until_s: float | None, most: int, *, as_json: bool
) -> ExitCode:
    """Print a line for each message, at most ``most``; the file is read no further than that."""
    found = 0
    with opened(path) as recording:
        for found, message in enumerate(recording.messages(keys, since_s, until_s), 1):
            if found > most:
                say("later messages are left out; see --most, --since and --keys")
                break
            show([json.dumps(message_json(message)) if as_json else message_line(message)])
    if not found:
        say("no message")
    return ExitCode.DONE


def _events_of(recording: Recording, reviver: Reviver) -> Iterator[StoryEvent]:
    """Yield the events of the recording, and its operators' actions as events."""
    for message in recording.messages((f"*/{Conversation.LOG}", f"*/{Conversation.OPERATORS}")):
        match reviver.revived(message, StoryEvent, OperatorActed):
            case StoryEvent() as event:
                yield event
            case OperatorActed() as act:
                yield act.event(message.source, message.cause)


async def print_events(path: Path, name: str, since_s: float, until_s: float | None, *, as_json: bool) -> ExitCode:
    """Print all events about a name, as the live mission would print those that it keeps."""
    asked, reviver = AskLog(since_s, FOR_EVER_S if until_s is None else until_s, name), Reviver()
    with opened(path) as recording:
        events = printable_all(chosen(_events_of(recording, reviver), asked))
    show([json.dumps(event_json(event)) for event in events] if as_json else story_lines(events))
    if not events:
        say(f"no event about {name}" if name else "no event")
    if reviver.unread:
        say(f"incomplete: {counted(reviver.unread, 'message')} of another form cannot be read")
    return ExitCode.DONE


async def print_mission_file(path: Path) -> ExitCode:
    """Print the mission file."""
    with opened(path) as recording:
        text = recording.mission_xml()
    if not text:
        say("the recording has no mission file")
        return ExitCode.REFUSED
    show(text.splitlines())
    return ExitCode.DONE


def _size(path: Path) -> int:
    return path.stat().st_size
