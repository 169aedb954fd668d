"""Priority tree: the places and numbers of the nodes of the behavior tree and of the consoles.

Source: IROS 2001 and RAM 2002, "behavior manager". ``priority.higher`` compares them.
"""

from __future__ import annotations

from collections.abc import Iterable

from backbone.scheduling.events import KeptTree, Moved
from backbone.scheduling.priority import CONSOLE, Path
from backbone.scheduling.requests import PathNode


class PriorityTree:
    """The places and numbers of all nodes that ever sent a request, and of the consoles with a request.

    A number or place that an operator set stays until the operator sets another. All other nodes have the numbers and
    places of the newest request. A request always names the path with which its owner was started; later moves lead
    from that path to the present one.
    """

    def __init__(self, mission: str, priority: int) -> None:
        self._mission = mission
        self._numbers: dict[tuple[str, ...], int] = {(mission,): priority}
        self._set: dict[str, int] = {}
        self._raised: dict[tuple[str, ...], int] = {}
        self._shared: dict[tuple[str, int], tuple[str, int]] = {}
        self._moves: list[tuple[tuple[str, ...], tuple[str, ...]]] = []

    def place(self, nodes: Iterable[PathNode], *, console: bool) -> tuple[tuple[str, ...], bool]:
        """Add the nodes on this path.

        Returns:
            Their names, root first, and whether a node that was known before has a new number.
        """
        way = list(nodes)
        if console:
            way = [PathNode(CONSOLE + node.name, node.priority) for node in way]
        elif not way or way[0].name != self._mission:
            way.insert(0, PathNode(self._mission, self._numbers[self._mission,]))
        way = self._moved(way)
        names: tuple[str, ...] = ()
        renumbered = False
        for node in way:
            names = (*names, node.name)
            number = self._set.get(node.name.removeprefix(CONSOLE), node.priority)
            renumbered |= self._numbers.setdefault(names, number) != number
            self._numbers[names] = number
        return names, renumbered

    def path(self, names: tuple[str, ...]) -> Path:
        """Return the path with its present numbers; paths with a common part share its objects."""
        if len(self._shared) > 2 * len(self._numbers):
            self._shared.clear()  # most of them have a number of earlier
        numbered = [
            (name, self._numbers[way] + self._raised.get(way, 0))
            for name, way in ((name, names[: depth + 1]) for depth, name in enumerate(names))
        ]
        return tuple(self._shared.setdefault(node, node) for node in numbered)

    def forget(self, names: tuple[str, ...], present: Iterable[tuple[str, ...]]) -> list[tuple[str, ...]]:
        """Forget the nodes on the path of a console's last request: each console has a name of its own.

        Args:
            names: The path.
            present: The paths of all other requests; their nodes stay.

        Returns:
            The paths of the forgotten nodes.
        """
        used = {way[:depth] for way in present for depth in range(1, len(way) + 1)}
        gone = [names[:depth] for depth in range(1, len(names) + 1) if names[:depth] not in used]
        for way in gone:
            self._numbers.pop(way, None)
        return gone

    def nodes(self, names: tuple[str, ...]) -> list[PathNode]:
        """Return the path of a request with its numbers as set, without aging."""
        return [
            PathNode(name.removeprefix(CONSOLE), self._numbers[names[: depth + 1]]) for depth, name in enumerate(names)
        ]

    def age(self, levels: Iterable[tuple[tuple[str, ...], int]]) -> bool:
        """Raise nodes whose ARCs wait long by some levels, and no others; return whether that changed any node.

        A node rises together with all its ancestors, because otherwise it would rise only among its siblings. The
        mission's own node does not rise, so a long wait never outranks a console. Consoles do not rise either.

        Args:
            levels: Paths of the nodes, with the levels by which they rise; the largest level of a node counts.
        """
        raised: dict[tuple[str, ...], int] = {}
        for names, by in levels:
            for depth in range(2, len(names) + 1):
                way = names[:depth]
                raised[way] = max(by, raised.get(way, 0))
        changed = raised != self._raised
        self._raised = raised
        return changed

    def change(self, node: str, priority: int) -> None:
        """Set the number of the node, or the console, of this name."""
        self._set[node] = priority
        for names in self._numbers:
            if names[-1].removeprefix(CONSOLE) == node:
                self._numbers[names] = priority

    def kept(self) -> KeptTree:
        """Return the numbers and places that operators have set."""
        moves = [Moved([*old], [*new]) for old, new in self._moves]
        ways = [way for way in self._numbers if moves and not way[0].startswith(CONSOLE)]
        return KeptTree(dict(self._set), moves, [self.nodes(way) for way in ways])

    def restore(self, kept: KeptTree) -> None:
        """Set the numbers and places that operators set at an earlier RC manager, before any request."""
        self._moves = [(tuple(move.before), tuple(move.now)) for move in kept.moves]
        for path in kept.nodes:
            self._numbers[tuple(node.name for node in path)] = path[-1].priority
        for node, priority in kept.priorities.items():
            self.change(node, priority)

    def obstacle(self, node: str, parent: str) -> str:
        """Return why the node of this name cannot be moved below the other one; empty if it can."""
        for name in (node, parent):
            ways = self._ways(name)
            if (CONSOLE + name,) in self._numbers:
                return f"{name} is a console, which stands beside the mission's tree"
            if not ways:
                return f"nothing at or below a node named {name!r} has asked for run time"
            if len(ways) > 1:
                return f"there are {len(ways)} nodes named {name!r}"
        [way], [above] = self._ways(node), self._ways(parent)
        if len(way) == 1:
            return f"{node} is the root of the tree"
        if above[: len(way)] == way:
            return f"{parent} is {node} itself, or below it"
        if (*above, node) in self._numbers and (*above, node) != way:
            return f"{parent} has a child named {node!r} already"
        return ""

    def move(self, node: str, parent: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Move the node of this name, with its descendants, below the other one.

        Its number stays, and counts among its new siblings from now on.

        Returns:
            Its old path and its new path.

        Raises:
            ValueError: ``obstacle`` returns a reason.
        """
        obstacle = self.obstacle(node, parent)
        if obstacle:
            raise ValueError(obstacle)
        [old], [above] = self._ways(node), self._ways(parent)
        new = (*above, node)
        if old != new:
            self._moves.append((old, new))
            self._numbers = {carried(way, old, new): number for way, number in self._numbers.items()}
            self._raised = {carried(way, old, new): levels for way, levels in self._raised.items()}
        return old, new

    def _ways(self, node: str) -> list[tuple[str, ...]]:
        return [way for way in self._numbers if way[-1] == node]

    def _moved(self, way: list[PathNode]) -> list[PathNode]:
        """Return the path after all moves; the nodes above a moved one have their present numbers."""
        names, own = tuple(node.name for node in way), len(way)
        for old, new in self._moves:
            if names[: len(old)] == old:
                own = min(own, len(names) - len(old) + 1)
                names = carried(names, old, new)
        above = len(names) - own
        return [PathNode(names[depth], self._numbers[names[: depth + 1]]) for depth in range(above)] + way[-own:]


def carried(way: tuple[str, ...], old: tuple[str, ...], new: tuple[str, ...]) -> tuple[str, ...]:
    """Return the path after the move of ``old`` to ``new``.

    Example:
        >>> carried(("m", "a", "n", "leaf"), ("m", "a", "n"), ("m", "b", "n"))
        ('m', 'b', 'n', 'leaf')
    """
    return new + way[len(old) :] if way[: len(old)] == old else way
