"""The request of an ARC: its parameters, the request they make, and the set of RCs that was chosen. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet

import msgspec

from backbone.scheduling.claims import scheduling_request
from backbone.scheduling.requests import PathNode, SchedulingRequest, Usage
from resource_pool.messages import DEFAULT_DRIVE_USAGE, NotMySet

ROBOT = "robot"
"""Placeholder in a wish: the role of the RC that has a body, for owners that do not know the role's name."""


class ArcParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Request and owner of an ARC; see ``claim_parameters``.

    Attributes:
        owner: Address of the decision process.
        path: Names and priorities from the mission's root to the owner, or of the console alone.
        console: True for consoles.
        minimum_runtime_s: Shortest useful time, seconds.
        maximum_runtime_s: End of extensions; 0: the minimum.
        wish: Role → name of the RC.
        features: Role → features.
        usages: Period, packet time, deadline, jitter (seconds) and kind of the packets on the radio, for each kind of
            packet; empty: the usage of the ARC's class.
        idle: True: the owner wants no time yet.
        stops_at_once: True: the owner needs no time to stop at the end of a slice.
        may_say_not_now: True: ask the owner shortly before the end of a slice that can be extended.
    """

    owner: str
    path: list[tuple[str, int]]
    minimum_runtime_s: float
    maximum_runtime_s: float = 0.0
    console: bool = False
    wish: dict[str, str] = {}
    features: dict[str, list[str]] = {}
    usages: list[tuple[float, float, float, float, str]] = []
    idle: bool = False
    stops_at_once: bool = False
    may_say_not_now: bool = False


def claim_parameters(
    owner: str,
    *,
    path: list[PathNode],
    minimum_runtime_s: float,
    maximum_runtime_s: float = 0.0,
    wish: dict[str, str] | None = None,
    features: dict[str, list[str]] | None = None,
    usage: Usage | Sequence[Usage] | None = None,
    console: bool = False,
    idle: bool = False,
    stops_at_once: bool = False,
    may_say_not_now: bool = False,
) -> dict[str, object]:
    """Return the parameters of an ARC for this owner.

    Args:
        owner: Address of the decision process.
        path: Priority path from the mission's root, or of the console alone.
        minimum_runtime_s: Shortest useful time, seconds, above 0.
        maximum_runtime_s: End of extensions; 0: the minimum.
        wish: Role → name of the RC (``{"scout": "scout2"}``, ``{ROBOT: "scout2"}``); roles left out: any.
        features: Role → features the RC must have (``{"scout": ["camera"]}``).
        usage: Period of commands on the radio; several: one for each kind of command, ``drive`` among them. With a
            kind of its own, ``jump`` or ``transmitter`` is sent soon while ``drive`` has a long period. None: that of
            the ARC's class, for a hand on a stick.
        console: True for consoles.
        idle: True: no time is wanted yet.
        stops_at_once: True: the owner needs no time to stop at the end of a slice. Then the context switch does not
            wait for the owner, and ``arc_suspending`` is not called.
        may_say_not_now: True: the owner is asked shortly before the end of each slice that can be extended.

    Raises:
        ValueError: There are no usages in the sequence, or two have the same kind.
    """
    usages = [usage] if isinstance(usage, Usage) else list(usage or ())
    if (not usages and usage is not None) or len({one.kind for one in usages}) < len(usages):
        raise ValueError(f"{owner} claims with usages of the kinds {[one.kind for one in usages]}")
    return {
        "owner": owner,
        "path": [[node.name, node.priority] for node in path],
        "console": console,
        "minimum_runtime_s": minimum_runtime_s,
        "maximum_runtime_s": maximum_runtime_s,
        "wish": wish or {},
        "features": features or {},
        "usages": [[one.period_s, one.packet_time_s, one.deadline_s, one.jitter_s, one.kind] for one in usages],
        "idle": idle,
        "stops_at_once": stops_at_once,
        "may_say_not_now": may_say_not_now,
    }


def request_of(
    arc: str,
    given: ArcParameters,
    sets: Sequence[Mapping[str, str]],
    sharable: AbstractSet[str],
    usage: Usage = DEFAULT_DRIVE_USAGE,
) -> SchedulingRequest:
    """Return the request of the ARC with these parameters.

    Args:
        sets: Sets of RCs that match, each role → name.
        sharable: Names of the sharable RCs, which the ARC uses through packet streams.
        usage: Usage of the radio if the parameters state none.
    """
    return scheduling_request(
        arc,
        sets,
        owner=given.owner,
        path=given.path,
        streams=[Usage(*one) for one in given.usages] or [usage],
        sharable=sharable,
        minimum_runtime_s=given.minimum_runtime_s,
        maximum_runtime_s=given.maximum_runtime_s,
        console=given.console,
        idle=given.idle,
        stops_at_once=given.stops_at_once,
    )


def set_of(arc: str, sets: Sequence[dict[str, str]], rcs: Iterable[str]) -> dict[str, str]:
    """Return the set of these RCs, role → name.

    Raises:
        NotMySet: The set is no alternative of the request.
    """
    wanted = set(rcs)
    found = [by_role for by_role in sets if set(by_role.values()) == wanted]
    if not found:
        raise NotMySet(f"{arc} asked for no such set: {', '.join(sorted(wanted)) or 'nothing'}")
    return found[0]
