"""Shared parts of the programs in bench/: a hub and helpers in processes of their own, percentiles, one JSON line."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

MISSION_XML = Path(__file__).parents[1] / "mission.xml"
BIN = Path(sys.executable).parent
"""The folder of the project's commands."""
END_WITHIN_S = 5.0  # chosen: a helper whose input is closed ends in milliseconds
_STOLEN_BEFORE_S: float = psutil.cpu_times().steal if psutil.LINUX else 0.0


def percentile(values: Sequence[float], share: float) -> float:
    """Return the value below which this share (0 to 1) of the values lies.

    Example:
        >>> percentile([4.0, 1.0, 3.0, 2.0], 0.5)
        3.0
    """
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def summary(values_s: Sequence[float]) -> dict[str, float]:
    """Return p50, p99 and best of durations in seconds, as microseconds."""
    return {
        "p50_us": round(percentile(values_s, 0.5) * 1e6, 1),
        "p99_us": round(percentile(values_s, 0.99) * 1e6, 1),
        "best_us": round(min(values_s) * 1e6, 1),
    }


def report(claim: str, **measured: Any) -> None:
    """Print one JSON line: the claim, the measured values, and the load of the machine.

    ``stolen_s`` is the time, since the program began, in which a processor had work but another machine ran on it.
    If it is not nearly 0, an unusual measurement means little.
    """
    stolen_s = psutil.cpu_times().steal - _STOLEN_BEFORE_S if psutil.LINUX else 0.0
    machine = {"cpus": os.cpu_count(), "load": round(os.getloadavg()[0], 2), "stolen_s": round(stolen_s, 2)}
    print(json.dumps({"bench": claim, **measured, **machine}))


def busy_s(processes: Iterable[psutil.Process]) -> float:
    """Return the processor time of these processes so far; one that has ended counts 0."""
    total_s = 0.0
    for process in processes:
        with suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            total_s += times.user + times.system
    return total_s


def free_endpoint() -> str:
    """Return a free endpoint on the loopback interface."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def bare_interpreters_s(count: int) -> float:
    """Return the seconds for so many bare interpreters, two at a time."""
    began_s = time.perf_counter()
    with ThreadPoolExecutor(2) as two:
        list(two.map(lambda _: subprocess.run([sys.executable, "-c", "pass"], check=True), range(count)))
    return time.perf_counter() - began_s


@contextmanager
def helper(program: str, *arguments: str, answers: bool = False) -> Iterator[subprocess.Popen[bytes]]:
    """Run ``python program arguments…`` until the block ends; it ends when its standard input closes.

    Args:
        answers: Its standard output can be read.
    """
    output = subprocess.PIPE if answers else None
    process = subprocess.Popen([sys.executable, program, *arguments], stdin=subprocess.PIPE, stdout=output)
    try:
        yield process
    finally:
        if process.stdin is not None:
            process.stdin.close()
        try:
            process.wait(END_WITHIN_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise


def line_of(process: subprocess.Popen[bytes]) -> str:
    """Return the next line that a helper prints; empty: it has ended."""
    assert process.stdout is not None
    return process.stdout.readline().decode().strip()


def wait_for_end_of_input() -> None:
    """Return when the process that started this helper closes its input, or dies."""
    sys.stdin.buffer.read()
