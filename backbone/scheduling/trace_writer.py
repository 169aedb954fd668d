"""TraceWriter: writes the lines of the trace, each with its cause.

Rule of this file: every name in a line was introduced by a line before it: RCs, and the nodes of the behavior tree,
parents first.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection

from backbone.scheduling import trace
from backbone.scheduling.entries import ArcEntry, RcEntry
from backbone.scheduling.events import Record
from backbone.scheduling.priority import CONSOLE, Path
from backbone.scheduling.priority_tree import carried
from backbone.scheduling.requests import RcUse

STORY_LINES = 400  # chosen: some minutes of a busy mission, for the report of a broken invariant


class TraceWriter:
    """Emits each line, and keeps the last ones."""

    def __init__(self, emit: Callable[[Record], None], *, goes_on: bool = False) -> None:
        """Begin with nothing introduced.

        Args:
            emit: Called with each line, in order.
            goes_on: True if the lines follow an earlier RC manager's, by which an RC may be down.
        """
        self._emit, self._goes_on = emit, goes_on
        self._is_up: dict[str, bool] = {}
        self._removed: set[str] = set()
        self._nodes: dict[tuple[str, ...], tuple[str | None, int]] = {}
        self._ids: dict[tuple[str, ...], str] = {}
        self._story: deque[trace.Line] = deque(maxlen=STORY_LINES)

    def record(self, line: trace.Line, cause: str = "") -> None:
        """Write this line."""
        if line["ev"] == "rc_state":
            self._is_up[line["id"]] = line["state"] == "up"
        self._story.append(line)
        self._emit(Record(line, cause))

    def story_of(self, names: Collection[str]) -> list[trace.Line]:
        """Return the last lines about these ARCs or RCs; about all if there are none."""
        return [line for line in self._story if not names or line.get("arc", line.get("id")) in names]

    def has_introduced(self, rc: str) -> bool:
        """Return whether the RC was introduced."""
        return rc in self._is_up

    def forget_rc(self, rc: str) -> None:
        """Introduce an RC of this name anew: it is another one."""
        if self._is_up.pop(rc, None) is not None:
            self._removed.add(rc)

    def says_up(self, rc: str) -> bool | None:
        """Return whether the RC is up by the lines so far; None without such a line."""
        return self._is_up.get(rc)

    def introduce_rc(self, rc: RcEntry, now_s: float) -> None:
        """Introduce a new RC: when it is up for the first time, or requested before."""
        if rc.name in self._is_up:
            return
        self._is_up[rc.name] = True
        self.record(
            trace.rc(
                now_s,
                rc.name,
                sharable=rc.sharable,
                capacity=rc.capacity,
                connect_s=rc.connect_s,
                disconnect_s=rc.disconnect_s,
            )
        )
        if not rc.up:
            self.record(trace.rc_state(now_s, rc.name, up=False), "not started yet")
        elif self._goes_on or rc.name in self._removed:
            self.record(trace.rc_state(now_s, rc.name, up=True), "it answers this RC manager")
        self._removed.discard(rc.name)

    def introduce_nodes(self, path: Path, now_s: float) -> None:
        """Introduce new nodes, new numbers and new parents on this path, parents first."""
        way: tuple[str, ...] = ()
        for name, number in path:
            parent = self._id(way) if way else None
            way = (*way, name)
            told = self._nodes.get(way)
            self._nodes[way] = (parent, number)
            if told == (parent, number) or (told is None and name.startswith(CONSOLE)):
                continue  # the request's line has a console's first number
            why = "its parent" if told is not None and told[0] != parent else "its number among its siblings"
            self.record(trace.node(now_s, self._id(way), parent, number), why)

    def nodes(self) -> list[tuple[str, ...]]:
        """Return the paths of all introduced nodes."""
        return [*self._nodes]

    def nodes_moved(self, old: tuple[str, ...], new: tuple[str, ...]) -> None:
        """Keep the id of each node at and below ``old``, which is now at ``new``: lines go on with the old ids."""
        self._ids = {carried(way, old, new): self._id(way) for way in self._nodes}
        self._nodes = {carried(way, old, new): told for way, told in self._nodes.items()}

    def record_request(self, arc: ArcEntry, now_s: float, *, idle: bool) -> None:
        """Write the ARC's request, and a line if it is idle; its owner's node was introduced."""
        name, number = arc.path[-1]
        owner = (
            trace.console_owner(name.removeprefix(CONSOLE), number)
            if name.startswith(CONSOLE)
            else self._id(arc.place_in_tree)
        )
        line = trace.request(
            now_s,
            arc.name,
            owner,
            minimum_s=arc.minimum_s,
            maximum_s=arc.maximum_s,
            uses={rc: use if rc in arc.shares else RcUse() for rc, use in arc.uses.items()},
            idle=idle,
        )
        self.record(line, f"asked by {arc.request.owner}")

    def _id(self, way: tuple[str, ...]) -> str:
        return self._ids.get(way, "/".join(way))
