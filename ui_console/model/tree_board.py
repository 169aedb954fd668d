"""The behavior tree, for a console's table.

Rules of this file: no bus, no clock, no screen. The board remembers the nodes' priorities from schedules and their ends
from stories; the nodes that exist, and the lost ones, are arguments of a view.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set

from backbone.component.messages import ComponentState, LifeState, StoryEvent
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission_log.people import People
from backbone.naming import Subsystem, component_of
from backbone.picture.words import because
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule
from ui_console.model.views import NodeState, NodeView

_STATE_OF_REQUEST = {
    RequestState.RUNNING: NodeState.RUNNING,
    RequestState.REVOKING: NodeState.RUNNING,
    RequestState.CONNECTING: NodeState.WAITING,
    RequestState.WAITING: NodeState.WAITING,
    RequestState.IDLE: NodeState.IDLE,
}


class TreeBoard:
    """State of the nodes, from messages.

    Args:
        people: The person at each console.
    """

    def __init__(self, people: People) -> None:
        self._people = people
        self._finished: dict[str, tuple[float, NodeState]] = {}
        self._priorities: dict[str, int] = {}

    def scheduled(self, schedule: Schedule, there: Set[str]) -> None:
        """Record the priorities of all nodes with a request; of other nodes, those that are ``there`` keep theirs."""
        kept = {name: number for name, number in self._priorities.items() if name in there}
        self._priorities = kept | _priorities(schedule.requests)

    def told(self, story: StoryEvent) -> None:
        """Record that a node finished, if the event is the node's own report."""
        head, _, status = story.what.partition(": ")
        if head == "finished" and component_of(story.where) == story.subject and status in ("success", "failure"):
            self._finished[story.subject] = (story.at_s, NodeState(status))

    def begins(self, name: str) -> None:
        """Delete the end of a node of this name, because the node starts again."""
        self._finished.pop(name, None)

    def forget(self, name: str) -> None:
        """Remove a node that left for good."""
        self._finished.pop(name, None)
        self._priorities.pop(name, None)

    def views(
        self, components: Iterable[ComponentState], lost: Mapping[str, float], schedule: Schedule | None
    ) -> list[NodeView]:
        """Return the nodes, parents before children, siblings of higher priority first.

        Args:
            components: Components of the mission; behaviors among them are nodes, execution units are not.
            lost: Address of each lost node → time of the loss.
        """
        requests = {component_of(request.owner): request for request in (schedule.requests if schedule else [])}
        nodes = {node.address: node for node in components if is_behavior(node)}
        below: dict[str, list[ComponentState]] = {}
        for node in nodes.values():
            below.setdefault(node.requester if node.requester in nodes else "", []).append(node)
        views: list[NodeView] = []
        pending = [(root, 0) for root in self._in_order(below.get("", []))]
        shown: set[str] = set()
        while pending:
            node, depth = pending.pop(0)
            if node.address in shown:
                continue
            shown.add(node.address)
            views.append(self._view(node, depth, lost.get(node.address), requests.get(component_of(node.address))))
            pending[:0] = [(child, depth + 1) for child in self._in_order(below.get(node.address, []))]
        return views

    def _view(
        self, node: ComponentState, depth: int, lost_since_s: float | None, request: RequestView | None
    ) -> NodeView:
        name, state, since_s = component_of(node.address), NodeState.RUNNING, node.since_s
        if lost_since_s is not None:
            state, since_s = NodeState.LOST, lost_since_s
        elif name in self._finished:
            since_s, state = self._finished[name]
        elif node.state is LifeState.CONNECTING:
            state = NodeState.STARTING
        elif request is not None:
            state, since_s = _STATE_OF_REQUEST[request.state], request.since_s
        return NodeView(
            name,
            node.type,
            component_of(node.requester) if depth else "",
            depth,
            self._priorities.get(name),
            state,
            since_s,
            self._people.named(node.feedback),
            request.arc if request is not None else "",
            because(request, self._people) if request is not None else "",
        )

    def _in_order(self, nodes: Sequence[ComponentState]) -> list[ComponentState]:
        def order(node: ComponentState) -> tuple[int, str]:
            return -self._priorities.get(component_of(node.address), 0), node.address

        return sorted(nodes, key=order)


def is_behavior(component: ComponentState) -> bool:
    """Return whether a component is a node of the behavior tree."""
    return component.address.startswith(f"{Subsystem.MISSION_CONTROL}/") and component.type != EXECUTION_UNIT


def _priorities(requests: Iterable[RequestView]) -> dict[str, int]:
    """Return the priorities of all nodes on the paths of these requests."""
    found: dict[str, int] = {}
    for request in requests:
        for step in request.priority.split("/"):
            name, _, number = step.rpartition(":")
            if name and number.lstrip("-").isdecimal():
                found[name] = int(number)
    return found
