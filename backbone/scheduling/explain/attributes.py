"""Attributes: the present run times, priorities and RCs of requests.

Rule of this file: it reads and never changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from backbone.naming import component_of
from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.priority import CONSOLE
from backbone.scheduling.requests import PathNode, UnknownRequest
from backbone.scheduling.views import Attributes, RequestAttributes


def attributes(arcs: Iterable[ArcEntry], name: str, way: Callable[[tuple[str, ...]], list[PathNode]]) -> Attributes:
    """Return the requests of the ARC or owner of this name, or of the node of this name and its descendants.

    Args:
        name: Name of an ARC, of a decision process (or its address), or of a node of the behavior tree.
        way: Names from the root to an owner → the same nodes with their numbers.

    Raises:
        UnknownRequest: No ARC, owner or node has this name.
    """
    meant = [arc for arc in arcs if name in (arc.name, arc.request.owner, *_nodes(arc))]
    if not meant:
        raise UnknownRequest(f"nothing at or below {name!r} asks for run time", name=name)
    return Attributes([_of(arc, way(arc.place_in_tree)) for arc in meant])


def _nodes(arc: ArcEntry) -> list[str]:
    return [component_of(arc.request.owner), *(node.removeprefix(CONSOLE) for node in arc.place_in_tree)]


def _of(arc: ArcEntry, path: list[PathNode]) -> RequestAttributes:
    return RequestAttributes(
        arc=arc.name,
        owner=arc.request.owner,
        state=arc.state,
        uses=dict(arc.uses),
        minimum_runtime_s=arc.minimum_s,
        maximum_runtime_s=arc.maximum_s,
        path=path,
        console=arc.request.console,
        stops_at_once=arc.request.stops_at_once,
    )
