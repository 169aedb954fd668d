"""Cost of three videos in a browser while their mission runs: ``bench/web_console.py [SECONDS [PICTURES_PER_S]]``.

Starts the shipped mission with three video frequencies, so that three behaviors see at once, and ``scout-console
serve`` beside it. A client watches all three and, like a page, confirms each picture as soon as it arrives. The claim:
15 pictures of 320 × 240 a second of each, at a small share of one core, a moment after they were taken. A rate counts
the pictures from the first to the last one; ``longest_gap_ms`` shows whether they came steadily.
"""

from __future__ import annotations

import asyncio
import json
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import psutil
from console import percent
from measuring import BIN, MISSION_XML, busy_s, percentile, report
from missions import RealMission, mission_up, own_processes
from websockets.asyncio.client import ClientConnection, connect

from backbone.bus.clock import MissionClock

ROBOTS = ("scout1", "scout2", "scout3")
SETTLE_S = 8.0  # chosen: behaviors have their robots, and the first pictures are over


def with_three_frequencies(mission: str, pictures_per_s: float) -> str:
    """Return the shipped mission with a frequency, a framegrabber of this rate and a watcher for each robot."""
    text = re.sub(r'(name="frame_rate_hz" value=")[^"]*', rf"\g<1>{pictures_per_s:g}", mission)
    for kind, names in (("video_frequency", ("video1", "video2", "video3")), ("framegrabber", ("grabber",))):
        found = re.search(rf'    <resource type="{kind}" name="\w+"[^>]*?(?:/>|[^/]>.*?</resource>)\n', text, re.DOTALL)
        assert found is not None
        one = found[0]
        if kind == "framegrabber":
            many = "".join(
                one.replace('name="grabber"', f'name="grabber{n}"').replace('"video1"', f'"video{n}"')
                for n in (1, 2, 3)
            )
        else:
            many = "".join(one.replace('name="video1"', f'name="{name}"') for name in names)
        text = text.replace(one, many)
    for number in (2, 3):
        robot = re.search(rf'<resource type="scout" name="scout{number}".*?</resource>', text, re.DOTALL)
        assert robot is not None
        text = text.replace(robot[0], robot[0].replace('"video1"', f'"video{number}"'))
    watcher = re.search(r'      <behavior type="watch_for_motion" name="watch-scout2".*?</behavior>\n', text, re.DOTALL)
    assert watcher is not None
    return text.replace(watcher[0], watcher[0] + watcher[0].replace("scout2", "scout3"))


class Watcher:
    """Counts arrivals."""

    def __init__(self, socket: ClientConnection, clock: MissionClock) -> None:
        self._socket, self._clock = socket, clock
        self.is_counting = False
        self.arrived_s: dict[str, list[float]] = {robot: [] for robot in ROBOTS}
        self.ages_s: list[float] = []
        self.received_bytes = 0
        self.drawn_s: dict[str, float] = {}
        self._own: dict[str, Any] = {}
        self._own_changed = asyncio.Event()

    async def take_over(self) -> float:
        """Take scout1 from its behavior and release it; return the ms from the wish until the client knows of it."""
        asked_s = time.perf_counter()
        await self._socket.send('{"do":"take","robot":"scout1"}')
        await self._wait_own(lambda own: own["is_held"])
        took_s = time.perf_counter() - asked_s
        await self._socket.send('{"do":"release"}')
        await self._wait_own(lambda own: not own["is_asked"])
        return round(1000 * took_s, 1)

    async def _wait_own(self, is_so: Callable[[dict[str, Any]], bool]) -> None:
        async with asyncio.timeout(10.0):
            while not is_so(self._own):
                self._own_changed.clear()
                await self._own_changed.wait()

    async def listen(self) -> None:
        """Confirm each picture as drawn, until cancelled."""
        async for message in self._socket:
            self.received_bytes += len(message) * self.is_counting
            if isinstance(message, str):
                view = json.loads(message).get("view", {})
                self.drawn_s = view.get("drawn", self.drawn_s)
                self._own = view.get("own", self._own)
                self._own_changed.set()
                continue
            robot = message[1 : 1 + message[0]].decode()
            number, captured_s = struct.unpack_from(">Id", message, 1 + message[0])
            await self._socket.send(json.dumps({"do": "drawn", "robot": robot, "number": number}))
            if self.is_counting:
                self.arrived_s[robot].append(time.monotonic())
                self.ages_s.append(self._clock.now_s() - captured_s)


def rate_hz(times_s: list[float]) -> float:
    """Return the rate a second from the first time to the last.

    Example:
        >>> rate_hz([0.0, 0.1, 0.2]), rate_hz([1.0])
        (10.0, 0.0)
    """
    return round((len(times_s) - 1) / (times_s[-1] - times_s[0]), 2) if len(times_s) > 1 else 0.0


def longest_gap_ms(times_s: list[float]) -> float:
    """Return the longest gap between neighboring times."""
    return round(1000 * max(later - earlier for earlier, later in pairwise(times_s)), 1)


async def watch(running: RealMission, port: int, token: str, server: psutil.Process, lasts_s: float) -> dict[str, Any]:
    """Watch all robots for this time; return the measurements."""
    clock = running.clock
    async with connect(f"ws://127.0.0.1:{port}/socket", compression=None, proxy=None) as socket:
        await socket.send(json.dumps({"do": "hello", "token": token, "user": "bench"}))
        watcher = Watcher(socket, clock)
        listening = asyncio.create_task(watcher.listen())
        await clock.sleep_s(SETTLE_S)
        await socket.send(json.dumps({"do": "watch", "robots": ROBOTS}))
        await clock.sleep_s(1.0)
        mission = own_processes(running)
        watcher.is_counting = True
        began_s, own_s, mission_s = time.monotonic(), busy_s([server]), busy_s(mission)
        await clock.sleep_s(lasts_s)
        took_s = time.monotonic() - began_s
        watcher.is_counting = False
        measured = {
            "serving_cpu_percent": percent(busy_s([server]) - own_s, took_s),
            "mission_cpu_percent": percent(busy_s(mission) - mission_s, took_s),
            "pictures_per_s": {robot: rate_hz(times_s) for robot, times_s in watcher.arrived_s.items()},
            "longest_gap_ms": {
                robot: longest_gap_ms([began_s, *times_s, began_s + took_s])
                for robot, times_s in watcher.arrived_s.items()
            },
            "age_p50_ms": round(1000 * percentile(watcher.ages_s or [0.0], 0.5), 1),
            "age_p99_ms": round(1000 * percentile(watcher.ages_s or [0.0], 0.99), 1),
            "shown_latency_ms": {robot: round(1000 * at_s, 1) for robot, at_s in watcher.drawn_s.items()},
            "sent_kb_s": round(watcher.received_bytes / took_s / 1000, 1),
            "memory_mb": round(server.memory_info().rss / 1e6, 1),
        }
        measured["take_over_ms"] = [await watcher.take_over() for _ in range(4)]
        listening.cancel()
        await asyncio.wait({listening})
        return measured


def main(lasts_s: float = 15.0, pictures_per_s: float = 15.0) -> None:
    """Print one JSON line."""
    with mission_up(with_three_frequencies(MISSION_XML.read_text(), pictures_per_s)) as running:
        serving = subprocess.Popen(
            [str(BIN / "scout-console"), "serve", "--port", "0"], stdout=subprocess.PIPE, text=True
        )
        try:
            assert serving.stdout is not None
            found = re.fullmatch(r"http://[^:]+:(\d+)/#token=(\S+)\n", serving.stdout.readline())
            assert found is not None
            server = psutil.Process(serving.pid)
            report("web_console", **asyncio.run(watch(running, int(found[1]), found[2], server, lasts_s)))
        finally:
            serving.terminate()
            serving.wait(10)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
