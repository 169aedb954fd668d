"""Cost of a recorder: its processor time, and context switches with and without it.

Runs the mission of IROS 2001 with short slices several times: alone, with a recorder of everything, and, as the floor,
with a process that receives all copies of its host and discards them. Meanwhile it asks the RC manager a question
twenty times a second. Prints one JSON line; ``core_share`` and ``floor_share`` are parts of one core. Switch times are
from the RC manager's trace, of all runs together. All figures are of the time in which no process starts.
``switch_ratio`` and ``question_ratio`` are medians with a recorder over those without; ``late`` ones are of the 99th
percentiles, ``floor`` ones of the process that keeps nothing.
"""

from __future__ import annotations

import argparse
import asyncio
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles

import psutil
from measuring import BIN, busy_s, report
from missions import mission_up
from switch_time import NAME, Measured, fast_mission, measure, switches_s

from backbone import run_files
from backbone.recording.host_ear import HostEar
from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.reader import Recording

SETTLE_S = 3.0  # chosen: the recorder's imports and its first questions are over


@dataclass
class Runs:
    """Durations in the runs of one kind, in seconds."""

    switches_s: list[float] = field(default_factory=list)
    questions_s: list[float] = field(default_factory=list)

    def late_switch_s(self) -> float:
        """Return the 99th percentile of the switches."""
        return quantiles(self.switches_s, n=100)[98]

    def late_question_s(self) -> float:
        """Return the 99th percentile of the questions."""
        return quantiles(self.questions_s, n=100)[98]


def run(mission: str, trace: Path, seconds: float, listener: list[str], runs: Runs) -> tuple[float, Measured]:
    """Run the mission once, with or without a process that overhears it; return that process's share of a core, too."""
    trace.unlink(missing_ok=True)
    with mission_up(mission, "--trace", str(trace), name=NAME), recorder_of(listener) as recorder:
        time.sleep(SETTLE_S)
        before_s = busy_s(recorder)
        measured = asyncio.run(measure(seconds))
        share = (busy_s(recorder) - before_s) / seconds
    runs.switches_s += switches_s(trace, measured.since_s, measured.until_s)
    runs.questions_s += measured.questions_s
    return share, measured


@contextmanager
def recorder_of(listener: list[str]) -> Iterator[list[psutil.Process]]:
    """Keep a process up that overhears the mission until the block ends; an empty command starts none."""
    if not listener:
        yield []
        return
    recorder = subprocess.Popen(listener)
    try:
        yield [psutil.Process(recorder.pid)]
    finally:
        recorder.send_signal(signal.SIGINT)
        recorder.wait(20)


async def overhear() -> None:
    """Receive all copies of this host and discard them, until SIGINT."""
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGINT, ended.set)
    ear = HostEar(run_files.run_directory(NAME), is_of_mission=True)
    await ear.open(lambda _key, _raw: None, lambda bug: print(bug, file=sys.stderr))
    await ended.wait()
    await ear.close()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--overhear", action="store_true", help="be the process that keeps nothing")
    given = parser.parse_args()
    if given.overhear:
        asyncio.run(overhear())
        return
    plain, recorded, emptied = Runs(), Runs(), Runs()
    shares, floors, messages, size, missing = [], [], 0, 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        mission, trace = fast_mission(settling=False, clean_stop=False), Path(folder) / "trace.jsonl"
        for number in range(given.rounds):
            run(mission, trace, given.seconds, [], plain)
            to = Path(folder) / f"{number}.mcap"
            record = [str(BIN / "scout-backbone"), "record", "--to", str(to)]
            share, measured = run(mission, trace, given.seconds, record, recorded)
            shares.append(share)
            overhears = [sys.executable, __file__, "--overhear"]
            floors.append(run(mission, trace, given.seconds, overhears, emptied)[0])
            with to.open("rb") as file:
                recording = Recording(file)
                found = [one for one in recording.messages() if measured.since_s <= one.at_s < measured.until_s]
                size += to.stat().st_size * len(found) / recording.contents().messages
            messages += len(found)
            missing += sum(missing_numbers(found).values())
    lasted_s = given.rounds * given.seconds
    report(
        "recording",
        messages_a_second=round(messages / lasted_s),
        bytes_a_second=round(size / lasted_s),
        missing=missing,
        core_share=round(median(shares), 4),
        floor_share=round(median(floors), 4),
        switches=len(recorded.switches_s),
        switch_p50_ms=round(median(recorded.switches_s) * 1e3, 2),
        switch_p99_ms=round(recorded.late_switch_s() * 1e3, 2),
        switch_ratio=round(median(recorded.switches_s) / median(plain.switches_s), 3),
        late_switch_ratio=round(recorded.late_switch_s() / plain.late_switch_s(), 3),
        late_floor_ratio=round(emptied.late_switch_s() / plain.late_switch_s(), 3),
        question_ratio=round(median(recorded.questions_s) / median(plain.questions_s), 3),
        late_question_ratio=round(recorded.late_question_s() / plain.late_question_s(), 3),
    )


if __name__ == "__main__":
    main()
