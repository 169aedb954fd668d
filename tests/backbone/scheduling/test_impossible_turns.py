"""What a planner of one's own may never do ends at once with the reason, and changes no hardware."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest
from simulated_switches import Bench, ask, manager, unit

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.planner import Turn
from backbone.scheduling.requests import RequestState
from backbone.scheduling.whole_group import WholeGroupPlanner


class Beside(WholeGroupPlanner):
    """Connects a waiting ARC beside the holder of its RC."""

    def due(self, now_s: float) -> Turn | None:
        waiting = [arc for arc in self._state.arcs.values() if arc.state is RequestState.WAITING]
        return Turn(waiting[0], []) if waiting else None


class Again(WholeGroupPlanner):
    """Gives the first ARC turn after turn."""

    def due(self, now_s: float) -> Turn | None:
        return next((Turn(arc, []) for arc in self._state.arcs.values()), None)


class RevokesAgain(WholeGroupPlanner):
    """Revokes a holder that is being disconnected already."""

    def due(self, now_s: float) -> Turn | None:
        arcs = [*self._state.arcs.values()]
        return Turn(arcs[1], arcs[:1]) if len(arcs) > 1 else super().due(now_s)


class Copied(WholeGroupPlanner):
    """Gives a turn to a copy of an ARC."""

    def due(self, now_s: float) -> Turn | None:
        turn = super().due(now_s)
        return turn and Turn(replace(turn.arc), turn.in_the_way)


class Twice(WholeGroupPlanner):
    """Puts each ARC into the order twice."""

    def order(self, arcs: Iterable[ArcEntry]) -> list[ArcEntry]:
        return [arc for arc in super().order(arcs) for _ in range(2)]


class Nobody(WholeGroupPlanner):
    """Forgets the queued ARCs."""

    def order(self, arcs: Iterable[ArcEntry]) -> list[ArcEntry]:
        return []


@pytest.mark.parametrize(
    ("planner", "reason"),
    [
        (Beside, "the planner connects second, but first holds its RCs"),
        (Again, "the planner's turn names first, which is connecting, not waiting"),
        (RevokesAgain, "the planner's turn names first, which is revoking, not connecting or running"),
        (Copied, "the planner's turn names first, but not the ARC in the schedule"),
        (Twice, "the planner's order is first, first, not each queued ARC once"),
        (Nobody, "the planner's order is nothing, not each queued ARC once"),
    ],
    ids=lambda given: given.__name__ if isinstance(given, type) else "",
)
def test_a_turn_that_cannot_be_carried_out_is_named(planner: type[WholeGroupPlanner], reason: str) -> None:
    bench = Bench(manager(planner=f"{__name__}:{planner.__name__}"), unit("v"))

    def two_ask() -> None:
        for arc in ("first", "second"):
            bench.tell(ask(arc, "v", run_s=1.0))
        bench.run(10.0)

    with pytest.raises(AssertionError, match=reason):
        two_ask()
    connected = [line["arc"] for line in bench.trace if line["ev"] == "connect"]
    assert len(connected) == len({*connected}), "an ARC is connected twice"
