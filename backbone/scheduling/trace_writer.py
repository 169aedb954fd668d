"""TraceWriter: writes the lines of the trace, each with its cause.

Rule of this file: every name in a line was introduced by an earlier line: RCs, and the nodes of the behavior tree,
parents first.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable

from backbone.scheduling.entries import ArcEntry, OpenDecision, RcEntry
from backbone.scheduling.events import Record
from backbone.scheduling.priority import CONSOLE, Path
from backbone.scheduling.priority_tree import carried
from backbone.scheduling.requests import Usage
from backbone.scheduling.trace import EXCLUSIVE, Line

STORY_LINES = 400  # chosen: some minutes of a busy mission, for the report of a broken invariant


class TraceWriter:
    """Adds each line to the decision's instructions, and keeps the last ones."""

    def __init__(self, decision: OpenDecision, *, goes_on: bool = False) -> None:
        """Begin with nothing introduced.

        Args:
            decision: The present decision.
            goes_on: True if the lines follow those of an earlier RC manager, in which an RC may be down.
        """
        self._decision, self._goes_on = decision, goes_on
        self._is_up: dict[str, bool] = {}
        self._removed: set[str] = set()
        self._nodes: dict[tuple[str, ...], tuple[str | None, int]] = {}
        self._ids: dict[tuple[str, ...], str] = {}
        self._story: deque[Line] = deque(maxlen=STORY_LINES)

    def record(self, event: str, cause: str = "", **fields: object) -> None:
        """Write a line of this kind with its fields in this order; its time is now unless a field sets another."""
        line: Line = {"ev": event, "t": self._decision.now_s, **fields}
        if event == "rc_state":
            self._is_up[line["id"]] = line["state"] == "up"
        self._story.append(line)
        self._decision.instructions.append(Record(line, cause))

    def record_request(self, arc: ArcEntry, rcs: Iterable[RcEntry], *, idle: bool) -> None:
        """Write the ARC's request for these RCs, with its idle state."""
        for rc in rcs:
            self.introduce_rc(rc)
        self.introduce_nodes(arc.path)
        self.record(
            "request",
            f"asked by {arc.request.owner}",
            arc=arc.name,
            owner=self._owner(arc),
            min_run=arc.minimum_s,
            max_run=arc.maximum_s,
            use={name: _streams(use.streams) if name in arc.shares else EXCLUSIVE for name, use in arc.uses.items()},
            **({"idle": True} if idle else {}),
        )

    def _owner(self, arc: ArcEntry) -> str | dict[str, object]:
        if not _of_console(arc.path):
            return self._id(arc.place_in_tree)
        [(name, number)] = arc.path
        return {"ui": number, "id": name.removeprefix(CONSOLE)}

    # Names.

    def introduce_rc(self, rc: RcEntry) -> None:
        """Introduce a new RC when it is first up or requested."""
        if rc.name in self._is_up:
            return
        self._is_up[rc.name] = True
        self.record(
            "rc",
            f"its ARCs share {rc.capacity:.0%} of its time" if rc.sharable else "its ARCs hold it in turn",
            id=rc.name,
            kind="share" if rc.sharable else "unit",
            cap=rc.capacity,
            connect=rc.connect_s,
            disconnect=rc.disconnect_s,
        )
        if not rc.up:
            self.record("rc_state", "not started yet", id=rc.name, state="down")
        elif self._goes_on or rc.name in self._removed:
            self.record("rc_state", "it answers this RC manager", id=rc.name, state="up")
        self._removed.discard(rc.name)

    def has_introduced(self, rc: str) -> bool:
        """Return whether the RC was introduced."""
        return rc in self._is_up

    def forget_rc(self, rc: str) -> None:
        """Introduce an RC of this name again, because it is another one."""
        if self._is_up.pop(rc, None) is not None:
            self._removed.add(rc)

    def introduce_nodes(self, path: Path) -> None:
        """Introduce new nodes, new numbers and new parents on this path, parents first."""
        way: tuple[str, ...] = ()
        for name, number in path:
            parent = self._id(way) if way else None
            way = (*way, name)
            told = self._nodes.get(way)
            self._nodes[way] = (parent, number)
            if told == (parent, number) or (told is None and _of_console(path)):
                continue  # the request's line has a console's first number
            moved = told is not None and told[0] != parent
            cause = f"its parent is {parent}" if moved else f"its priority among its siblings is {number}"
            self.record("node", cause, id=self._id(way), parent=parent, prio=number)

    def forget_nodes(self, ways: Iterable[tuple[str, ...]]) -> None:
        """Introduce these consoles again with their next requests."""
        for way in ways:
            self._nodes.pop(way, None)

    def nodes(self) -> list[tuple[str, ...]]:
        """Return the paths of all introduced nodes."""
        return [*self._nodes]

    def nodes_moved(self, old: tuple[str, ...], new: tuple[str, ...]) -> None:
        """Keep the id of each node at and below ``old``, which is now at ``new``; lines continue with the old ids."""
        self._ids = {carried(way, old, new): self._id(way) for way in self._nodes}
        self._nodes = {carried(way, old, new): told for way, told in self._nodes.items()}

    def _id(self, way: tuple[str, ...]) -> str:
        return self._ids.get(way, "/".join(way))

    # What was written.

    def story_of(self, names: Collection[str]) -> list[Line]:
        """Return the last lines about these ARCs or RCs; about all if there are none."""
        return [line for line in self._story if not names or line.get("arc", line.get("id")) in names]

    def says_up(self, rc: str) -> bool | None:
        """Return whether the RC is up according to the lines so far; None without such a line."""
        return self._is_up.get(rc)


def _of_console(path: Path) -> bool:
    """Return whether this is the path of a console itself, not of an order of a console."""
    return len(path) == 1 and path[0][0].startswith(CONSOLE)


def _streams(streams: Collection[Usage]) -> list[dict[str, float]]:
    lines = []
    for usage in streams:
        line = {"period": usage.period_s, "cost": usage.packet_time_s}
        if usage.deadline_s:
            line["deadline"] = usage.deadline_s
        if usage.jitter_s:
            line["jitter"] = usage.jitter_s
        lines.append(line)
    return lines
