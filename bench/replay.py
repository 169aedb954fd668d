"""Accuracy of a replay: time and order of each publication, compared with the recording.

Records the mission of IROS 2001 for some seconds unless given a recording, plays it beside a listener, and compares.
Prints one JSON line for each speed: ``late_ms`` is the delay of received publications, including the time on the bus;
``missing`` counts publications that did not arrive although the listener was ready; ``other_order`` those that arrived
before an earlier one of their key and sender (publications of other keys may overtake, if urgent). Times are of the
machine. The floor is a process that only publishes as many bytes at these times on bare zenoh, beside a listener.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import zenoh
from measuring import BIN, MISSION_XML, percentile, report

from backbone import run_files
from backbone.bus.clock import MissionClock, PunctualClock
from backbone.bus.zenoh_bus import client_config, hub_config, open_session
from backbone.keys import COPIED, ROOT, Conversation
from backbone.recording.hearing import Hearing
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recording

BEFORE_S = 3.0  # chosen: the listener is ready before the first message; seconds of the machine
KNOWN_S = 0.1  # measured: a publisher knows of its first subscriber after 7 ms; seconds of the machine
AFTER_S = 2.0  # chosen: the last message has long arrived; seconds of the machine
HEARD = tuple(one for one in Conversation if one not in {Conversation.ASK, Conversation.ALIVE, *COPIED})
MISSION = "replay-bench"
SHARES = {"p50": 0.5, "p99": 0.99}
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
    """Play the recording; return when the listener was ready, and the messages that it received, with mission times."""
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
    """Listen until this mission time; see ``play``. Uses no ``Bus``, because a bus batches overheard messages."""
    run = run_files.find(MISSION)
    clock = MissionClock(run.clock_origin_monotonic_s, run.clock_rate)
    came = list[tuple[zenoh.Sample, float]]()
    session = open_session(client_config(run.endpoint))
    for conversation in HEARD:
        pattern = f"{ROOT}/{MISSION}/*/*/{conversation}"
        session.declare_subscriber(pattern, lambda sample: came.append((sample, clock.now_s())))
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


def bare_late_ms(path: Path, speed: float) -> list[float]:
    """Return the delays of publications with the same sizes at the same times on bare zenoh."""
    with path.open("rb") as file:
        messages = Recording(file).messages(tuple(f"*/{one}" for one in HEARD))
        due = [(one.at_s / speed, len(json.dumps(one.body, default=str))) for one in messages if one.source]
    first_s = due[0][0]
    endpoint, came = f"unixsock-stream/{path.parent}/floor.sock", list[float]()
    with zenoh.open(hub_config([endpoint])) as hub:
        hub.declare_subscriber("floor", lambda _sample: came.append(time.monotonic()))
        words = [sys.executable, __file__, "--publish", endpoint]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as publisher:
            said, _none = publisher.communicate("".join(f"{at_s - first_s} {size}\n" for at_s, size in due))
    begun_s = float(said)
    return [1e3 * (at_s - begun_s - due_s + first_s) for at_s, (due_s, _size) in zip(came, due, strict=True)]


def publish(endpoint: str) -> None:
    """Publish bytes at the times read from standard input; print when the first was due."""
    due = [(float(at_s), bytes(int(size))) for at_s, size in map(str.split, sys.stdin)]
    with zenoh.open(client_config(endpoint)) as session:
        publisher = session.declare_publisher("floor", congestion_control=zenoh.CongestionControl.BLOCK)
        clock = PunctualClock(time.monotonic() + BEFORE_S)
        gc.collect()
        gc.disable()

        async def publish_all() -> None:
            for at_s, raw in due:
                await clock.sleep_until_s(at_s)
                publisher.put(raw)

        asyncio.run(publish_all())
    print(clock.origin_monotonic_s)


def compare(sent: dict[Sent, float], heard: list[tuple[Sent, float]], speed: float, floor_ms: list[float]) -> None:
    """Print the delays and losses while the listener was ready, beside the floor."""
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
        floor="bare zenoh, bytes made before",
        **{f"floor_{name}_ms": round(percentile(floor_ms, share), 2) for name, share in SHARES.items()},
        floor_most_ms=round(max(floor_ms), 2),
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--speeds", type=float, nargs="+", default=[1.0, 10.0])
    parser.add_argument("--publish", metavar="ENDPOINT", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.publish:
        publish(given.publish)
        return
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        path = given.recording or Path(folder) / "it.mcap"
        if given.recording is None:
            record(path, given.seconds)
        sent = sent_in(path)
        for speed in given.speeds:
            there_s, heard = play(path, sent, speed)
            floor_ms = bare_late_ms(path, speed)
            compare({one: at_s for one, at_s in sent.items() if at_s >= there_s}, heard, speed, floor_ms)


if __name__ == "__main__":
    main()
