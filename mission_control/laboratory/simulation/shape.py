"""The mission of a seed: hardware, decision processes and duration.

Pure: the same seed gives the same mission, in every process and on every machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Any

import msgspec

from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from backbone.scheduling.requests import Usage

MISSION = "simulated"
MOST_OWNERS = 8
BRING_UP_S = 1.0  # chosen: on virtual time all components are ready within a tenth of this time
SHORTEST_ACTIVE_S, LONGEST_ACTIVE_S = 6.0, 16.0  # chosen: several turns of each owner, yet several runs a second

POOL = "mission_control.laboratory.simulation.audited_pool"
RADIO_DRIVER, GRABBER_DRIVER = f"{POOL}:AuditedRadio", f"{POOL}:AuditedGrabber"
RCS = {
    "scout": f"{POOL}:AuditedScout",
    "command_radio": f"{POOL}:AuditedCommandRadio",
    "video_frequency": f"{POOL}:AuditedVideoFrequency",
    "framegrabber": f"{POOL}:AuditedFramegrabber",
}
ARCS = {
    "drive": f"{POOL}:AuditedDriveArc",
    "video_drive": f"{POOL}:AuditedVideoDriveArc",
    "capture": f"{POOL}:AuditedCaptureArc",
}
POOL_TYPES = (
    *(ComponentType(name, path, Subsystem.RESOURCE_POOL) for name, path in RCS.items()),
    *(ComponentType(name, path, Subsystem.RESOURCE_POOL, restart=False) for name, path in ARCS.items()),
)


class OwnerShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision process and the ARC that it claims.

    Attributes:
        kind: Kind of its ARC.
        path: Names and priorities from the mission's root, or of the console alone.
        console: True for consoles.
        minimum_runtime_s: Shortest useful time.
        maximum_runtime_s: End of extensions.
        wish: Role → name.
        usage: Use of the radio.
        begins_s: Mission time of its first claim.
        rests: True if it releases its ARC in the calm at the end.
    """

    name: str
    kind: str
    path: tuple[tuple[str, int], ...]
    console: bool
    minimum_runtime_s: float
    maximum_runtime_s: float
    wish: dict[str, str]
    usage: Usage
    begins_s: float
    rests: bool

    @property
    def arc(self) -> str:
        """Name of its ARC."""
        return f"{self.name}-{self.kind}"


@dataclass(frozen=True, slots=True)
class MissionShape:
    """A mission.

    Attributes:
        asleep: RCs that start only when an ARC claims them.
        owners: The decision processes.
        priority: Priority of the mission among the consoles.
        grace_s: Time to stop cleanly at the end of a slice.
        policy: Policy of the RC manager.
        active_s: Mission time until which decision processes have moods and faults happen.
        calm_s: Time after that: owners only drive, and no faults happen.
    """

    seed: int
    resources: tuple[Resource, ...]
    asleep: frozenset[str]
    owners: tuple[OwnerShape, ...]
    priority: int
    grace_s: float
    policy: str
    active_s: float
    calm_s: float

    def owner_parameters(self, owner: OwnerShape) -> dict[str, object]:
        """Return the parameters of this decision process, a ``SimulatedOwner``."""
        return {"seed": self.seed, "shape": msgspec.to_builtins(owner), "calm_at_s": self.active_s}


def draw_shape(seed: int) -> MissionShape:
    """Return the mission of this seed: 1 to 8 decision processes, 2 to 10 RCs, under a minute long."""
    dice = Random(f"shape {seed}")
    resources = _resources(dice)
    priority = 10
    tree = _Tree(dice, priority)
    owners = tuple(_owner(dice, number, resources, tree) for number in range(1, dice.randint(1, MOST_OWNERS) + 1))
    grace_s = dice.choice((0.0, 0.1, 0.2))
    settle_s = max(resource.connect_s + resource.disconnect_s for resource in resources)
    return MissionShape(
        seed=seed,
        resources=resources,
        asleep=frozenset(sorted(r.name for r in resources if dice.random() < 0.1)),
        owners=owners,
        priority=priority,
        grace_s=grace_s,
        policy=dice.choice(("no_delay", "no_delay", "no_delay", "strict")),
        active_s=round(BRING_UP_S + dice.uniform(SHORTEST_ACTIVE_S, LONGEST_ACTIVE_S), 3),
        calm_s=CALM_LEAST_S + sum(owner.maximum_runtime_s + settle_s + grace_s + SWITCH_S for owner in owners),
    )


CALM_LEAST_S = 8.0  # chosen: a heartbeat reveals a lost ARC, a lease a lost hold, and both are claimed again
SWITCH_S = 0.5  # chosen: a context switch in which every step is slow


def _resources(dice: Random) -> tuple[Resource, ...]:
    found: list[Resource] = []
    radios = [f"radio{number}" for number in range(1, dice.choice((1, 1, 2)) + 1)]
    for radio in radios:
        capacity = dice.choice((0.5, 0.8, 1.0))
        found.append(
            Resource(radio, "command_radio", sharable=True, capacity=capacity, driver=RADIO_DRIVER, **_times(dice))
        )
    for number in range(1, dice.randint(1, 4) + 1):
        links = {"command_radio": [dice.choice(radios)]}
        found.append(
            Resource(f"scout{number}", "scout", parameters={"network_id": number}, links=links, **_times(dice))
        )
    frequencies = [f"video{number}" for number in range(1, dice.randint(0, 2) + 1)]
    found += [Resource(name, "video_frequency", **_times(dice)) for name in frequencies]
    for number in range(1, (dice.randint(0, 2) if frequencies else 0) + 1):
        links = {"video_frequency": sorted(dice.sample(frequencies, dice.randint(1, len(frequencies))))}
        found.append(Resource(f"grabber{number}", "framegrabber", driver=GRABBER_DRIVER, links=links, **_times(dice)))
    return tuple(found)


def _times(dice: Random) -> dict[str, Any]:
    return {"connect_s": dice.choice((0.0, 0.0, 0.1, 0.3)), "disconnect_s": dice.choice((0.0, 0.0, 0.05))}


class _Tree:
    """Grows the behavior tree: the parent of a new behavior is the mission or an earlier behavior."""

    def __init__(self, dice: Random, priority: int) -> None:
        self._dice = dice
        self._ways: list[tuple[tuple[str, int], ...]] = [((MISSION, priority),)]

    def new(self, name: str) -> tuple[tuple[str, int], ...]:
        way = (*self._dice.choice(self._ways), (name, self._dice.choice((1, 1, 2, 3))))
        self._ways.append(way)
        return way


def _owner(dice: Random, number: int, resources: tuple[Resource, ...], tree: _Tree) -> OwnerShape:
    kinds = ["drive"]
    present = {resource.type for resource in resources}
    if "video_frequency" in present:
        kinds.append("video_drive")
    if "framegrabber" in present:
        kinds.append("capture")
    is_console = dice.random() < 0.25
    name = f"{'console' if is_console else 'behavior'}{number}"
    minimum_s = round(dice.uniform(0.3, 2.5), 2)
    scouts = [resource.name for resource in resources if resource.type == "scout"]
    period_s = dice.choice((0.2, 0.25, 0.4))
    return OwnerShape(
        name=name,
        kind=dice.choice(kinds),
        path=((name, dice.choice((1, 10, 100))),) if is_console else tree.new(name),
        console=is_console,
        minimum_runtime_s=minimum_s,
        maximum_runtime_s=minimum_s if dice.random() < 0.5 else round(minimum_s + dice.uniform(0.1, 1.5), 2),
        wish={"scout": dice.choice(scouts)} if dice.random() < 0.8 else {},
        usage=Usage(period_s, round(period_s * dice.choice((0.05, 0.1, 0.25)), 4), kind="drive"),
        begins_s=round(BRING_UP_S * 0.5 + dice.choice((0.0, dice.uniform(0.0, 4.0))), 3),
        rests=dice.random() < 0.2,
    )
