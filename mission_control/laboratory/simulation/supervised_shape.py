"""The supervised mission of a seed: the pool and owners of ``shape``, on hosts, with a behavior tree beside them.

Pure: the same seed gives the same mission, in every process and on every machine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random

import msgspec

from backbone.component_database.messages import ComponentType
from backbone.creator.messages import creator_name
from backbone.dependency_database.messages import Resource
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode, walk
from backbone.mission.model import ComponentDescription, CoreServiceDescription, Host, MissionDescription
from backbone.naming import Subsystem
from backbone.scheduling.priority import Path
from mission_control.laboratory.simulation.shape import MISSION, POOL, POOL_TYPES, MissionShape, draw_shape

CORE = ("component_database", "placer", "creator", "dependency_database", "rc_manager")
CLASSES = {
    "nameserver": "backbone.nameserver.service:Nameserver",
    "component_database": "backbone.component_database.service:ComponentDatabase",
    "placer": "backbone.placer.service:Placer",
    "creator": "mission_control.laboratory.simulation.simulated_machines:SimulatedCreator",
    "dependency_database": "backbone.dependency_database.service:DependencyDatabase",
    "rc_manager": f"{POOL}:AuditedRcManager",
}
OWNER = "mission_control.laboratory.simulation.simulated_owner:SimulatedOwner"
NODE = "mission_control.behavior:Behavior"  # class paths, as in a mission file, because imports run downwards only
SHARED_PROCESS = "minds"
NODE_RUNTIME_S = 1.0  # chosen: as short as the owners' times


@dataclass(frozen=True, slots=True)
class SupervisedShape:
    """A supervised mission.

    Attributes:
        pool: Hardware, owners and times.
        hosts: Hosts; the first runs the core services.
        places: RC → host of its hardware.
        trees: Roots of the behavior tree beside the owners.
    """

    seed: int
    pool: MissionShape
    hosts: tuple[str, ...]
    places: dict[str, str]
    trees: tuple[BehaviorNode, ...]

    @property
    def nodes(self) -> list[BehaviorNode]:
        """All nodes of its trees, parents before their children."""
        return [node for _path, node in walk(self.trees)]

    def groups(self) -> list[list[str]]:
        """Return the targets of faults, by kind: core services, creators, RCs, ARCs, owners, nodes of the tree."""
        return [
            ["nameserver", *(name for name in CORE if name != "creator")],
            [creator_name(host) for host in self.hosts],
            [resource.name for resource in self.pool.resources],
            [owner.arc for owner in self.pool.owners] + [arc_of(node) for node in self.nodes if node.arc is not None],
            [owner.name for owner in self.pool.owners],
            [node.name for node in self.nodes],
        ]

    def tree_paths(self) -> dict[str, Path]:
        """Return the ARC of each node that claims one, with the node's priority path."""
        root = (MISSION, self.pool.priority)
        return {
            arc_of(leaf): (root, (tree.name, tree.priority), (leaf.name, leaf.priority))
            for tree in self.trees
            for leaf in tree.children
            if leaf.arc is not None
        }

    def hearers(self) -> list[str]:
        """Return the targets of hostile messages: the RC manager, RCs and ARCs."""
        _, _, rcs, arcs, _, _ = self.groups()
        return ["rc_manager", *rcs, *arcs]

    def description(self, rules: Mapping[str, object]) -> MissionDescription:
        """Return the mission as a description, as from a mission file.

        Args:
            rules: Further parameters of the RC manager.
        """
        core = Subsystem.BACKBONE
        types = [ComponentType(name, path, core, core=True) for name, path in CLASSES.items()]
        types += POOL_TYPES
        types.append(ComponentType("console", OWNER, Subsystem.UI_CONSOLE))
        types.append(ComponentType("owner", OWNER, Subsystem.MISSION_CONTROL))
        types.append(ComponentType("node", NODE, Subsystem.MISSION_CONTROL))
        services = [CoreServiceDescription(type="nameserver", host=self.hosts[0])]
        for name in CORE:
            where = self.hosts if name == "creator" else self.hosts[:1]
            services += [
                CoreServiceDescription(type=name, host=host, parameters=self._core_parameters(name, rules))
                for host in where
            ]
        owners = [
            ComponentDescription(
                type="console" if owner.console else "owner",
                name=owner.name,
                parameters=self.pool.owner_parameters(owner),
            )
            for owner in self.pool.owners
        ]
        return MissionDescription(
            name=MISSION,
            priority=self.pool.priority,
            hosts=tuple(Host(name=host, address="127.0.0.1") for host in self.hosts),
            core=tuple(services),
            types=tuple(types),
            resources=tuple(
                msgspec.structs.replace(resource, host=self.places[resource.name]) for resource in self.pool.resources
            ),
            components=tuple(owners),
            behaviors=self.trees,
            source="a seed",
        )

    def _core_parameters(self, service: str, rules: Mapping[str, object]) -> dict[str, object]:
        return {"grace_s": self.pool.grace_s, "policy": self.pool.policy, **rules} if service == "rc_manager" else {}


def arc_of(node: BehaviorNode) -> str:
    """Return the name of the node's ARC."""
    assert node.arc is not None  # noqa: S101  called only for nodes that have an ARC
    return f"{node.name}-{node.arc.kind}"


def draw_supervised_shape(seed: int) -> SupervisedShape:
    """Return the supervised mission of this seed: one to three hosts, up to seven nodes beside the owners."""
    pool, dice = draw_shape(seed), Random(f"supervised {seed}")
    pool = replace(pool, asleep=frozenset(), owners=pool.owners[: dice.randint(1, 3)])
    hosts = tuple(f"h{number}" for number in range(1, dice.randint(1, 3) + 1))
    places = {resource.name: dice.choice(hosts) for resource in pool.resources}
    trees = tuple(_tree(dice, f"tree{number}", pool.resources) for number in range(1, dice.randint(1, 2) + 1))
    return SupervisedShape(seed, pool, hosts, places, trees)


def _tree(dice: Random, name: str, resources: tuple[Resource, ...]) -> BehaviorNode:
    process = SHARED_PROCESS if dice.random() < 0.4 else ""
    leaves = tuple(
        _node(dice, f"{name}-leaf{number}", resources, process) for number in range(1, dice.randint(1, 3) + 1)
    )
    tree = BehaviorNode(type="node", name=name, priority=0, children=leaves)
    return _sharing(tree, "" if dice.random() < 0.5 else process)


def _node(dice: Random, name: str, resources: tuple[Resource, ...], process: str) -> BehaviorNode:
    scouts = [resource.name for resource in resources if resource.type == "scout"]
    wish = {"scout": dice.choice(scouts)} if dice.random() < 0.5 else {}
    arc = ArcNeed(kind="drive", wish=wish, minimum_runtime_s=NODE_RUNTIME_S, period_s=0.4, packet_time_s=0.02)
    node = BehaviorNode(type="node", name=name, priority=0, arc=arc if dice.random() < 0.7 else None)
    return _sharing(node, process)


def _sharing(node: BehaviorNode, process: str) -> BehaviorNode:
    return msgspec.structs.replace(node, process=process) if process else node
