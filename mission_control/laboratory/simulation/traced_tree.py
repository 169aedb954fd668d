"""Traced tree: the behavior tree by the RC manager's trace, and the priorities that operators have set. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from backbone.addresses import RC_MANAGER
from backbone.naming import component_of
from backbone.scheduling.priority import CONSOLE, Path
from mission_control.laboratory.simulation.audit import Happening

KEPT_WITHIN_S = 6.0  # chosen: two lost messages and their repetitions, and a restart of the RC manager


class TracedTree:
    """The events of the behavior tree, in their order."""

    def __init__(self) -> None:
        self._nodes: dict[str, tuple[str | None, int]] = {}
        self._askers: dict[str, str] = {}
        self._set: dict[str, tuple[int, float]] = {}

    def hear(self, h: Happening, longest_s: float) -> None:
        """Record an event, if it concerns the tree.

        Args:
            longest_s: Additional time until the launcher has a change, because processes were paused or cut off.
        """
        match h.what:
            case "node":
                self._nodes[h.values["id"]] = h.values["parent"], h.values["prio"]
            case "request":
                self._asks(h.values["arc"], h.values["owner"])
            case "depart":
                self._askers.pop(h.values["arc"], None)
            case "changed" if isinstance(h.values["value"], int):
                self._set[h.values["target"]] = h.values["value"], h.at_s
            case "unconfirmed":
                self._set.pop(h.values["target"], None)
            case "begins" if h.who == component_of(RC_MANAGER):
                since_s = h.at_s - KEPT_WITHIN_S - longest_s
                self._set = {node: (number, at_s) for node, (number, at_s) in self._set.items() if at_s < since_s}
                self._nodes, self._askers = {}, {}

    def _asks(self, arc: str, owner: str | dict[str, Any]) -> None:
        """Record the node of an ARC's request; a console's node is new with its request."""
        node = CONSOLE + owner["id"] if isinstance(owner, dict) else owner
        if isinstance(owner, dict):
            self._nodes[node] = None, owner["ui"]
        self._askers[arc] = node

    def path(self, arc: str) -> Path:
        """Return the path of an ARC's request; empty: it has none."""
        node, path = self._askers.get(arc), list[tuple[str, int]]()
        while node is not None:
            parent, priority = self._nodes[node]
            path.insert(0, (node, priority))
            node = parent
        return tuple(path)

    def disobeyed(self) -> Iterator[tuple[str, int, int, float]]:
        """Yield each node with another number than its operator set: name, number, the operator's number, its time."""
        for node, number in dict.fromkeys(one for arc in self._askers for one in self.path(arc)):
            name = node.rpartition("/")[2].removeprefix(CONSOLE)
            if name in self._set and self._set[name][0] != number:
                yield name, number, *self._set[name]
