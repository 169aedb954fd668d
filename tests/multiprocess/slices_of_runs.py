"""Slices of a mission and the gaps between them, from its trace."""

from __future__ import annotations

import json
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

Line = dict[str, Any]
Judged = Callable[..., None]

RCS = ("scout1", "scout2", "scout3", "radio", "video1", "grabber")
WORLD = "resource_pool/world"
SETTLING_S = 0.3  # connect-s of the video frequency in mission.xml; its release takes no time
SWITCH_S = 0.05  # beside settling: SCHEDULING.md's tolerance of real processes
SLICE_TOLERANCE_S = 0.1


def trace_of(file: Path) -> list[Line]:
    return [json.loads(line) for line in file.read_text().splitlines()]


@dataclass(frozen=True)
class Slice:
    """One grant of an ARC, until it was revoked.

    Attributes:
        why: Reason of the revocation; empty if the trace ended first.
    """

    arc: str
    granted_s: float
    revoked_s: float
    why: str


def slices_of(trace: Iterable[Line], arcs: set[str]) -> list[Slice]:
    """Return what these ARCs, of which one holds at a time, had in turn."""
    found: list[Slice] = []
    granted: tuple[str, float] | None = None
    for line in trace:
        if line.get("arc") not in arcs:
            continue
        if line["ev"] == "grant":
            assert granted is None, f"{line} while {granted} holds"
            granted = (line["arc"], line["t"])
        elif line["ev"] in ("revoke", "depart") and granted is not None and granted[0] == line["arc"]:
            found.append(Slice(*granted, line["t"], line.get("why", line["ev"])))
            granted = None
    return found


def contested(trace: Sequence[Line], arcs: set[str]) -> list[Slice]:
    """Return the slices that began when all had asked and that ended because it was another's turn."""
    asked_s = max(line["t"] for line in trace if line["ev"] == "request" and line["arc"] in arcs)
    return [one for one in slices_of(trace, arcs) if one.granted_s >= asked_s and one.why == "slice"]


def gaps(slices: Sequence[Slice]) -> list[float]:
    """Return for each hand-over the time in which no ARC held anything, settling included."""
    return [later.granted_s - earlier.revoked_s for earlier, later in pairwise(slices) if earlier.arc != later.arc]


def print_spread(what: str, values_s: Sequence[float]) -> None:
    ordered = sorted(values_s)
    p99 = ordered[min(len(ordered) - 1, len(ordered) * 99 // 100)]
    print(
        f"{what}: {len(ordered)}, p50 {statistics.median(ordered) * 1e3:.2f} ms, "
        f"p99 {p99 * 1e3:.2f} ms, most {ordered[-1] * 1e3:.2f} ms, least {ordered[0] * 1e3:.2f} ms"
    )
