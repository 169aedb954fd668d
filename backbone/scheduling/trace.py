"""The lines of the schedule trace, from which an independent judge can replay every decision.

Rule of this file: one function per kind of line, fields and order as the trace format fixes them.
Times are mission seconds, written in full so that a replay finds the very same decision times.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from backbone.scheduling.requests import RcUse, Usage

Line = dict[str, Any]

VERSION = 1
EXCLUSIVE = "x"


def meta(
    now_s: float, *, policy: str, discipline: str, grace_s: float, tolerance_s: float, relaxed: bool = False
) -> Line:
    """Return the first line of a section: the rules of this run, ``relaxed`` once a group is too big to plan whole."""
    return {
        "ev": "meta",
        "t": now_s,
        "v": VERSION,
        "mode": policy,
        "discipline": discipline,
        "wc": "relaxed" if relaxed else "plan",
        "grace": grace_s,
        "tol": tolerance_s,
    }


def rc(now_s: float, name: str, *, sharable: bool, capacity: float, connect_s: float, disconnect_s: float) -> Line:
    """Return the line that introduces an RC, up."""
    kind = "share" if sharable else "unit"
    return {
        "ev": "rc",
        "t": now_s,
        "id": name,
        "kind": kind,
        "cap": capacity,
        "connect": connect_s,
        "disconnect": disconnect_s,
    }


def rc_state(now_s: float, name: str, *, up: bool) -> Line:
    """Return the line of an RC that went down or came back."""
    return {"ev": "rc_state", "t": now_s, "id": name, "state": "up" if up else "down"}


def rc_capacity(now_s: float, name: str, capacity: float) -> Line:
    """Return the line of a changed capacity."""
    return {"ev": "rc_cap", "t": now_s, "id": name, "cap": capacity}


def node(now_s: float, name: str, parent: str | None, priority: int) -> Line:
    """Return the line of a new or changed node of the behavior tree."""
    return {"ev": "node", "t": now_s, "id": name, "parent": parent, "prio": priority}


def request(
    now_s: float,
    arc: str,
    owner: str | Line,
    *,
    minimum_s: float,
    maximum_s: float,
    uses: Mapping[str, RcUse],
    idle: bool,
) -> Line:
    """Return the line of a request; ``owner`` is a node's id, or from ``console_owner``."""
    line = {
        "ev": "request",
        "t": now_s,
        "arc": arc,
        "owner": owner,
        "min_run": minimum_s,
        "max_run": maximum_s,
        "use": {name: _use(use) for name, use in uses.items()},
    }
    return {**line, "idle": True} if idle else line


def console_owner(name: str, priority: int) -> Line:
    """Return the name of a console as owner in the trace."""
    return {"ui": priority, "id": name}


def runtime(now_s: float, arc: str, minimum_s: float, maximum_s: float) -> Line:
    """Return the line of changed run times."""
    return {"ev": "min_run", "t": now_s, "arc": arc, "min_run": minimum_s, "max_run": maximum_s}


def extend(now_s: float, arc: str, until_s: float) -> Line:
    """Return the line of an extended slice."""
    return {"ev": "extend", "t": now_s, "arc": arc, "until": until_s}


def connect(now_s: float, arc: str, epochs: Mapping[str, int]) -> Line:
    """Return the line of RCs that begin to settle, with all their new epochs."""
    return {"ev": "connect", "t": now_s, "arc": arc, "epoch": dict(epochs)}


def grant(now_s: float, arc: str, epochs: Mapping[str, int]) -> Line:
    """Return the line of a grant with those epochs that are the newest of their RCs.

    On a sharable RC an ARC of shorter settling time may overtake between connect and grant; the
    overtaken epoch is in its ``connect`` line only, so that a reader sees each RC's numbers grow.
    """
    return {"ev": "grant", "t": now_s, "arc": arc, "epoch": dict(epochs)}


def revoke(now_s: float, arc: str, why: str, by: str) -> Line:
    """Return the line of a revocation."""
    line = {"ev": "revoke", "t": now_s, "arc": arc, "why": why}
    return {**line, "by": by} if by else line


def about(event: str, now_s: float, arc: str) -> Line:
    """Return a line that names only its ARC: ``want``, ``idle``, ``depart``, ``free``, ``slice``."""
    return {"ev": event, "t": now_s, "arc": arc}


def _use(use: RcUse) -> str | list[dict[str, float]]:
    return [_stream(usage) for usage in use.streams] if use.streams else EXCLUSIVE


def _stream(usage: Usage) -> dict[str, float]:
    line = {"period": usage.period_s, "cost": usage.packet_time_s}
    if usage.deadline_s:
        line["deadline"] = usage.deadline_s
    if usage.jitter_s:
        line["jitter"] = usage.jitter_s
    return line
