"""How close a replay is to what was recorded: when each publication comes, and in which order.

Records the mission of IROS 2001 for some seconds unless given a recording, plays it beside a listener, and compares.
Prints one JSON line for each speed: ``late_ms`` is how much later than recorded publications are heard, with the time
on the bus; ``missing`` counts those that never were, though the listener was there; ``other_order`` those that came
before an earlier one of their key and sender (of others urgent ones may). Times of the machine.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

import zenoh
from measuring import BIN, MISSION_XML, percentile, report

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import client_config, open_session
from backbone.keys import COPIED, ROOT, Conversation
from backbone.recording.hearing import Hearing
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recording

BEFORE_S = 3.0  # chosen: the listener is there before the first message; seconds of the machine
KNOWN_S = 0.1  # measured: a publisher knows of its first subscriber after 7 ms; seconds of the machine
AFTER_S = 2.0  # chosen: the last message is long over; seconds of the machine
HEARD = tuple(one for one in Conversation if one not in {Conversation.ASK, Conversation.ALIVE, *COPIED})
MISSION = "replay-bench"
Sent = tuple[str, str, int]
"""Key without the mission, source, number."""


def record(to: Path, seconds: float) -> None:
    """Record a mission from its first message to its last."""
    command = ["up", str(MISSION_XML), "--headless", "--record", str(to), "--for", str(seconds)]
    subprocess.run([str(BIN / "scout-backbone"), *command], check=True, stderr=subprocess.DEVNULL)


def short(key: str) -> str:
    """Return the key without the mission."""
    return key.split("/", 2)[-1]


def sent_in(path: Path) -> dict[Sent, float]:
    """Return the publications of a recording, with their mission times."""
    with path.open("rb") as file:
        messages = Recording(file).messages(tuple(f"*/{one}" for one in HEARD))
        return {(short(one.key), one.source, one.sequence): one.at_s for one in messages if one.source}


def play(path: Path, sent: dict[Sent, float], speed: float) -> tuple[float, list[tuple[Sent, float]]]:
    """Play the recording; return when the listener was there, and what it heard in order, with mission times."""
    since_s = min(sent.values()) - BEFORE_S * speed
    words = ["replay", str(path), f"--from={since_s}", "--speed", str(speed), "--mission", MISSION]
    with subprocess.Popen([str(BIN / "scout-backbone"), *words], stderr=subprocess.PIPE) as player:
        assert player.stderr is not None
        player.stderr.readline()
        try:
            return listen(max(sent.values()) + AFTER_S * speed)
        finally:
            player.terminate()


def listen(until_s: float) -> tuple[float, list[tuple[Sent, float]]]:
    """Listen until this mission time; see ``play``. Not by a ``Bus``, which gathers what is overheard."""
    run = run_files.find(MISSION)
    clock = MissionClock(run.clock_origin_monotonic_s, run.clock_rate)
    came = list[tuple[zenoh.Sample, float]]()
    session = open_session(client_config(run.endpoint))
    session.declare_subscriber(f"{ROOT}/{MISSION}/**", lambda sample: came.append((sample, clock.now_s())))
    there_s = clock.now_s() + KNOWN_S * clock.rate
    gc.collect()
    gc.freeze()
    asyncio.run(clock.sleep_until_s(until_s))
    session.close()  # type: ignore[no-untyped-call]
    hearing = Hearing(message_classes())
    return there_s, [
        ((short(at), one.source, one.sequence), now_s)
        for sample, now_s in came
        for at, one in hearing.heard(str(sample.key_expr), sample.payload.to_bytes(), now_s)
    ]


def compare(sent: dict[Sent, float], heard: list[tuple[Sent, float]], speed: float) -> None:
    """Print how close what was heard is to what was sent while the listener was there."""
    first = {one: at_s for one, at_s in reversed(heard) if one in sent}
    late_ms = [1e3 * (at_s - sent[one]) / speed for one, at_s in first.items()]
    newest, other_order = defaultdict[tuple[str, str], int](int), 0
    for key, source, number in (one for one, _at_s in heard if one in sent):
        other_order += number < newest[key, source]
        newest[key, source] = max(newest[key, source], number)
    of_first = min(sent, key=lambda one: sent[one])
    report(
        "replay",
        speed=speed,
        publications=len(sent),
        missing=len(sent.keys() - first.keys()),
        first_late_ms=round(1e3 * (first[of_first] - sent[of_first]) / speed, 2) if of_first in first else None,
        late_p50_ms=round(percentile(late_ms, 0.5), 2),
        late_p99_ms=round(percentile(late_ms, 0.99), 2),
        late_most_ms=round(max(late_ms), 2),
        other_order=other_order,
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--speeds", type=float, nargs="+", default=[1.0, 10.0])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        path = given.recording or Path(folder) / "it.mcap"
        if given.recording is None:
            record(path, given.seconds)
        sent = sent_in(path)
        for speed in given.speeds:
            there_s, heard = play(path, sent, speed)
            compare({one: at_s for one, at_s in sent.items() if at_s >= there_s}, heard, speed)


if __name__ == "__main__":
    main()
