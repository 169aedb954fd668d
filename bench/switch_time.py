"""A context switch on real processes: from the revocation of one ARC to the grant of the next.

Runs the mission of IROS 2001, figure 2, with short slices, and reads the RC manager's measurements: the gate closes,
four RCs disconnect, four connect, the ARC prepares and opens. The settling time of the picture belongs to the mission
and is not counted; work during that time does not show.

Variants, which can be combined:

* ``--no-settling``: the picture settles at once, so that the whole chain shows.
* ``--clean-stop``: the watchers stop their robots' wheels before they release them, and the switch waits for that.

Prints one JSON line; the floor is one question through the same hub, asked in the same run.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import re
from pathlib import Path
from statistics import quantiles
from time import perf_counter
from typing import NamedTuple

from measuring import MISSION_XML, report
from missions import mission_up

from backbone.addresses import RC_MANAGER
from backbone.component.messages import AskState, AskStatistics, ComponentState, Statistics
from backbone.launcher.mission_connection import connected

HALTING_WATCHER = '<type name="watch_for_motion" class="halting_watcher:HaltingWatcher" subsystem="mission_control"/>'
NAME = "switching"
SLICE_S = 0.3


def fast_mission(*, settling: bool, clean_stop: bool) -> str:
    """Return the mission file with short slices.

    Args:
        settling: True: the picture of a new transmitter settles in the time of the mission file; False: at once.
        clean_stop: True: the watchers must stop their robots at the end of a slice.
    """
    text = re.sub(r'minimum-runtime-s="[^"]*"', f'minimum-runtime-s="{SLICE_S}"', MISSION_XML.read_text())
    if not settling:
        text = re.sub(r'connect-s="[^"]*"', 'connect-s="0"', text)
    if clean_stop:
        text = text.replace("  <resources>", f"  <types>{HALTING_WATCHER}</types>\n  <resources>")
    return text


class Measured(NamedTuple):
    """What the RC manager did in some seconds.

    Attributes:
        since_s, until_s: Mission time of their begin and end.
        values: The RC manager's statistics at the end, of the whole mission.
        questions_s: Durations of bare questions meanwhile.
    """

    since_s: float
    until_s: float
    values: dict[str, float]
    questions_s: list[float]


def switches_s(trace: Path, since_s: float, until_s: float, settle_s: float = 0.0) -> list[float]:
    """Return the durations of switches at slice ends that began in this mission time, without their settling."""
    found, begun_s = [], dict[str, float]()
    for line in trace.read_text().splitlines():
        event = json.loads(line)
        if event.get("ev") == "revoke" and event["why"] == "slice" and since_s <= event["t"] < until_s:
            begun_s[event["by"]] = event["t"]
        elif event.get("ev") == "grant" and event["arc"] in begun_s:
            found.append(event["t"] - begun_s.pop(event["arc"]) - settle_s)
    return found


async def measure(seconds: float) -> Measured:
    """Ask the RC manager twenty times a second for so many seconds."""
    questions = []
    async with connected(NAME, None, "ui_console/bench") as (bus, clock):
        since_s = clock.now_s()
        while clock.now_s() < since_s + seconds:
            began = perf_counter()
            await bus.ask(RC_MANAGER, AskState(), ComponentState, within_s=2)
            questions.append(perf_counter() - began)
            await clock.sleep_s(0.05)
        values = (await bus.ask(RC_MANAGER, AskStatistics(), Statistics, within_s=2)).values
        return Measured(since_s, clock.now_s(), values, questions)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--no-settling", action="store_true", help="the picture stands at once")
    parser.add_argument("--clean-stop", action="store_true", help="the watchers stop their robots first")
    given = parser.parse_args()
    variant = [name for name in ("no_settling", "clean_stop") if getattr(given, name)]
    mission = fast_mission(settling=not given.no_settling, clean_stop=given.clean_stop)
    with mission_up(mission, name=NAME):
        measured = asyncio.run(measure(given.seconds))
    floor_s, values = quantiles(measured.questions_s, n=100)[49], measured.values
    report(
        "switch_time",
        variant="+".join(variant) or "as_shipped",
        switches=int(values["switches"]),
        p50_ms=round(values["switch_p50_s"] * 1000, 2),
        p99_ms=round(values["switch_p99_s"] * 1000, 2),
        floor="one question to the RC manager through the hub, in the same mission",
        floor_p50_ms=round(floor_s * 1000, 3),
        ratio=round(values["switch_p50_s"] / floor_s, 2),
    )


if __name__ == "__main__":
    main()
