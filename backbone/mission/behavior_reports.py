"""Messages between a behavior and its keeper: its parent in the tree, or the console that ordered it."""

from __future__ import annotations

from enum import StrEnum

from backbone.ranges import Mention, Text, Values
from backbone.wire import Message


class BehaviorStatus(StrEnum):
    """Progress of a behavior."""

    RUNNING = "running"  # at work, or suspended
    SUCCESS = "success"  # its aim is reached; final
    FAILURE = "failure"  # its aim cannot be reached; final

    @property
    def is_final(self) -> bool:
        """True for success and failure."""
        return self is not BehaviorStatus.RUNNING


class ChildReport(Message, frozen=True, tag="ChildReport/2"):
    """Progress of a behavior, sent to its parent on each change, and repeated until the parent confirms it.

    A behavior that a console ordered sends it to that console, several times a second, even without a change.

    Attributes:
        status: Its status; a final one is sent once and never changes.
        payload: Data for the parent's decision: plain values only.
        suspended_because: Why it does not run, also before its first grant; empty: it runs, or has finished.
    """

    child: Mention
    status: BehaviorStatus
    payload: Values = {}
    suspended_because: Text = ""


class ReportNoted(Message, frozen=True):
    """Answer to ``ChildReport``."""


class BreakOff(Message, frozen=True):
    """A console orders a behavior to stop the robot and to give no more commands.

    Afterwards the behavior has failed, and keeps the robot until it is ended, so that no other behavior gets it
    before the operator.
    """


class BrokenOff(Message, frozen=True):
    """Answer to ``BreakOff``: the behavior gives no more commands."""
