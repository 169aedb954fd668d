"""The work of ``scout-backbone replay`` and ``scout-backbone recording why``."""

from __future__ import annotations

import asyncio
import gc
import json
import os
import signal
import socket
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

import msgspec

from backbone import run_files
from backbone.authentication import socket_endpoint
from backbone.bus.clock import PunctualClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.command_line.comparing import print_comparison
from backbone.command_line.message_lines import message_line
from backbone.command_line.opened_recording import opened, require_selected
from backbone.component.class_path import load_class
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode, say, show
from backbone.launcher.preconditions import refuse_if_up
from backbone.naming import MAX_NAME_LENGTH, Subsystem, legal
from backbone.recording.comparison import compared
from backbone.recording.decisions import DecisionComparison, OtherDecision, decided_anew
from backbone.recording.known_messages import message_classes
from backbone.recording.playback import NoSuchTime
from backbone.recording.player import Player
from backbone.recording.reader import Contents, Recorded, Recording
from backbone.recording.reasons import reasons_at
from backbone.recording.rerun import RealComponent, classes_of, launch_of, run_again
from backbone.recording.revival import with_names
from backbone.scheduling.events import Record
from backbone.spoken import counted
from backbone.waiting import first_to_end, in_thread_within
from backbone.wire import Message, plain

REPLAY = "replay"
COLLECT_GAP_S = 0.03  # chosen: a multiple of a collection's duration; nearly every mission has such gaps
COLLECT_EACH_S = 2.0  # chosen: the garbage of two seconds is collected within a millisecond or two
LEAD_S = 0.05  # chosen: writing a run file takes less; seconds of the machine


async def run_without(
    path: Path,
    names: Sequence[str],
    class_path: str,
    parameters: dict[str, Any],
    tolerances: dict[str, float],
    *,
    as_json: bool,
) -> ExitCode:
    """Run components for real on the recording, and compare their messages with those of the recorded ones.

    Args:
        class_path: Path of another class, of a single component; empty: the recorded class.
        parameters: Parameters of a single component that differ from the recorded ones.
        tolerances: See ``compared``.
    """
    with opened(path) as recording:
        components, classes = list[RealComponent](), dict[str, type[Message]]()
        for name in names:
            launch = launch_of(recording, message_classes(), name)
            launch = msgspec.structs.replace(
                launch, class_path=class_path or launch.class_path, parameters={**launch.parameters, **parameters}
            )
            say(f"runs {launch.class_path} as {name} on {path}")
            components.append(RealComponent(launch, load_class(launch.class_path)))
            classes |= classes_of(launch)
        rerun = await in_thread_within(partial(run_again, recording, classes, components), None)
        sources = {launch.address for launch, _kind in components}
        recorded = (with_names(classes, one) for one in recording.messages() if one.source in sources)
        result = print_comparison(compared(recorded, rerun.said, tolerances), as_json=as_json)
    for name, bug in rerun.fell.items():
        say(f"{name} failed: {type(bug).__name__}: {bug}")
    return ExitCode.REFUSED if rerun.fell else result


async def print_reasons_at(path: Path, name: str, at_s: float | None, *, as_json: bool) -> ExitCode:
    """Print the reasons for a state at a mission time; None: at the end.

    Raises:
        NoSuchTime: The recording had ended.
    """
    with opened(path) as recording:
        found = recording.contents()
        asked_s = found.end_s if at_s is None else at_s
        _require_recorded(asked_s, found)
        reasons = reasons_at(recording, name, asked_s)
    show([json.dumps({"at_s": asked_s} | reasons.to_json())] if as_json else reasons.lines(asked_s))
    return ExitCode.DONE


async def decide_anew(path: Path, since_s: float, rules: dict[str, Any], *, as_json: bool) -> ExitCode:
    """Let today's scheduler decide on the recorded events; print the first decision that differs from the recording.

    Raises:
        NoSuchTime: The recording had ended.
    """
    with opened(path) as recording:
        _require_recorded(since_s, recording.contents())
        found = decided_anew(recording, since_s, **rules)
    if as_json:
        show([json.dumps(_json(found))])
    elif found.difference is not None:
        show(_lines(found.difference))
    made = f"{counted(found.decisions, 'decision')} made anew, {counted(found.grants, 'grant')} among them"
    say(f"{made}: {'all as recorded' if found.difference is None else 'the last one is not as recorded'}")
    if found.missing:
        say(f"not compared, because incomplete in the recording: {counted(found.missing, 'decision')}")
    if found.unread:
        say(f"incomplete: {counted(found.unread, 'message')} of another form cannot be read")
    return ExitCode.DONE if found.difference is None else ExitCode.REFUSED


@dataclass(frozen=True)
class Playing:
    """How a recording is played.

    Attributes:
        mission: Name of the replay; None: ``replay-`` and the mission's name, so that commands cannot confuse the two.
        since_s: Mission time at which the replay begins; None: with the first message.
        speed: Mission seconds per second of the machine.
        is_stepped: True: each message waits for a line from standard input.
        keys: Patterns of the keys whose publications are played; none: all.
    """

    mission: str | None
    since_s: float | None
    speed: float
    is_stepped: bool
    keys: tuple[str, ...]


async def play(path: Path, wanted: Playing) -> ExitCode:
    """Play a recording as a mission that is up, until a person ends it."""
    with opened(path) as recording:
        require_selected(recording, path, wanted.keys)
        found = recording.contents()
        name = legal(wanted.mission or f"{REPLAY}-{found.about.get('mission', '')}".strip("-")[:MAX_NAME_LENGTH])
        refuse_if_up(name)
        with run_files.own_folder(name) as directory:
            await _play_in(directory, name, path, recording, found, wanted)
    return ExitCode.DONE


async def _play_in(
    directory: Path, name: str, path: Path, recording: Recording, found: Contents, wanted: Playing
) -> None:
    since_s = found.begin_s if wanted.since_s is None else wanted.since_s
    _require_recorded(since_s, found)
    endpoint, clock = socket_endpoint(directory), PunctualClock(time.monotonic() - since_s / wanted.speed, wanted.speed)
    bus = await ZenohBus.open_when_up(name, f"{Subsystem.BACKBONE}/{REPLAY}", clock, hub_config([endpoint]))
    ended, loop = asyncio.Event(), asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGTERM, ended.set)
    player = Player(
        bus,
        clock,
        recording,
        message_classes(),
        since_s=since_s,
        keys=wanted.keys,
        next_step=_asked_for_step if wanted.is_stepped else None,
    )
    player.ends, player.rests = ended.set, _Collector().collect
    player.announces = partial(_announce, bus, clock, f"plays {path.name} from {since_s:.3f} s on")
    try:
        player.catch_up()
        loop.add_signal_handler(signal.SIGINT, ended.set)  # before, Ctrl-C ends the reading of earlier messages
        player.begin()
        gc.collect()
        gc.freeze()  # collecting all imported objects takes tens of milliseconds (measured)
        gc.disable()  # and a collection of decoded messages takes milliseconds, at any time
        clock.set_to(since_s - LEAD_S * wanted.speed)
        run_files.write(
            run_files.RunFile(
                mission=name,
                endpoint=endpoint,
                launcher_pid=os.getpid(),
                clock_origin_monotonic_s=clock.origin_monotonic_s,
                clock_rate=clock.rate,
                host=socket.gethostname(),
                source=str(path),
            )
        )
        say(f"plays {path} from {since_s:.3f} s on as mission {name}; Ctrl-C ends it")
        await first_to_end(_play_to_end(player), ended.wait())
    finally:
        gc.enable()
        await bus.close()


def _require_recorded(at_s: float, found: Contents) -> None:
    """Return if the recording has not ended by this mission time.

    Raises:
        NoSuchTime: It has ended.
    """
    if at_s > max(found.end_s, round(found.end_s, 3)):  # 'recording info' rounds it
        raise NoSuchTime(f"the recording ends at {found.end_s:.3f} s", remedy="Name an earlier time.")


def _announce(bus: Bus, clock: Clock, what: str) -> None:
    bus.publish(bus.source, Conversation.LOG, StoryEvent(clock.now_s(), bus.source, what, REPLAY, ""))


class _Collector:
    """Collects garbage in the pauses of a recording."""

    def __init__(self) -> None:
        self._next_s = time.monotonic() + COLLECT_EACH_S

    def collect(self, gap_s: float) -> None:
        """Collect the garbage of the last seconds, if the gap is long enough."""
        now_s = time.monotonic()
        if gap_s > COLLECT_GAP_S and now_s >= self._next_s:
            gc.collect(0)
            self._next_s = now_s + COLLECT_EACH_S


async def _play_to_end(player: Player) -> None:
    await player.run()
    gc.enable()
    without = f", without {player.left_out} of a form that no class here has" if player.left_out else ""
    say(f"the recording is over, {counted(player.played, 'publication')}{without}; questions are still answered")
    await asyncio.Event().wait()


async def _asked_for_step(message: Recorded) -> None:
    """Print the next message, and return when a line was read."""
    try:
        show([message_line(message)])
    except KeyboardInterrupt:
        signal.raise_signal(signal.SIGINT)  # to the replay, which it ends in good order as it does between two lines
    if not await in_thread_within(_read_line, None):
        await asyncio.Event().wait()


def _read_line() -> bytes:
    """Return the next line from standard input; empty: it has ended.

    Python's own reader would hold its lock while the process ends, which then aborts.
    """
    line = b""
    while not line.endswith(b"\n") and (one := os.read(sys.stdin.fileno(), 1)):
        line += one
    return line


def _lines(difference: OtherDecision) -> list[str]:
    event = f"{type(difference.event).__name__} {json.dumps(plain(difference.event))}"
    pairs = zip(difference.recorded, difference.decided, strict=False)
    count = sum(1 for _pair in takewhile(lambda pair: pair[0].line == pair[1].line, pairs))
    return [
        f"decision {difference.number} at {difference.at_s:.3f} s, on {event}",
        f"  recorded, after {counted(count, 'line')} that both have:",
        *(map(_line, difference.recorded[count:]) if difference.recorded[count:] else ["    nothing"]),
        "  decided now:",
        *(map(_line, difference.decided[count:]) if difference.decided[count:] else ["    nothing"]),
    ]


def _line(record: Record) -> str:
    line = {name: value for name, value in record.line.items() if name not in {"ev", "t"}}
    return f"    {record.line['ev']} {json.dumps(line)}{f'  because {record.cause}' if record.cause else ''}"


def _json(found: DecisionComparison) -> dict[str, object]:
    return {**plain(found), "event": type(found.difference.event).__name__ if found.difference else None}
