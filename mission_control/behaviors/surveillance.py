"""Surveillance: runs several watchers and collects their events.

Source: IROS 2001, "Surveillance": behaviors of equal priority watch the same room.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.keys import Conversation
from backbone.mission.behavior_nodes import walk
from backbone.spoken import counted
from backbone.wire import Envelope
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.children import Decision
from mission_control.messages import BehaviorStatus, MotionSeen


class SurveillanceParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Surveillance``.

    Attributes:
        retries: Number of restarts of a failed child before the others continue without it.
    """

    retries: int = 3


class Surveillance(Behavior[SurveillanceParameters]):
    """Starts its children, collects their events, and continues while one of them can watch."""

    parameters_type = SurveillanceParameters

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._events, self._failures = Counter[str](), Counter[str]()
        self._last: MotionSeen | None = None
        self._watched = set[str]()

    async def start(self) -> None:
        """Subscribe to all watchers of this branch."""
        self.children_changed()

    def children_changed(self) -> None:
        """Subscribe to new watchers; a removed watcher publishes no more."""
        for path, _node in walk(self.parameters.children):
            if path[-1][0] not in self._watched:
                self._watched.add(path[-1][0])
                watcher = f"mission_control/{path[-1][0]}"
                self.bus.subscribe(watcher, Conversation.EVENTS, MotionSeen, self._heard)
        self._say()

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, object]) -> Decision:
        """Start a failed watcher again ``retries`` times, then continue without it."""
        if status is BehaviorStatus.FAILURE:
            self._failures[child] += 1
            self.publish_event(child, f"failed: {payload.get('detail', 'no reason given')}", LogLevel.WARNING)
        retry = status is BehaviorStatus.FAILURE and self._failures[child] <= self.parameters.retries
        return Decision.RETRY if retry else Decision.NEXT

    def statistics(self) -> dict[str, float]:
        """Return the base's counters and the events by robot."""
        return {**super().statistics(), **{f"events_{robot}": count for robot, count in self._events.items()}}

    def _heard(self, envelope: Envelope[MotionSeen]) -> None:
        self._last = envelope.body
        self._events[envelope.body.robot] += 1
        self.tell_parent({"events": dict(self._events), "last_event_s": envelope.body.at_s})
        self._say()

    def _say(self) -> None:
        by_robot = ", ".join(f"{robot} {count}" for robot, count in sorted(self._events.items()))
        watchers = counted(len(self.parameters.children), "watcher")
        last = f", last at {self._last.at_s:.1f} s through {self._last.robot}" if self._last else ""
        self.report(
            f"{watchers}, {counted(self._events.total(), 'event')}{last} ({by_robot})"
            if by_robot
            else f"{watchers}, no event yet"
        )
