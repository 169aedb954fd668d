"""Cost of debug views: pictures a second of a watcher whose views no console shows, and of one without views.

Two watchers get the same noisy pictures of a room with a moving body, as ``see`` gets them; they take turns, picture
by picture. Times are of the process, one core. Prints one JSON line; ``ratio`` is pictures a second with views that no
console shows, over those without views; ``ratio_looked_at`` is the same while a console shows every view.
"""

from __future__ import annotations

import argparse
import asyncio
import time
from collections.abc import Callable, Coroutine

import cv2
import numpy as np
from measuring import report

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.debug_views import LONGEST_LOOK_S, LookAt, ViewKind
from backbone.naming import Subsystem
from mission_control.behaviors.watch_for_motion import WatchForMotion
from resource_pool.arc_client import Frame

WIDTH_PX, HEIGHT_PX, BLOCK_PX = 320, 240, 50
NOISE = 6.0  # grey levels; a link of 25 dB
ROUNDS = 5


class WithoutViews(WatchForMotion):
    """The floor: the same decisions, without views."""

    def _show_stages(self) -> None:
        pass


def filmed(count: int) -> list[Frame]:
    """Return pictures of a room in which a block goes from left to right."""
    rng = np.random.default_rng(7)
    furniture = rng.integers(40, 200, (6, 8)).astype(np.float32)
    room = cv2.resize(furniture, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST)
    frames = []
    for number in range(count):
        seen = room + rng.normal(0.0, NOISE, room.shape)
        left = 4 * number % (WIDTH_PX - BLOCK_PX)
        seen[100 : 100 + BLOCK_PX, left : left + BLOCK_PX] = 250.0
        pixels = memoryview(np.clip(seen, 0, 255).astype(np.uint8).tobytes())
        frames.append(Frame("grabber", "arc", 1, "scout", number, number / 15, WIDTH_PX, HEIGHT_PX, pixels))
    return frames


def watcher(kind: Callable[[Launch, Bus, Clock], WatchForMotion], name: str, network: LocalNetwork) -> WatchForMotion:
    """Return a watcher that is not started; the caller passes it the pictures."""
    clock = MissionClock.started_now()
    launch = Launch(
        network.mission, Subsystem.MISSION_CONTROL, name, "watch", "here", "here", "", clock.origin_monotonic_s, 1.0
    )
    made = kind(launch, network.join(launch.address, clock), clock)
    made.tell_parent = lambda _payload: None  # type: ignore[method-assign]
    made.start_task = _never  # type: ignore[method-assign,assignment]
    return made


def _never(work: Coroutine[object, None, None], name: str) -> None:
    """Close the work, because no ARC exists that could be asked for more time."""
    del name
    work.close()


def turns_s(one: WatchForMotion, other: WatchForMotion, frames: list[Frame]) -> tuple[float, float]:
    """Pass each picture to both; return the process's seconds for each watcher."""
    took = [0, 0]
    for number, frame in enumerate(frames):
        both = (0, one), (1, other)
        for place, watching in both if number % 2 else reversed(both):
            began = time.process_time_ns()
            watching.see(frame)
            took[place] += time.process_time_ns() - began
    return took[0] / 1e9, took[1] / 1e9


async def measure(count: int) -> None:
    """Measure and report."""
    network = LocalNetwork("bench")
    frames = filmed(count)
    viewed, bare = watcher(WatchForMotion, "viewed", network), watcher(WithoutViews, "bare", network)
    turns_s(viewed, bare, frames[:100])
    unseen = [turns_s(viewed, bare, frames) for _ in range(ROUNDS)]
    entries = viewed.views.listed().views
    assert entries, "the watcher judged no picture"
    for entry in entries:
        viewed.views.look(LookAt(entry.view, LONGEST_LOOK_S))
    looked = turns_s(viewed, bare, frames)
    await asyncio.sleep(0)
    viewed_s, bare_s = (sum(times) for times in zip(*unseen, strict=True))
    report(
        "debug_views",
        pictures=count * ROUNDS,
        views=len(entries),
        pictures_shown=sum(entry.kind is ViewKind.PICTURE for entry in entries),
        pictures_a_second=round(count * ROUNDS / viewed_s),
        pictures_a_second_without_views=round(count * ROUNDS / bare_s),
        ratio=round(bare_s / viewed_s, 4),
        ratio_looked_at=round(looked[1] / looked[0], 4),
    )
    await asyncio.gather(viewed.leave_bus(), bare.leave_bus())


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1500)
    cv2.setNumThreads(1)
    asyncio.run(measure(parser.parse_args().frames))


if __name__ == "__main__":
    main()
