"""Decision log: publishes and writes the schedule manager's events and decisions.

Each line goes to the trace file, the shares of time, the RC manager's story, and subscribers. For recorders, each event
is published before its decision. From a snapshot and the events after it, a replay can decide again.
"""

from __future__ import annotations

from collections.abc import Callable

from backbone.bus.interface import Bus, Clock
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.rc_manager.messages import Decided, ScheduleSnapshot, TraceLine
from backbone.rc_manager.trace_file import TraceFile
from backbone.scheduling.events import Event, Record
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.shares import Shares
from backbone.scheduling.snapshot import NoSnapshot, written


class DecisionLog:
    """The decisions of one schedule manager.

    Args:
        bus: Bus of the RC manager.
        manager: The schedule manager; only read, never changed.
        note: Adds a subject and an event to the RC manager's story.
        trace_stopped: Called when the trace file can no longer be written.

    Attributes:
        shares: The shares of time of all RCs by the decisions so far.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        manager: ScheduleManager,
        note: Callable[[str, str], StoryEvent],
        trace_stopped: Callable[[], None],
    ) -> None:
        self._bus, self._clock, self._manager = bus, clock, manager
        self._note, self._trace_stopped = note, trace_stopped
        self._trace = TraceFile("")
        self._number = 0
        self.shares = Shares()

    def begin(self, trace: str) -> None:
        """Open the trace file at this path, if any, and publish the state before the first decision."""
        self._trace = TraceFile(trace, self._trace_stopped)
        if self._trace.stopped_by:
            self._trace_stopped()
        try:
            self._publish(self.snapshot())
        except NoSnapshot:
            self._note("", "its planner cannot be saved, so recordings have no state of the schedule")
        for record in self._manager.opening_lines():
            self.record(record)

    def decides_on(self, event: Event, at_s: float) -> None:
        """Publish that the schedule manager is about to decide on this event."""
        self._number += 1
        self._publish(Decided(self._number, at_s, event))

    def snapshot(self) -> ScheduleSnapshot:
        """Return the state of the schedule.

        Raises:
            NoSnapshot: The mission has a planner of its own.
        """
        return ScheduleSnapshot(self._number, self._clock.now_s(), written(self._manager))

    def record(self, record: Record) -> None:
        """Write and publish one line of a decision."""
        line = dict(record.line)
        self.shares.take(line)
        self._trace.write(line)
        subject = str(line.get("arc") or line.get("id") or "")
        self._note(subject, f"{line['ev']}{': ' + record.cause if record.cause else ''}")
        self._bus.publish(self._bus.source, Conversation.EVENTS, TraceLine(line, record.cause))

    @property
    def why_no_trace(self) -> str:
        """Why the trace file ended early; empty: it did not."""
        return f"the trace of the schedule stopped: {self._trace.stopped_by}" if self._trace.stopped_by else ""

    async def end(self) -> None:
        """End the trace file; see ``TraceFile.close``."""
        self._trace.write({"ev": "end", "t": round(self._clock.now_s(), 6)})
        await self._trace.close()

    def _publish(self, message: Decided | ScheduleSnapshot) -> None:
        self._bus.publish(self._bus.source, Conversation.DECISIONS, message)
